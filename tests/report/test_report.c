/* SPDX-License-Identifier: Apache-2.0 */
/* tests/report/test_report.c -- the page of a run: whole, escaped, without the network, whatever is
   missing. */
#include <ctype.h>
#include <jansson.h>

#include "base/image.h"
#include "base/rng.h"
#include "folder.h"
#include "gbtrace/version.h"
#include "report/plot.h"
#include "report/image.h"
#include "report/log.h"
#include "report/report.h"
#include "report/text.h"
#include "report/views.h"

static void write_picture(const char *name, int width, int height, int channels, float red)
{
    image im;
    assert_ok(image_alloc(&im, width, height, channels, &assert_ok_err_));
    for (int i = 0; i < width * height * channels; i++)
        im.pixels[i] = i % channels == 0 ? red : (float)(i % 17) / 17.0f;
    assert_ok(image_write(in_folder("%s", name), &im, &assert_ok_err_));
    image_free(&im);
}

/* ---- what a page must be ---- */

/** The page without the pixels: what "data:" URIs hold is arbitrary text. Free with free(). */
static char *read_page(void)
{
    unsigned char *bytes;
    size_t count, used = 0;
    assert_ok(file_read(in_folder("report.html"), &bytes, &count, &assert_ok_err_));
    assert_int_equal(strlen((char *)bytes), count);
    char *page = malloc(count + 1);
    assert_non_null(page);
    for (size_t i = 0; i < count;) {
        static const char start[] = "data:image/jpeg;base64,", other_start[] = "data:image/png;base64,";
        const bool is_jpeg = strncmp((char *)bytes + i, start, sizeof start - 1) == 0;
        if (is_jpeg || strncmp((char *)bytes + i, other_start, sizeof other_start - 1) == 0) {
            memcpy(page + used, "PIXELS", 6);
            used += 6;
            i += is_jpeg ? sizeof start - 1 : sizeof other_start - 1;
            const size_t first = i;
            while (isalnum(bytes[i]) || bytes[i] == '+' || bytes[i] == '/' || bytes[i] == '=')
                i++;
            assert_int_equal((i - first) % 4, 0);
            assert_int_equal(bytes[i], '"');
            assert_memory_equal(bytes + first, is_jpeg ? "/9j/" : "iVBO", 4); /* FF D8 FF: a JPEG; 89 50 4E: a
                                                                                 PNG */
        } else {
            page[used++] = (char)bytes[i++];
        }
    }
    page[used] = '\0';
    mem_free(bytes);
    return page;
}

static size_t occurrences(const char *page, const char *what)
{
    size_t count = 0;
    for (const char *at = page; (at = strstr(at, what)) != NULL; at += strlen(what))
        count++;
    return count;
}

static bool is_void_element(const char *name)
{
    static const char *const names[] = {"meta", "img", "input", "br", "hr", "link"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(name, names[i]) == 0)
            return true;
    return false;
}

/** Every element is closed, in order; attributes are quoted; a text holds no bare < or >. */
static void assert_balanced(const char *page)
{
    char open[64][32];
    int depth = 0;
    const char *at = page;
    while (*at != '\0') {
        if (*at == '>')
            fail_msg("bare > before: %.60s", at);
        if (*at != '<') {
            at++;
            continue;
        }
        if (at[1] == '!') {
            at = strchr(at, '>') + 1;
            continue;
        }
        char name[32] = "";
        const bool closes = at[1] == '/';
        at += closes ? 2 : 1;
        size_t n = 0;
        while (isalnum((unsigned char)*at) && n < sizeof name - 1)
            name[n++] = *at++;
        name[n] = '\0';
        if (n == 0)
            fail_msg("bare < before: %.60s", at);
        bool quoted = false, self_closed = false;
        for (; *at != '\0' && (quoted || *at != '>'); at++) {
            quoted = quoted != (*at == '"');
            self_closed = *at == '/' && at[1] == '>';
            assert_true(*at != '<');
        }
        assert_int_equal(*at, '>');
        at++;
        if (closes) {
            if (depth == 0 || strcmp(open[depth - 1], name) != 0)
                fail_msg("</%s> closes <%s> before: %.60s", name, depth > 0 ? open[depth - 1] : "nothing",
                         at);
            depth--;
        } else if (!self_closed && !is_void_element(name)) {
            assert_true(depth < 64);
            snprintf(open[depth++], sizeof open[0], "%s", name);
            if (strcmp(name, "script") == 0 || strcmp(name, "style") == 0) /* not markup inside */
                at = strstr(at, strcmp(name, "script") == 0 ? "</script" : "</style");
        }
    }
    assert_int_equal(depth, 0);
}

/** As a word or a number, not inside a word: nan, -nan, inf. */
static void assert_no_number_word(const char *page, const char *word)
{
    const size_t length = strlen(word);
    for (const char *at = page; *at != '\0'; at++)
        if (strncasecmp(at, word, length) == 0 && !isalpha((unsigned char)at[length]) &&
            (at == page || !isalpha((unsigned char)at[-1])))
            fail_msg("%s: %.80s", word, at > page + 30 ? at - 30 : page);
}

/** Everything that must hold whatever went in; returns the page, free with free(). */
static char *check_page(void)
{
    char *page = read_page();
    assert_balanced(page);
    assert_no_number_word(page, "nan");
    assert_no_number_word(page, "inf");
    assert_null(strstr(page, "http:"));
    assert_null(strstr(page, "https:"));
    assert_null(strstr(page, "src=\"/"));
    assert_null(strstr(page, "url("));
    assert_null(strstr(page, "(null)"));
    assert_int_equal(strncmp(page, "<!DOCTYPE html>", 15), 0);
    assert_int_equal(occurrences(page, "<h1>"), 1);
    assert_non_null(strstr(page, "prefers-color-scheme:dark"));
    for (const char *at = page; (at = strstr(at, "style=\"--ratio:")) != NULL; at++)
        assert_true(atof(at + 15) > 0);
    return page;
}

/* ---- inputs ---- */

static const char log_header[] =
    "step,seconds,progress,width,height,loss,l1,ssim,train_psnr,test_psnr,anchors,gaussians,visible_anchors,"
    "blended_per_ray,rays_per_second,memory_bytes\n";

static const char stage_names[] = ",photo_ms,rays_ms,visible_ms,decode_ms,build_ms,trace_ms,loss_ms,adjoint_"
                                  "ms,decode_adjoint_ms,optimizer_ms,adjust_ms\n";

static void write_log(int rows, const char *tail)
{
    char *csv = malloc((size_t)rows * 192 + 4096);
    assert_non_null(csv);
    int used = sprintf(csv, "%.*s%s", (int)strlen(log_header) - 1, log_header, stage_names);
    for (int i = 0; i < rows; i++)
        used +=
            sprintf(csv + used,
                    "%d,%.3f,0.1,240,180,%.6f,0.1,0.5,%.4f,,%d,%d,300,20.5,%d,1000,1,2,3,4,5,6,7,8,9,10,11\n",
                    10 * (i + 1), 1.01 * (i + 1), 0.4 / (1 + i), 10 + 15.0 * i / rows, 1000 + i, 5000 + 7 * i,
                    400000 + 100 * i);
    strcpy(csv + used, tail);
    write_text(in_folder("log.csv"), csv);
    free(csv);
}

static json_t *full_metrics(void)
{
    return json_pack(
        "{s:s,s:s,s:s,s:s,s:i,s:i,s:i,s:i,s:i,s:f,s:f,s:f,s:f,s:{s:f,s:f,s:f,s:f},s:[i,i,i],s:[{s:f,s:i,s:f}]"
        ",s:f,s:s,s:i,s:i,s:s,s:s,s:I,s:s}",
        "command", "gbtrace train 'a <b> & \"c\"' -o run", "data", "/data/<script>alert(1)</script>/",
        "start", "900 sparse points", "protocol", "8-bit images", "points", 900, "anchors_initial", 700,
        "anchors_final", 1234567, "iterations", 1000, "skipped_steps", 0, "train_seconds", 61.5,
        "rays_per_second", 387187.4, "hits_per_ray", 87.7, "blended_per_ray", 75.6, "stage_ms_per_step",
        "trace", 146.9, "adjoint", 90.6, "build", 32.4, "all", 300.1, "pace", 333, 333, 334, "held_out",
        "seconds", 20.1, "step", 168, "psnr", 19.88, "downscale", 2.0, "eval_split", "every=8", "seed", 7,
        "threads", 2, "isa", "avx2", "embree_version", "3.13.5", "peak_memory_bytes", (json_int_t)2518880256,
        "scored", "right half, fitted to the left");
}

static evaluation make_views(size_t count)
{
    evaluation e = {.view_count = count,
                    .psnr = 24.25,
                    .ssim = 0.8125,
                    .flip = 0.125,
                    .gaussians_per_view = 54321,
                    .anchors = 1234567,
                    .model_bytes = 5182216};
    e.views = calloc(count + 1, sizeof *e.views);
    assert_non_null(e.views);
    for (size_t i = 0; i < count; i++) {
        view_score *v = &e.views[i];
        snprintf(v->name, sizeof v->name, "view_%zu.jpg", i);
        v->psnr = 20 + (double)((i * 7) % count);
        v->ssim = 0.5;
        v->flip = 0.25;
        v->seconds = 0.125;
        v->gaussians = 54321;
        snprintf(v->render_path, VIEW_PATH_SIZE, "%s", in_folder("render.png"));
        snprintf(v->photo_path, VIEW_PATH_SIZE, "%s", in_folder("photo.png"));
        snprintf(v->error_path, VIEW_PATH_SIZE, "%s", in_folder("error.png"));
    }
    return e;
}

static void write_pictures(void)
{
    write_picture("render.png", 24, 16, 3, 0.25f);
    write_picture("photo.png", 24, 16, 3, 0.75f);
    write_picture("error.png", 24, 16, 1, 0.5f);
    write_text(in_folder("config"), "");
}

static char *write_report(const evaluation *e, const json_t *metrics)
{
    assert_ok(report_write(test_folder, e, metrics, NULL, &assert_ok_err_));
    return check_page();
}

/* ---- the page ---- */

static void whole_page(void **state)
{
    (void)state;
    write_pictures();
    /* ends with a score of held-out photos, which are seen at full size */
    write_log(
        50,
        "500,50.6,0.1,480,360,0.01,0.1,0.5,24,24,1050,5350,300,20.5,405000,1000,1,2,3,4,5,6,7,8,9,10,11\n");
    evaluation e = make_views(3);
    strcpy(e.views[1].name, "<img src=x onerror='a'>&\"\xff\x01.jpg");
    json_t *metrics = full_metrics();
    assert_non_null(metrics);
    char *page = write_report(&e, metrics);
    static const struct {
        const char *text;
        size_t least;
    } wanted[] = {
        {"&lt;img src=x onerror=&#39;a&#39;&gt;&amp;&quot;\xef\xbf\xbd?.jpg", 5}, /* heading, slider, three
                                                                                     pictures' texts */
        {"<h1>script&gt;</h1>", 1}, /* the last part of the path */
        {"gbtrace train &#39;a &lt;b&gt; &amp; &quot;c&quot;&#39; -o run", 1},
        {"gbtrace train --config ", 1},
        {"--pace 333,333,334", 1},
        {"24.25", 1},
        {"0.8125", 1},
        {"0.1250", 1},
        {"1,234,567", 2},
        {"54,321", 2},
        {"5.18 MB", 2},
        {"61.5 s", 2},
        {"5,182,216 bytes", 1},
        {"2.52 GB", 1},
        {"PIXELS", 9},
        {"type=\"range\"", 3},
        {"<svg ", 5},
        {"<title>", 100},
        {"held-out 19.88 at 20.10 s", 1},
        {"held-out 24.25 at 61.50 s", 1},
        {"avx2", 1},
        {"every=8", 1},
        {"900 sparse points", 1},
        {"How it is scored: 8-bit images; right half, fitted to the left.", 1},
        {"grow and prune", 1},
        {">Render, s<", 1},
        {"<th>One held-out view</th><td>0.125\xc2\xa0"
         "s: decode",
         1},
        {"Made by gbtrace " GBT_VERSION, 1},
        {"\xc2\xa0ms</td>", 1},
    };
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
        if (occurrences(page, wanted[i].text) < wanted[i].least)
            fail_msg("\"%s\": %zu times, wanted %zu", wanted[i].text, occurrences(page, wanted[i].text),
                     wanted[i].least);
    assert_null(strstr(page, "<img src=x"));
    assert_null(strstr(page, "<script>alert"));
    assert_null(strstr(page, "class=\"none\""));
    assert_true(strstr(page, "<h2>Held-out views") < strstr(page, "<h2>Training"));
    assert_true(strstr(page, "<h2>Training") < strstr(page, "<h2>Where the time goes"));
    assert_int_equal(occurrences(page, "made smaller by a factor of</th><td>2</td>"), 1);
    free(page);
    json_object_set_new(metrics, "downscale", json_real(1)); /* nothing is made smaller: no row about it */
    page = write_report(&e, metrics);
    assert_int_equal(occurrences(page, "made smaller by a factor of"), 0);
    free(page);
    json_decref(metrics);
    free(e.views);
}

typedef struct bare_case {
    const char *name, *log;
    bool has_metrics;
    size_t views;
    bool has_pictures;
    size_t empty_charts;
} bare_case;

static const bare_case bare_cases[] = {
    {"nothing at all", NULL, false, 0, false, 8},
    {"no views", "full", true, 0, false, 0},
    {"no log: the PSNR chart still has its points", NULL, true, 2, true, 6},
    {"an empty log", "", true, 2, true, 6},
    {"a header alone", "header", true, 2, true, 6},
    {"a log of something else", "a,b\n1,2\n", true, 1, true, 6},
    {"pictures are gone", "full", true, 2, false, 0},
};

static void bare_page(void **state)
{
    const bare_case *c = *state;
    write_pictures();
    if (!c->has_pictures) {
        unlink(in_folder("render.png"));
        unlink(in_folder("photo.png"));
        write_text(in_folder("error.png"), "\x89PNG\r\n\x1a\n"); /* torn */
    }
    unlink(in_folder("log.csv"));
    if (c->log != NULL && strcmp(c->log, "full") == 0)
        write_log(20, "");
    else if (c->log != NULL)
        write_text(in_folder("log.csv"), strcmp(c->log, "header") == 0 ? log_header : c->log);
    evaluation e = make_views(c->views);
    json_t *metrics = c->has_metrics ? full_metrics() : NULL;
    if (c->views == 0) {
        e.psnr = e.ssim = e.flip = e.gaussians_per_view = (double)NAN;
        e.model_bytes = e.anchors = 0;
    } else {
        e.views[0].psnr = (double)NAN;
        e.views[0].ssim = (double)NAN;
        e.views[0].flip = (double)NAN;
    }
    char *page = write_report(&e, metrics);
    assert_int_equal(occurrences(page, "n/a: nothing was"), c->empty_charts);
    assert_int_equal(occurrences(page, "n/a: every photo was trained on"), c->views == 0);
    assert_int_equal(occurrences(page, "PIXELS"), c->has_pictures ? 3 * c->views : 0);
    assert_int_equal(occurrences(page, "class=\"missing\""), c->has_pictures ? 0 : 3 * c->views);
    assert_int_equal(occurrences(page, "class=\"compare\""), c->views);
    assert_int_equal(occurrences(page, "command: n/a</p>"), !c->has_metrics);
    assert_true(occurrences(page, "n/a") > 0);
    free(page);
    json_decref(metrics);
    free(e.views);
}

static char *page_of_log(int rows)
{
    write_log(rows, "");
    evaluation e = make_views(1);
    json_t *metrics = full_metrics();
    char *page = write_report(&e, metrics);
    json_decref(metrics);
    free(e.views);
    return page;
}

/* A dot for each of the seven lines, and layers over the time before it. */
static void one_row(void **state)
{
    (void)state;
    char *page = page_of_log(1);
    assert_int_equal(occurrences(page, "n/a: nothing was"), 0);
    assert_int_equal(occurrences(page, "r=\"4\"/>"), 7);
    const char *layer = strstr(page, "<path class=\"area s0\" d=\"M50.0 ");
    assert_non_null(layer);
    assert_int_equal(strncmp(strstr(layer, "L"), "L448.0 ", 7), 0);
    free(page);
    page = page_of_log(50);
    assert_int_equal(occurrences(page, "r=\"4\"/>"), 0);
    free(page);
}

/* ---- the scene ---- */

enum { POINTS = 200, VIEWS = 5 };

/**
 * A cloud in a box, an untrained model of it, cameras around it; the photos are the pictures of this folder.
 * Free with loaded_run_close().
 */
static loaded_run *make_run(gbt_camera_model lens)
{
    loaded_run *r = calloc(1, sizeof *r);
    assert_non_null(r);
    r->def = gbt_train_def_default();
    r->settings = trace_settings_default();
    scene *s = &r->scene;
    s->view_count = VIEWS;
    s->points.count = POINTS;
    s->points.has_color = true;
    s->views = mem_calloc(VIEWS, sizeof *s->views, "views", NULL);
    s->points.position = mem_calloc(POINTS, 3 * sizeof(float), "points", NULL),
    s->points.color = mem_calloc(POINTS, 3 * sizeof(float), "points", NULL);
    r->model.anchors.offset_count = 2;
    r->model.voxel_size = 0.1f;
    assert_ok(anchors_resize(&r->model.anchors, POINTS, &assert_ok_err_));
    assert_ok(decoder_init(&r->model.decoder, 2, false, 1, &assert_ok_err_));
    for (uint64_t i = 0; i < 3 * POINTS; i++) {
        s->points.position[i] = r->model.anchors.position[i] = 2 * rng_uniform(1, 0, i) - 1;
        s->points.color[i] = rng_uniform(2, 0, i);
    }
    for (size_t i = 0; i < 6 * POINTS; i++)
        r->model.anchors.scale_log[i] = -2;
    for (int i = 0; i < VIEWS; i++) {
        const double at[3] = {4 * cos(i), -1, 4 * sin(i)}, middle[3] = {0, 0, 0}, up[3] = {0, -1, 0};
        scene_view *v = &s->views[i];
        char name[32];
        snprintf(name, sizeof name, "view_%d<&>.jpg", i);
        v->name = strdup(name);
        v->path = mem_calloc(VIEW_PATH_SIZE, 1, "path", NULL);
        v->is_test = i < 2;
        snprintf(v->path, VIEW_PATH_SIZE, "%s", in_folder("photo.png"));
        v->camera = (gbt_camera){.model = lens, .width = 24, .height = 16, .params = {24, 24, 12, 8}};
        assert_true(gbt_camera_look_at(at, middle, up, &v->camera));
    }
    assert_ok(photos_open(&r->photos, s, 1, &assert_ok_err_));
    return r;
}

static void close_run(loaded_run *r)
{
    for (int i = 0; i < VIEWS; i++) { /* strdup's are free()'s */
        free(r->scene.views[i].name);
        r->scene.views[i].name = NULL;
    }
    loaded_run_close(r);
    free(r);
}

static void scene_on_the_page(void **state)
{
    (void)state;
    static const struct {
        gbt_camera_model lens;
        size_t layers;
        bool has_photos, has_points;
    } cases[] = {{GBT_CAMERA_PINHOLE, 6, true, true},
                 {GBT_CAMERA_PINHOLE, 5, false, true},
                 {GBT_CAMERA_PINHOLE, 4, true, false},
                 {GBT_CAMERA_EQUIRECTANGULAR, 0, true, true}};
    write_log(5, "");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_pictures();
        evaluation e = make_views(2);
        loaded_run *r = make_run(cases[i].lens);
        for (size_t k = 0; k < 2; k++)
            snprintf(e.views[k].name, sizeof e.views[k].name, "%s", r->scene.views[k].name);
        e.views[1].psnr = (double)NAN;
        if (!cases[i].has_photos)
            unlink(in_folder("photo.png"));
        if (!cases[i].has_points)
            r->scene.points.count = 0;
        snprintf(r->model.config, sizeof r->model.config, "init = gb\nnoise\nseed = <7>\n");
        assert_ok(report_write(test_folder, &e, NULL, &(report_more){.open = r}, &assert_ok_err_));
        char *page = check_page();
        assert_int_equal(occurrences(page, "<figure class=\"card\"><img"), cases[i].layers);
        assert_int_equal(occurrences(page, "class=\"camera\""), 2 * (VIEWS - 2));
        assert_int_equal(occurrences(page, "class=\"camera held\""), 2 * 2);
        assert_int_equal(occurrences(page, "href=\"#view-1\""), 2 + 1); /* both maps, and the table */
        assert_int_equal(occurrences(page, "href=\"PIXELS\""), 2);
        assert_int_equal(occurrences(page, "href=\"#layers\""), cases[i].layers > 0);
        assert_int_equal(occurrences(page, "<section id=\"layers\">"), cases[i].layers > 0);
        assert_int_equal(occurrences(page, "One view, view_0"), cases[i].layers > 0); /* that has a score */
        assert_int_equal(occurrences(page, "<th>seed</th><td>&lt;7&gt;</td>"), 1);
        free(page);
        close_run(r);
        free(e.views);
    }
}

/** Cameras along a slanted line: on both maps it lies across, and the camera in the middle is between the
 * ends. */
static void maps_lie_along_the_cameras(void **state)
{
    (void)state;
    write_log(5, "");
    write_pictures();
    evaluation e = make_views(2);
    loaded_run *r = make_run(GBT_CAMERA_PINHOLE);
    for (int i = 0; i < VIEWS; i++) {
        const double at[3] = {i - 2, -4, 3 * (i - 2)}, ahead[3] = {at[0] + 3, -4, at[2] - 1},
                     up[3] = {0, -1, 0};
        assert_true(gbt_camera_look_at(at, ahead, up, &r->scene.views[i].camera));
    }
    assert_ok(report_write(test_folder, &e, NULL, &(report_more){.open = r}, &assert_ok_err_));
    char *page = check_page();
    const char *at = page;
    for (int map = 0; map < 2; map++) {
        double x[VIEWS], y[VIEWS];
        for (int i = 0; i < VIEWS; i++) {
            at = strstr(at, "<path class=\"camera");
            assert_non_null(at);
            at = strstr(at, " d=\"M");
            assert_int_equal(sscanf(at, " d=\"M%lf %lf", &x[i], &y[i]), 2);
        }
        double least = x[0], most = x[0];
        for (int i = 0; i < VIEWS; i++) {
            assert_true(fabs(y[i] - y[0]) <= 0.2);
            least = fmin(least, x[i]);
            most = fmax(most, x[i]);
        }
        assert_true(most - least > 100);
    }
    free(page);
    close_run(r);
    free(e.views);
}

/** The layers of a step's time are as high as the log says: 1 + 2, 3 + 4, 5, 6 ... 11 ms. */
static void layers_have_the_logged_heights(void **state)
{
    (void)state;
    static const double wanted[] = {3, 7, 5, 6, 7, 8, 9, 10, 11};
    enum { LAYERS = sizeof wanted / sizeof *wanted };
    write_log(50, "");
    const evaluation none = {0};
    char *page = write_report(&none, NULL);
    double top[LAYERS + 1], x;
    const char *at = strstr(page, "<path class=\"area ");
    assert_non_null(at);
    const char *end = strchr(at, 'Z');
    while (*end != 'L')
        end--;
    assert_int_equal(sscanf(end, "L%lf %lf", &x, &top[0]), 2);
    for (int k = 0; k < LAYERS; k++, at++) {
        at = strstr(at, "<path class=\"area ");
        assert_non_null(at);
        assert_int_equal(sscanf(strstr(at, " d=\"M"), " d=\"M%lf %lf", &x, &top[k + 1]), 2);
    }
    for (int k = 0; k < LAYERS; k++)
        assert_true(fabs((top[k] - top[k + 1]) - wanted[k] * (top[0] - top[LAYERS]) / 66) < 0.25);
    free(page);
}

/** Values that no sane run has, of the wrong type or out of range. */
static void odd_metrics(void **state)
{
    (void)state;
    write_pictures();
    char csv[2048];
    snprintf(csv, sizeof csv, "%s%s", log_header,
             "1,1,0,120,90,-1,0,0,1e308,,1e308,-1e308,0,0,1e-320,0\n2,2,0,-5,1e300,0,0,0,-1e308,,0,0,0,0,"
             "1e305,0\n3,1e300,0,1,1,inf,0,0,nan,,nan,0x10,0,0,,0\n");
    write_text(in_folder("log.csv"), csv);
    evaluation e = make_views(1);
    e.views[0].ssim = -1e300;
    e.views[0].flip = 1e300;
    e.views[0].seconds = 1e300;
    static const char *const texts[] = {
        "{\"command\": 5, \"data\": null, \"pace\": [1, \"x\"], \"held_out\": 3, \"stage_ms_per_step\": [1], "
        "\"seed\": \"s\", \"iterations\": -5}",
        "{\"command\": \"\", \"data\": \"/\", \"pace\": [], \"held_out\": [1, null, {\"seconds\": 1e300, "
        "\"psnr\": 1e300}, {\"seconds\": -4, \"psnr\": 3}], \"stage_ms_per_step\": {\"all\": -3, \"trace\": "
        "1e308, \"build\": -1, \"loss\": 0}, \"train_seconds\": 1e300, \"iterations\": 1e300, \"isa\": {}}",
        "{\"train_seconds\": -1, \"peak_memory_bytes\": 1e300, \"stage_ms_per_step\": {\"all\": 0, "
        "\"trace\": 0}, \"downscale\": -0.0}",
        "[]",
        "3",
        "{}",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        json_t *metrics = json_loads(texts[i], JSON_DECODE_ANY, NULL);
        assert_non_null(metrics);
        char *page = write_report(&e, metrics);
        assert_null(strstr(page, "--pace "));
        free(page);
        json_decref(metrics);
    }
    free(e.views);
}

/* The command that went on says neither the data nor the settings. */
static void a_resumed_run_is_made_again(void **state)
{
    (void)state;
    write_pictures();
    write_log(5, "");
    evaluation e = make_views(1);
    json_t *metrics = full_metrics();
    json_object_set_new(metrics, "command", json_string("gbtrace train -o run --resume --pace 1,2 --quiet"));
    char *page = write_report(&e, metrics), wanted[VIEW_PATH_SIZE];
    snprintf(wanted, sizeof wanted, ">gbtrace train --config %s/config -o NEW --pace 333,333,334</pre>",
             test_folder);
    assert_non_null(strstr(page, wanted));
    free(page);
    json_decref(metrics);
    free(e.views);
}

static void many_views(void **state)
{
    (void)state;
    write_pictures();
    write_log(5, "");
    for (size_t count = REPORT_MAX_VIEWS - 1; count <= REPORT_MAX_VIEWS + 2; count++) {
        evaluation e = make_views(count);
        size_t shown[REPORT_MAX_VIEWS], order[64], seen[64] = {0};
        const size_t shown_count = report_choose_views(&e, shown, order);
        assert_int_equal(shown_count, count < REPORT_MAX_VIEWS ? count : REPORT_MAX_VIEWS);
        for (size_t i = 0; i < shown_count; i++)
            assert_int_equal(seen[shown[i]]++, 0);
        for (size_t i = 1; i < count; i++)
            assert_true(e.views[order[i - 1]].psnr <= e.views[order[i]].psnr);
        assert_int_equal(shown[0], order[0]);
        assert_int_equal(shown[shown_count - 1], order[count - 1]);
        char *page = write_report(&e, NULL);
        assert_int_equal(occurrences(page, "class=\"compare\""), shown_count);
        assert_int_equal(occurrences(page, "Shown are 24 of "), count > REPORT_MAX_VIEWS);
        assert_int_equal(occurrences(page, "<tr data-place="), count); /* the table has them all */
        for (size_t i = 0; i < count; i++) {                           /* what leads to a view finds it */
            char id[32];
            snprintf(id, sizeof id, "id=\"view-%zu\"", i);
            assert_int_equal(occurrences(page, id), 1);
        }
        free(page);
        free(e.views);
    }
    evaluation e = make_views(40);
    e.views[3].psnr = (double)NAN;
    size_t shown[REPORT_MAX_VIEWS], order[40];
    report_choose_views(&e, shown, order);
    assert_int_equal(order[39], 3);
    assert_int_equal(shown[8], order[15]); /* 8 around the middle: places 15 to 22 of 39 */
    assert_int_equal(shown[REPORT_MAX_VIEWS - 1], order[38]);
    char *page = write_report(&e, NULL);
    assert_int_equal(occurrences(page, "class=\"meter\""), 39);
    assert_int_equal(occurrences(page, "data-psnr="), REPORT_MAX_VIEWS);
    free(page);
    for (size_t i = 0; i < 30; i++)
        e.views[i].psnr = (double)NAN;
    report_choose_views(&e, shown, order);
    assert_memory_equal(shown, order, sizeof shown); /* all 10 that have a score, no view twice */
    free(e.views);
}

static void no_memory(void **state)
{
    (void)state;
    write_pictures();
    write_log(20, "");
    evaluation e = make_views(1);
    json_t *metrics = full_metrics();
    unlink(in_folder("report.html"));
    const char *path = in_folder("report.html");
    gbt_status status = GBT_ERR_NO_MEMORY;
    for (long n = 0; status != GBT_OK; n++) {
        gbt_error err = {0};
        assert_true(n < 500);
        mem_fail_after(n);
        status = report_write(test_folder, &e, metrics, NULL, &err);
        mem_fail_after(-1);
        if (status == GBT_OK)
            break;
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_int_equal(err.status, GBT_ERR_NO_MEMORY);
        assert_false(file_exists(path)); /* nothing half written */
    }
    free(check_page());
    json_decref(metrics);
    free(e.views);
}

static void not_a_folder(void **state)
{
    (void)state;
    evaluation e = {0};
    gbt_error err = {0};
    assert_int_equal(report_write("/nonexistent/run", &e, NULL, NULL, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "/nonexistent/run/report.html"));
}

/* ---- log.csv ---- */

typedef struct log_case {
    const char *name, *rows;
    size_t count;
    double last_step, last_loss;
} log_case;

static const log_case log_cases[] = {
    {"whole rows", "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n2,2.0,0,8,6,0.25,0,0,9,,5,6,0,0,7,0\n", 2, 2, 0.25},
    {"torn in a number", "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n2,2.0,0,8,6,0.2", 1, 1, 0.5},
    {"torn before its end of line", "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n2,2.0,0,8,6,0.2,0,0,9,,5,6,0,0,7,1",
     1, 1, 0.5},
    {"too few fields", "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n2,2.0,0\n", 1, 1, 0.5},
    {"too many fields", "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0,9\n", 0, 0, 0},
    {"no time", "1,x,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n", 0, 0, 0},
    {"DOS line ends", "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\r\n", 1, 1, 0.5},
    {"resumed from step 1",
     "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n3,3.0,0,8,6,0.2,0,0,9,,5,6,0,0,7,0\n2,2.0,0,8,6,0.3,0,0,9,,5,6,0,0,"
     "7,0\n",
     2, 2, 0.3},
    {"a score right after a row has no loss",
     "1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n1,1.0,0,8,6,0,0,0,0,21.5,5,0,0,0,0,0\n", 2, 1, NAN},
    {"time that falls", "1,2.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n2,1.0,0,8,6,0.2,0,0,9,,5,6,0,0,7,0\n", 1, 1,
     0.5},
    {"zero bytes, blank lines", "\n\n1,1.0,0,8,6,0.5,0,0,9,,5,6,0,0,7,0\n\n", 1, 1, 0.5},
};

static void reads_log(void **state)
{
    const log_case *c = *state;
    char csv[2048];
    snprintf(csv, sizeof csv, "%s%s", log_header, c->rows);
    write_text(in_folder("log.csv"), csv);
    const char *path = in_folder("log.csv");
    training_log log;
    assert_ok(training_log_read(path, &log, &assert_ok_err_));
    assert_int_equal(log.count, c->count);
    if (c->count > 0) {
        assert_true(log.column[LOG_STEP][c->count - 1] == c->last_step);
        const double loss = log.column[LOG_LOSS][c->count - 1];
        assert_true(loss == c->last_loss || (isnan(loss) && isnan(c->last_loss)));
        assert_true(log.column[LOG_ANCHORS][c->count - 1] == 5);
    }
    training_log_free(&log);
}

static void every_cut_of_a_log(void **state)
{
    (void)state;
    char csv[2048];
    const char *path = in_folder("log.csv");
    snprintf(csv, sizeof csv, "%s%s", log_header, log_cases[0].rows);
    size_t before = 0;
    for (size_t length = 0; length <= strlen(csv); length++) {
        assert_ok(file_write_atomic(path, csv, length, &assert_ok_err_));
        training_log log;
        assert_ok(training_log_read(path, &log, &assert_ok_err_));
        assert_true(log.count == before || log.count == before + 1);
        before = log.count;
        training_log_free(&log);
    }
    assert_int_equal(before, 2);
}

static void smooths(void **state)
{
    (void)state;
    double seconds[] = {0, 1, 2, 3, 10}, loss[] = {4, 2, (double)NAN, 6, 8}, out[5];
    training_log log = {.count = 5};
    log.column[LOG_SECONDS] = seconds;
    log.column[LOG_LOSS] = loss;
    training_log_smooth(&log, LOG_LOSS, 1, out);
    static const double wanted[] = {3, 3, 4, 6, 8};
    for (int i = 0; i < 5; i++)
        assert_true(out[i] == wanted[i]);
    loss[4] = (double)NAN;
    training_log_smooth(&log, LOG_LOSS, 1, out);
    assert_true(isnan(out[4]));
}

/* ---- text ---- */

typedef struct text_case {
    const char *name;
    void (*add)(text *t, double value);
    double value;
    const char *wanted;
} text_case;

static void add_2_decimals(text *t, double value) { text_number(t, value, 2); }

static const text_case text_cases[] = {
    {"number", add_2_decimals, 1.005, "1.00"},
    {"number NaN", add_2_decimals, NAN, "n/a"},
    {"number infinite", add_2_decimals, -INFINITY, "n/a"},
    {"count 0", text_count, 0, "0"},
    {"count 999", text_count, 999, "999"},
    {"count 1000", text_count, 1000, "1,000"},
    {"count rounds up to four digits", text_count, 999.6, "1,000"},
    {"count -1234567", text_count, -1234567, "-1,234,567"},
    {"count -0.4", text_count, -0.4, "0"},
    {"count NaN", text_count, NAN, "n/a"},
    {"bytes 0", text_bytes, 0, "0 B"},
    {"bytes 999", text_bytes, 999, "999 B"},
    {"bytes 1000", text_bytes, 1000, "1.00 kB"},
    {"bytes 999600", text_bytes, 999600, "1.00 MB"},
    {"bytes 12.34 M", text_bytes, 12.34e6, "12.3 MB"},
    {"bytes 2.5e12", text_bytes, 2.5e12, "2.50 TB"},
    {"bytes NaN", text_bytes, NAN, "n/a"},
    {"duration 1.234", text_duration, 1.234, "1.23 s"},
    {"duration 99.9", text_duration, 99.9, "99.9 s"},
    {"duration 119.7", text_duration, 119.7, "2 min 00 s"},
    {"duration 300.4", text_duration, 300.4, "5 min 00 s"},
    {"duration 7199.9", text_duration, 7199.9, "2 h 00 min"},
    {"duration 2 h 5 min", text_duration, 7500, "2 h 05 min"},
    {"duration NaN", text_duration, NAN, "n/a"},
};

static void assert_text(const text *t, const char *wanted)
{
    assert_int_equal(t->status, GBT_OK);
    if (t->length != strlen(wanted) || (t->length > 0 && memcmp(t->bytes, wanted, t->length) != 0))
        fail_msg("\"%.*s\", wanted \"%s\"", (int)t->length, t->bytes != NULL ? t->bytes : "", wanted);
}

static void numbers_as_text(void **state)
{
    const text_case *c = *state;
    text t = {0};
    c->add(&t, c->value);
    assert_text(&t, c->wanted);
    text_free(&t);
}

static void escapes(void **state)
{
    (void)state;
    static const struct {
        const char *in, *out;
    } cases[] = {
        {"a<b>&\"'", "a&lt;b&gt;&amp;&quot;&#39;"},
        {NULL, "n/a"},
        {"", ""},
        {"\t\n\x01\x7f", "  ??"},
        {"gr\xc3\xbc\xc3\x9f \xe2\x82\xac \xf0\x9f\xa6\x8a",
         "gr\xc3\xbc\xc3\x9f \xe2\x82\xac \xf0\x9f\xa6\x8a"},
        {"\xff"
         "a",
         "\xef\xbf\xbd"
         "a"},
        {"\xc3", "\xef\xbf\xbd"},
        {"\xc0\x80", "\xef\xbf\xbd\xef\xbf\xbd"},
        {"\xe2\x82", "\xef\xbf\xbd\xef\xbf\xbd"},
        {"\xed\xa0\x80", "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd"},
        {"\xf4\x90\x80\x80", "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd"},
        {"\xe2<b>", "\xef\xbf\xbd&lt;b&gt;"},
        {"%s%n", "%s%n"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        text t = {0};
        text_escaped(&t, cases[i].in);
        assert_text(&t, cases[i].out);
        text_free(&t);
    }
    text t = {0};
    text_plain(&t, "a<b> & \"c\" | d\n\xff");
    assert_text(&t, "a<b> & \"c\" \\| d \xef\xbf\xbd");
    text_free(&t);
}

static void base64(void **state)
{
    (void)state;
    static const struct {
        const char *in, *out;
    } cases[] = {{"", ""},
                 {"f", "Zg=="},
                 {"fo", "Zm8="},
                 {"foo", "Zm9v"},
                 {"foob", "Zm9vYg=="},
                 {"fooba", "Zm9vYmE="},
                 {"foobar", "Zm9vYmFy"},
                 {"\xff\xfe\xfd", "//79"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        text t = {0};
        text_base64(&t, (const unsigned char *)cases[i].in, strlen(cases[i].in));
        assert_text(&t, cases[i].out);
        text_free(&t);
    }
}

/* ---- charts and colours ---- */

static void ticks_are_round(void **state)
{
    (void)state;
    static const double ranges[][2] = {{0, 1},         {0, 0.3},      {9.885, 29.6}, {0, 18138},
                                       {-3, 7},        {5, 5},        {0, 0},        {1e-9, 2e-9},
                                       {1e9, 1e9 + 1}, {-1e99, 1e99}, {99.99, 100},  {0, 61.5}};
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++) {
        double ticks[CHART_MAX_TICKS];
        const double low = ranges[i][0], high = ranges[i][1];
        const int count = chart_ticks(low, high, 5, ticks);
        assert_in_range(count, 2, CHART_MAX_TICKS);
        const double step = ticks[1] - ticks[0], digit = step / pow(10, floor(log10(step) + 1e-4)),
                     slack = 1e-5 * step;
        assert_true(fabs(digit - 1) < 1e-3 || fabs(digit - 2) < 1e-3 || fabs(digit - 5) < 1e-3);
        assert_true(ticks[0] <= low + slack && ticks[count - 1] >= high - slack);
        if (high - low > 1e-6 * fabs(high)) {
            assert_true(ticks[0] > low - step && ticks[count - 1] < high + step);
            assert_in_range(count, 3, 9);
        }
    }
    double ticks[CHART_MAX_TICKS];
    assert_int_equal(chart_ticks(0, 10, 5, ticks), 6);
    for (int i = 0; i < 6; i++)
        assert_true(fabs(ticks[i] - 2 * i) < 1e-12);
}

static void log_ticks_are_round(void **state)
{
    (void)state;
    static const double ranges[][2] = {{0.0448, 0.3788}, {1, 1}, {1, 10},    {1e-99, 1e99},
                                       {0.9, 1.1},       {2, 5}, {1e-3, 1e5}};
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++) {
        double ticks[CHART_MAX_TICKS];
        const int count = chart_log_ticks(ranges[i][0], ranges[i][1], ticks);
        assert_in_range(count, 2, 8);
        assert_true(ticks[0] <= ranges[i][0] * 1.000001 && ticks[count - 1] >= ranges[i][1] * 0.999999);
        for (int j = 0; j < count; j++) {
            const double digit = ticks[j] / pow(10, floor(log10(ticks[j]) + 1e-4));
            assert_true(fabs(digit - 1) < 1e-3 || fabs(digit - 2) < 1e-3 || fabs(digit - 5) < 1e-3);
            assert_true(j == 0 || ticks[j] > ticks[j - 1]);
        }
    }
    double ticks[CHART_MAX_TICKS];
    assert_int_equal(chart_log_ticks(0.0448, 0.3788, ticks), 5); /* 0.02 0.05 0.1 0.2 0.5 */
    assert_true(fabs(ticks[0] - 0.02) < 1e-12 && fabs(ticks[4] - 0.5) < 1e-12);
    assert_int_equal(chart_log_ticks(1, 10, ticks), 4); /* ends that are ticks need no others: 1 2 5 10 */
}

static double lightness_of(const float rgb[3])
{
    static const double weight[] = {0.2126390059, 0.7151686788, 0.0721923153};
    double luminance = 0;
    for (int k = 0; k < 3; k++) {
        const double x = (double)rgb[k];
        assert_true(x >= 0 && x <= 1);
        luminance += weight[k] * (x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4));
    }
    return luminance > 216.0 / 24389 ? 116 * cbrt(luminance) - 16 : luminance * 24389 / 27;
}

/* OKLab's lightness (Ottosson 2020). */
static double oklab_lightness_of(const float rgb[3])
{
    static const double to_cones[3][3] = {{0.4122214708, 0.5363325363, 0.0514459929},
                                          {0.2119034982, 0.6806995451, 0.1073969566},
                                          {0.0883024619, 0.2817188376, 0.6299787005}};
    static const double weight[3] = {0.2104542553, 0.7936177850, -0.0040720468};
    double lightness = 0;
    for (int i = 0; i < 3; i++) {
        double cone = 0;
        for (int k = 0; k < 3; k++) {
            const double x = (double)rgb[k];
            cone += to_cones[i][k] * (x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4));
        }
        lightness += weight[i] * cbrt(cone);
    }
    return lightness;
}

static void error_colors_are_even(void **state)
{
    (void)state;
    double before = 0;
    for (int i = 0; i <= 255; i++) {
        float rgb[3];
        error_color(i / 255.0, rgb);
        assert_true(fabs(oklab_lightness_of(rgb) - (0.09 + 0.88 * i / 255)) < 1e-3);
        const double lightness =
            lightness_of(rgb); /* CIELAB: another space than the one that they were made in */
        if (i > 0)
            assert_true(lightness > before && lightness < before + 0.8);
        before = lightness;
    }
    float low[3], high[3], other[3];
    error_color(0, low);
    error_color(1, high);
    assert_true(lightness_of(low) < 6 && lightness_of(high) > 94);
    error_color((double)NAN, other);
    assert_memory_equal(other, low, sizeof low);
    error_color(7, other);
    assert_memory_equal(other, high, sizeof high);
    error_color(-7, other);
    assert_memory_equal(other, low, sizeof low);
}

static void large_pictures_shrink(void **state)
{
    (void)state;
    static const struct {
        int width, height, out_width, out_height;
    } cases[] = {
        {1280, 8, 1280, 8}, {1281, 8, 640, 4}, {4, 2570, 1, 856}, {2600, 1, 2600, 1}, {400, 300, 200, 150}};
    const size_t most = 100 * 1000;
    const char *path = in_folder("render.png");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_picture("render.png", cases[i].width, cases[i].height, 3, 0.5f);
        text t = {0};
        int width, height;
        assert_int_equal(report_picture(&t, path, PICTURE_COLOR, most, &width, &height), GBT_OK);
        assert_int_equal(width, cases[i].out_width);
        assert_int_equal(height, cases[i].out_height);
        assert_true(t.length > 100);
        text_free(&t);
    }
    text t = {0};
    int width, height;
    assert_int_equal(report_picture(&t, "/nonexistent.png", PICTURE_COLOR, most, &width, &height), GBT_OK);
    assert_int_equal(width, 0);
    assert_int_equal(t.length, 0);
}

int main(void)
{
    struct CMUnitTest tests[80];
    size_t count = 0;
#define ADD(function) tests[count++] = (struct CMUnitTest)cmocka_unit_test(function)
#define ADD_ROWS(function, rows)                                                                             \
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)                                                  \
    tests[count++] = (struct CMUnitTest){                                                                    \
        .name = rows[i].name, .test_func = function, .initial_state = (void *)(uintptr_t)&rows[i]}
    ADD(whole_page);
    ADD_ROWS(bare_page, bare_cases);
    ADD(one_row);
    ADD(scene_on_the_page);
    ADD(maps_lie_along_the_cameras);
    ADD(layers_have_the_logged_heights);
    ADD(odd_metrics);
    ADD(a_resumed_run_is_made_again);
    ADD(many_views);
    ADD(no_memory);
    ADD(not_a_folder);
    ADD_ROWS(reads_log, log_cases);
    ADD(every_cut_of_a_log);
    ADD(smooths);
    ADD_ROWS(numbers_as_text, text_cases);
    ADD(escapes);
    ADD(base64);
    ADD(ticks_are_round);
    ADD(log_ticks_are_round);
    ADD(error_colors_are_even);
    ADD(large_pictures_shrink);
    return _cmocka_run_group_tests("report", tests, count, folder_make, folder_remove);
}
