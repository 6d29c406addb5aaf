/* SPDX-License-Identifier: Apache-2.0 */
/* tests/view/test_view.c -- gbt_view() on a tiny run: the same pictures as gbt_render(), photos, points
   behind pixels, newer models, the end. */
#include "train/run_support.h"
#include "view/http_client.h"

#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>

#include "base/image.h"
#include "base/vec.h"
#include "data/gaussian_file.h"
#include "gbtrace/evaluate.h"
#include "gbtrace/export.h"
#include "gbtrace/view.h"
#include "view/viewer.h"

/* ---- the viewer in a thread of its own ---- */

typedef struct viewer {
    pthread_t thread;
    const char *input;
    gbt_view_def def;
    int ready[2]; /* a pipe: the port, once */
    gbt_status status;
    gbt_error err;
} viewer;

static void tell(const char *url, void *context)
{
    viewer *v = context;
    const int port = atoi(strrchr(url, ':') + 1);
    if (write(v->ready[1], &port, sizeof port) != sizeof port)
        abort();
}

static void *view(void *context)
{
    viewer *v = context;
    v->status = gbt_view(v->input, &v->def, &v->err);
    close(v->ready[1]);
    return NULL;
}

static int open_viewer_beside(viewer *v, const char *input, const char *data)
{
    int port = 0;
    *v = (viewer){.input = input, .def = gbt_view_def_default()};
    v->def.port = 0;
    v->def.data = data;
    v->def.ready = tell;
    v->def.context = v;
    assert_int_equal(pipe(v->ready), 0);
    assert_int_equal(pthread_create(&v->thread, NULL, view, v), 0);
    const ssize_t got = read(v->ready[0], &port, sizeof port);
    if (got != sizeof port) {
        pthread_join(v->thread, NULL);
        fail_msg("%s: %s", input, v->err.text);
    }
    return port;
}

static int open_viewer(viewer *v, const char *input) { return open_viewer_beside(v, input, NULL); }

/* As Ctrl-C does. */
static void close_viewer(viewer *v, int number)
{
    assert_int_equal(kill(getpid(), number), 0);
    assert_int_equal(pthread_join(v->thread, NULL), 0);
    close(v->ready[0]);
    if (v->status != GBT_OK)
        fail_msg("%s", v->err.text);
}

static reply get_ok(int port, const char *path)
{
    reply r = http_get(port, path);
    if (r.code != 200)
        fail_msg("%s: %.600s", path, r.text);
    return r;
}

static json_t *get_json(int port, const char *path)
{
    reply r = get_ok(port, path);
    json_t *value = json_loadb(r.body, r.body_count, 0, NULL);
    assert_non_null(value);
    free(r.text);
    return value;
}

static double number_of(const json_t *object, const char *name)
{
    const json_t *value = json_object_get(object, name);
    if (!json_is_number(value))
        fail_msg("no number %s", name);
    return json_number_value(value);
}

static char *run_folder;

static int train_once(void **state)
{
    gbt_train_def def = run_def();
    if (make_root(state) != 0)
        return -1;
    run_folder = strdup(in_folder("run"));
    train_ok(tiny, run_folder, &def);
    return 0;
}

static int clean_up(void **state)
{
    free(run_folder);
    return folder_remove(state);
}

/* ---- pictures ---- */

static void assert_same_pixels(const reply *rgba, const char *png)
{
    image file;
    assert_ok(image_read(png, &file, NULL));
    assert_int_equal(rgba->body_count, 4 * file.width * file.height);
    for (size_t i = 0; i < rgba->body_count; i++)
        if ((unsigned char)rgba->body[i] !=
            (i % 4 == 3 ? 255 : (int)(file.pixels[i / 4 * (size_t)file.channels + i % 4] * 255 + 0.5f)))
            fail_msg("%s: byte %zu", png, i);
    image_free(&file);
}

static void views_are_what_render_draws(void **state)
{
    (void)state;
    viewer v;
    gbt_render_def def = gbt_render_def_default();
    const int port = open_viewer(&v, run_folder);
    json_t *there = get_json(port, "/scene"), *views = json_object_get(there, "views"),
           *first = json_array_get(views, 0);
    char path[2 * PATH_SIZE], file[PATH_SIZE];
    assert_int_equal(json_array_size(views), VIEWS);
    assert_true(json_is_true(json_object_get(first, "test")));
    assert_true(number_of(first, "width") == 48 && number_of(first, "height") == 36 &&
                number_of(there, "anchors") > 0);
    assert_ok(gbt_render(run_folder, in_folder("drawn"), &def, NULL));
    snprintf(file, sizeof file, "drawn/%s", json_string_value(json_object_get(first, "name")));
    for (int i = 0; i < 2; i++) { /* drawn, and kept from before */
        reply r = get_ok(port, "/render?view=0");
        assert_same_pixels(&r, in_folder("%s", file));
        free(r.text);
    }
    snprintf(path, sizeof path, "%s/images/%s", tiny, json_string_value(json_object_get(first, "name")));
    reply r = get_ok(port, "/photo?view=0");
    assert_same_pixels(&r, path);
    free(r.text);
    json_decref(there);
    close_viewer(&v, SIGINT);
}

/* A free camera: the file that `gbtrace render --camera` reads, and the same words in the query. */
static void cameras_are_what_render_draws(void **state)
{
    (void)state;
    static const char *const lenses[] = {
        "\"model\":\"pinhole\",\"fov_x_deg\":70", "\"model\":\"fisheye\",\"fov_x_deg\":200",
        "\"model\":\"orthographic\",\"view_width\":3", "\"model\":\"equirectangular\""};
    viewer v;
    const int port = open_viewer(&v, run_folder);
    for (size_t i = 0; i < sizeof lenses / sizeof *lenses; i++) {
        char text[512], path[600];
        const int length = snprintf(
            text, sizeof text,
            "{\"origin\":[0.5,-2,1],\"target\":[0,0,0.2],\"up\":[0,0,1],\"width\":40,\"height\":20,%s}",
            lenses[i]);
        gbt_render_def def = gbt_render_def_default();
        def.camera = in_folder("lens.json");
        assert_ok(file_write_atomic(def.camera, text, (size_t)length, NULL));
        assert_ok(gbt_render(run_folder, in_folder("drawn"), &def, NULL));
        snprintf(path, sizeof path, "/render?camera=%s", text);
        reply r = get_ok(port, path);
        assert_same_pixels(&r, in_folder("drawn/lens.png"));
        free(r.text);
    }
    close_viewer(&v, SIGTERM);
}

static double mean_difference(const reply *a, const reply *b)
{
    double sum = 0;
    assert_int_equal(a->body_count, b->body_count);
    for (size_t i = 0; i < a->body_count; i++)
        sum += abs((unsigned char)a->body[i] - (unsigned char)b->body[i]);
    return sum / (double)a->body_count;
}

/* What a picture says of its own time is no more than the time that its client waited. */
static void times_are_part_of_the_wait(void **state)
{
    (void)state;
    static const char *const paths[] = {"/render?view=1", "/render?view=1&sample=2",
                                        "/render?view=1&output=depth&format=float",
                                        "/render?view=1&renderer=raster"};
    viewer v;
    const int port = open_viewer(&v, run_folder);
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        const double begin = clock_wall();
        reply r = get_ok(port, paths[i]);
        const double waited = 1000 * (clock_wall() - begin);
        const char *about = strstr(r.text, "X-Picture: ");
        assert_non_null(about);
        json_t *said = json_loads(about + strlen("X-Picture: "), JSON_DISABLE_EOF_CHECK, NULL);
        assert_non_null(said);
        const double prepare = number_of(said, "prepare_ms"), trace = number_of(said, "trace_ms"),
                     encode = number_of(said, "encode_ms");
        const bool copied = strstr(paths[i], "format=float") != NULL; /* in less than is told */
        if (!(prepare >= 0 && trace > 0 && (copied ? encode >= 0 : encode > 0) &&
              prepare + trace + encode < waited + 0.01))
            fail_msg("%s: %g + %g + %g ms of %g", paths[i], prepare, trace, encode, waited);
        json_decref(said);
        free(r.text);
    }
    close_viewer(&v, SIGINT);
}

/* The next picture is whole, whatever was left of the one before. */
static void a_picture_that_nobody_waits_for_is_given_up(void **state)
{
    (void)state;
    static const gbt_renderer renderers[] = {GBT_RENDERER_TRACE, GBT_RENDERER_RASTER};
    viewer_state s;
    atomic_bool stop;
    gbt_render_def def = gbt_render_def_default();
    assert_ok(viewer_open(run_folder, NULL, &s, &assert_ok_err_));
    s.stop = &stop;
    for (size_t i = 0; i < sizeof renderers / sizeof *renderers; i++) {
        const request what = {.kind = REQUEST_RENDER, .renderer = renderers[i], .preset = GBT_PRESET_DEFAULT};
        answer none = {0}, whole = {0};
        atomic_store(&stop, true);
        viewer_answer(&s, &what, &none);
        assert_int_equal(none.code, 500);
        assert_non_null(memmem(none.bytes, none.count, "stopped", 7));
        atomic_store(&stop, false);
        viewer_answer(&s, &what, &whole);
        assert_int_equal(whole.code, 200);
        def.renderer = renderers[i];
        assert_ok(gbt_render(run_folder, in_folder("whole"), &def, &assert_ok_err_));
        const reply r = {.body = (char *)whole.bytes, .body_count = whole.count};
        assert_same_pixels(&r, in_folder("whole/0000.png"));
        mem_free(none.bytes);
        mem_free(whole.bytes);
    }
    viewer_close(&s);
}

static void samples_are_other_points_of_the_pixels(void **state)
{
    (void)state;
    viewer v;
    const int port = open_viewer(&v, run_folder);
    reply middle = get_ok(port, "/render?view=1&sample=0"), other = get_ok(port, "/render?view=1&sample=3"),
          again = get_ok(port, "/render?view=1&sample=3");
    const double moved = mean_difference(&middle, &other);
    assert_true(moved > 0.01 && moved < 8);
    assert_true(mean_difference(&other, &again) == 0);
    reply after = get_ok(port, "/render?view=1&sample=0");
    assert_true(mean_difference(&middle, &after) == 0);
    free(again.text);
    again = get_ok(port, "/render?view=2"); /* so that the next has no tree of its camera */
    free(again.text);
    again = get_ok(port, "/render?view=1&sample=3");
    assert_true(mean_difference(&other, &again) == 0);
    free(middle.text);
    free(other.text);
    free(again.text);
    free(after.text);
    close_viewer(&v, SIGINT);
}

/* A camera that looks away sees nothing else; the model's own comes back. */
static void a_background_is_chosen(void **state)
{
    (void)state;
    static const char away[] = "{\"origin\":[0,0,900],\"target\":[0,0,999],\"up\":[0,1,0],\"width\":8,"
                               "\"height\":8,\"fov_x_deg\":30}";
    static const char *const renderers[] = {"trace", "raster", "per-ray"};
    viewer v;
    const int port = open_viewer(&v, run_folder);
    char path[400];
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "/render?renderer=%s&camera=%s", renderers[i], away);
        reply before = get_ok(port, path);
        reply r;
        for (int sample = 0; sample < 2; sample++) {
            snprintf(path, sizeof path, "/render?renderer=%s&background=336600&sample=%d&camera=%s",
                     renderers[i], sample, away);
            r = get_ok(port, path);
            for (size_t k = 0; k < r.body_count; k++)
                assert_int_equal((unsigned char)r.body[k], ((unsigned char[]){0x33, 0x66, 0, 255})[k % 4]);
            free(r.text);
        }
        snprintf(path, sizeof path, "/render?renderer=%s&camera=%s", renderers[i], away);
        r = get_ok(port, path);
        assert_true(mean_difference(&before, &r) == 0);
        free(before.text);
        free(r.text);
    }
    close_viewer(&v, SIGINT);
}

static void every_format_and_output(void **state)
{
    (void)state;
    static const struct {
        const char *words, *starts;
        size_t bytes;
    } pictures[] = {{"", NULL, 48 * 36 * 4},
                    {"&format=float", NULL, 48 * 36 * 12},
                    {"&format=jpeg&quality=50", "\xff\xd8\xff", 0},
                    {"&format=png", "\x89PNG", 0},
                    {"&renderer=raster", NULL, 48 * 36 * 4},
                    {"&renderer=per-ray&sample=2", NULL, 48 * 36 * 4},
                    {"&preset=exact", NULL, 48 * 36 * 4},
                    {"&output=depth&format=float", NULL, 48 * 36 * 4},
                    {"&output=median-depth&format=float", NULL, 48 * 36 * 4},
                    {"&output=normal&format=float", NULL, 48 * 36 * 12},
                    {"&output=transmittance&format=float", NULL, 48 * 36 * 4},
                    {"&output=hits&format=float", NULL, 48 * 36 * 4},
                    {"&output=anchor&format=float", NULL, 48 * 36 * 4},
                    {"&width=20&height=15", NULL, 20 * 15 * 4}};
    viewer v;
    const int port = open_viewer(&v, run_folder);
    for (size_t i = 0; i < sizeof pictures / sizeof *pictures; i++) {
        char path[128];
        snprintf(path, sizeof path, "/render?view=2%s", pictures[i].words);
        reply r = get_ok(port, path);
        if (pictures[i].bytes != 0 ? r.body_count != pictures[i].bytes
                                   : memcmp(r.body, pictures[i].starts, strlen(pictures[i].starts)) != 0)
            fail_msg("%s: %zu bytes", path, r.body_count);
        free(r.text);
    }
    static const char *const wrong[] = {
        "/render?view=9", "/photo?view=9", "/pick?view=0&x=48&y=0", "/pick?view=9&x=1&y=1",
        "/render?renderer=raster&camera={\"origin\":[0,0,0],\"target\":[0,0,1],\"up\":[0,1,0],\"model\":"
        "\"equirectangular\",\"width\":8,\"height\":4}"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        reply r = http_get(port, wrong[i]);
        if (r.code != 400 || strncmp(r.body, "error: ", 7) != 0)
            fail_msg("%s: %.300s", wrong[i], r.text);
        free(r.text);
    }
    close_viewer(&v, SIGINT);
}

/* The pixel, of 48 x 36, whose neighbours' depths differ least from its own. */
static int smoothest(const float *depth)
{
    int best = -1;
    float least = 0.02f;
    for (int i = 48; i < 48 * 35; i++) {
        const float most = fmaxf(fmaxf(depth[i - 1], depth[i + 1]), fmaxf(depth[i - 48], depth[i + 48])),
                    d = fmaxf(most, depth[i]);
        const float low = fminf(fminf(depth[i - 1], depth[i + 1]), fminf(depth[i - 48], depth[i + 48])),
                    step = (d - fminf(low, depth[i])) / d;
        if (depth[i] > 0 && step < least) {
            best = i;
            least = step;
        }
    }
    assert_true(best > 0);
    return best;
}

/* The point lies on the pixel's ray, at the depth that the picture of depths has there. */
static void points_lie_behind_their_pixels(void **state)
{
    (void)state;
    viewer v;
    const int port = open_viewer(&v, run_folder);
    reply depths = get_ok(port, "/render?view=0&output=median-depth&format=float");
    float depth[48 * 36];
    char path[64];
    assert_int_equal(depths.body_count, sizeof depth);
    memcpy(depth, depths.body, sizeof depth);
    const int at = smoothest(depth);
    snprintf(path, sizeof path, "/pick?view=0&x=%d.5&y=%d.5", at % 48, at / 48);
    json_t *there = get_json(port, "/scene"), *found = get_json(port, path),
           *point = json_object_get(found, "point");
    const json_t *origin = json_object_get(
        json_object_get(json_array_get(json_object_get(there, "views"), 0), "camera"), "origin");
    double square = 0;
    assert_true(json_is_true(json_object_get(found, "hit")));
    for (size_t k = 0; k < 3; k++) {
        const double d =
            json_number_value(json_array_get(point, k)) - json_number_value(json_array_get(origin, k));
        square += d * d;
    }
    assert_true(fabs(sqrt(square) / number_of(found, "depth") - 1) < 1e-5);
    assert_true(fabs(number_of(found, "depth") / (double)depth[at] - 1) < 0.02); /* Gaussians are as wide as
                                                                                    pixels, and these differ
                                                                                    by the lens */
    json_decref(there);
    json_decref(found);
    free(depths.text);
    close_viewer(&v, SIGINT);
}

/* Photos of another data set: masked pixels are transparent, and a camera of too many pixels is drawn smaller
   or not at all. */
static void masked_and_large_photos(void **state)
{
    (void)state;
#define POSE "\"transform_matrix\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]"
    static const char text[] =
        "{\"fl_x\": 40, \"frames\": [{\"file_path\": \"0.png\", \"mask_path\": \"mask.png\", "
        "\"w\": 48, \"h\": 36, " POSE "}, {\"file_path\": \"1.png\", \"w\": 1200, \"h\": 8000, " POSE
        "}, {\"file_path\": \"2.png\", \"camera_model\": \"OPENCV_FISHEYE\", \"fl_x\": 6, \"w\": 48, \"h\": "
        "36, " POSE "}]}";
    image mask;
    assert_ok(image_alloc(&mask, 48, 36, 1, NULL));
    for (int i = 0; i < 48 * 36; i++)
        mask.pixels[i] = i % 48 >= 16;
    assert_ok(file_make_folder(in_folder("beside"), NULL));
    assert_ok(image_write(in_folder("beside/mask.png"), &mask, NULL));
    image_free(&mask);
    for (int i = 0; i < 3; i++)
        copy_file(in_folder("tiny/images/0000.png"), in_folder("beside/%d.png", i));
    assert_ok(file_write_atomic(in_folder("beside/transforms.json"), text, sizeof text - 1, NULL));
    viewer v;
    const int port = open_viewer_beside(&v, run_folder, in_folder("beside"));
    reply r = get_ok(port, "/photo?view=0");
    assert_int_equal(r.body_count, 4 * 48 * 36);
    for (int i = 0; i < 48 * 36; i++)
        assert_int_equal((unsigned char)r.body[4 * i + 3], i % 48 >= 16 ? 255 : 0);
    free(r.text);
    r = get_ok(port, "/photo?view=2"); /* rays up to 180 degrees off the axis */
    assert_int_equal(r.body_count, 4 * 48 * 36);
    for (int i = 0; i < 48 * 36; i++)
        assert_int_equal((unsigned char)r.body[4 * i + 3],
                         hypot(i % 48 - 23.5, i / 48 - 17.5) <= 6 * PI ? 255 : 0);
    free(r.text);
    static const char *const too_large[] = {"/render?view=1", "/pick?view=1&x=1&y=1"};
    for (int i = 0; i < 2; i++) {
        r = http_get(port, too_large[i]);
        if (r.code != 400 || strstr(r.body, "picture of 1200 x 8000 pixels") == NULL)
            fail_msg("%s: %.300s", too_large[i], r.text);
        free(r.text);
    }
    r = get_ok(port, "/render?view=1&width=12&height=80");
    assert_int_equal(r.body_count, 4 * 12 * 80);
    free(r.text);
    close_viewer(&v, SIGINT);
}

/* ---- while it trains ---- */

static void wait_for_version(int port, int version)
{
    for (int i = 0; i < 1200; i++) {
        json_t *status = get_json(port, "/status");
        const bool come = number_of(status, "version") >= version;
        json_decref(status);
        if (come)
            return;
        usleep(50000);
    }
    fail_msg("version %d has not come", version);
}

static void newer_models_are_shown(void **state)
{
    (void)state;
    char saved[PATH_SIZE + 16], *live = strdup(in_folder("live"));
    gbt_train_def def = run_def();
    viewer v;
    snprintf(saved, sizeof saved, "%s/model.gbt", live);
    copy_file(in_folder("run/config"), in_folder("live/config"));
    const int port = open_viewer(&v, live);
    reply none = http_get(port, "/scene");
    assert_int_equal(none.code, 503);
    assert_non_null(strstr(none.body, "has not saved a model yet"));
    free(none.text);
    copy_file(in_folder("run/model.gbt"), saved);
    wait_for_version(port, 1);
    reply before = get_ok(port, "/render?view=0");
    assert_ok(file_write_atomic(saved, "damaged", 7, NULL)); /* said, and the old one stays */
    for (json_t *status = NULL; status == NULL;) {
        status = get_json(port, "/status");
        if (strstr(json_string_value(json_object_get(status, "note")), "model.gbt") == NULL) {
            json_decref(status);
            status = NULL;
            usleep(50000);
        } else
            json_decref(status);
    }
    reply same = get_ok(port, "/render?view=0");
    assert_true(mean_difference(&before, &same) == 0);
    def.iterations = 20;
    train_ok(tiny, in_folder("other"), &def);
    copy_file(in_folder("other/model.gbt"), saved);
    wait_for_version(port, 2);
    reply after = get_ok(port, "/render?view=0");
    assert_true(mean_difference(&before, &after) > 0.5);
    json_t *status = get_json(port, "/status");
    assert_true(number_of(status, "iterations") == 20);
    assert_string_equal(json_string_value(json_object_get(status, "note")), "");
    json_decref(status);
    free(before.text);
    free(same.text);
    free(after.text);
    close_viewer(&v, SIGINT);
    free(live);
}

/* Of 3DGS: its newest iteration, and the photos of its data set. */
static void a_result_folder_is_shown(void **state)
{
    (void)state;
    const char *folder = in_folder("result/");
    gbt_export_def baked = gbt_export_def_default();
    baked.refine_steps = 0;
    assert_ok(gbt_export(run_folder, &baked, &folder, 1, NULL, NULL));
    viewer v;
    const int port = open_viewer(&v, in_folder("result"));
    json_t *there = get_json(port, "/scene");
    assert_true(json_is_true(json_object_get(there, "plain")) && number_of(there, "gaussians") > 0);
    assert_true(json_array_size(json_object_get(there, "views")) > 0);
    json_decref(there);
    free(get_ok(port, "/render?view=0").text);
    close_viewer(&v, SIGINT);
}

static void plain_gaussians_are_shown(void **state)
{
    (void)state;
    static const char camera[] = "{\"origin\":[0.5,-2,1],\"target\":[0,0,0.2],\"up\":[0,0,1],\"width\":40,"
                                 "\"height\":30,\"fov_x_deg\":60}";
    const char *ply = in_folder("plain.ply");
    gbt_export_def baked = gbt_export_def_default();
    baked.refine_steps = 0;
    assert_ok(gbt_export(run_folder, &baked, &ply, 1, NULL, NULL));
    viewer v;
    const int port = open_viewer(&v, ply);
    json_t *there = get_json(port, "/scene"), *status = get_json(port, "/status");
    assert_true(json_is_true(json_object_get(there, "plain")) && number_of(there, "gaussians") > 0 &&
                number_of(there, "size") > 0);
    assert_int_equal(json_array_size(json_object_get(there, "views")), 0);
    assert_string_equal(json_string_value(json_object_get(status, "note")), "");
    gbt_render_def def = gbt_render_def_default();
    def.camera = in_folder("plain.json");
    assert_ok(file_write_atomic(def.camera, camera, sizeof camera - 1, NULL));
    assert_ok(gbt_render(ply, in_folder("drawn"), &def, NULL));
    char path[256];
    snprintf(path, sizeof path, "/render?camera=%s", camera);
    reply r = get_ok(port, path);
    assert_same_pixels(&r, in_folder("drawn/plain.png"));
    free(r.text);
    snprintf(path, sizeof path, "/render?format=float&output=anchor&camera=%s", camera);
    r = get_ok(port, path);
    assert_int_equal(r.body_count, 40 * 30 * 4);
    free(r.text);
    json_decref(there);
    json_decref(status);
    close_viewer(&v, SIGINT);
}

/* More Gaussians than are looked at, along a slanted line. */
static void the_extent_of_many_gaussians(void **state)
{
    (void)state;
    enum { COUNT = 100002 };
    const char *ply = in_folder("many.ply");
    gaussian_cloud c;
    assert_ok(gaussian_cloud_alloc(&c, COUNT, NULL));
    c.count = 0;
    for (size_t i = 0; i < COUNT; i++) {
        const double x = 4 * (double)i / (COUNT - 1);
        gaussian_cloud_add(
            &c, &(gaussian_row){.mean = {x, -x, 7}, .scale_log = {-5, -5, -5}, .quat = {1}, .opacity = 0.5});
    }
    assert_ok(gaussian_file_write(ply, &c, (const double[3]){0, 0, 0}, NULL));
    gaussian_cloud_free(&c);
    viewer v;
    const int port = open_viewer(&v, ply);
    json_t *there = get_json(port, "/scene"), *center = json_object_get(there, "center");
    assert_true(number_of(there, "gaussians") == COUNT);
    for (size_t k = 0; k < 3; k++)
        assert_true(fabs(json_number_value(json_array_get(center, k)) - ((double[]){2, -2, 7})[k]) < 1e-3);
    assert_true(fabs(number_of(there, "size") - 2) < 1e-3); /* the middle half */
    assert_true(fabs(number_of(there, "floor") - 0.2) < 1e-3);
    json_decref(there);
    close_viewer(&v, SIGINT);
}

static void what_cannot_be_shown(void **state)
{
    (void)state;
    static const struct {
        const char *input, *data, *says, *host;
        int port;
        gbt_status status;
    } rows[] = {{"nowhere", NULL, "nowhere", NULL, 0, GBT_ERR_IO},
                {"tiny", NULL, "model.gbt: does not exist", NULL, 0, GBT_ERR_IO},
                {"tiny/images", NULL, "model.gbt", NULL, 0, GBT_ERR_IO},
                {"run/config", NULL, "config", NULL, 0, GBT_ERR_FORMAT},
                {"run", "nowhere", "nowhere", NULL, 0, GBT_ERR_IO},
                {"run", NULL, "port: 65536", NULL, 65536, GBT_ERR_ARGUMENT},
                {"run", NULL, "host: \"here\"", "here", 0, GBT_ERR_ARGUMENT},
                {"run", NULL, "203.0.113.77:0: cannot listen", "203.0.113.77", 0, GBT_ERR_IO}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_view_def def = gbt_view_def_default();
        gbt_error err = {0};
        def.port = rows[i].port;
        def.host = rows[i].host;
        def.data = rows[i].data != NULL ? in_folder("%s", rows[i].data) : NULL;
        const gbt_status status = gbt_view(in_folder("%s", rows[i].input), &def, &err);
        if (status != rows[i].status || strstr(err.text, rows[i].says) == NULL)
            fail_msg("%s: wanted %d with \"%s\", got %d: %s", rows[i].input, (int)rows[i].status,
                     rows[i].says, (int)status, err.text);
    }
}

/* Photos that are gone are no reason to show nothing. */
static void a_model_without_its_photos(void **state)
{
    (void)state;
    char away[PATH_SIZE + 8];
    viewer v;
    snprintf(away, sizeof away, "%s.away", tiny);
    assert_int_equal(rename(tiny, away), 0);
    const int port = open_viewer(&v, in_folder("run/model.gbt"));
    assert_int_equal(rename(away, tiny), 0);
    json_t *there = get_json(port, "/scene"), *status = get_json(port, "/status");
    assert_int_equal(json_array_size(json_object_get(there, "views")), 0);
    assert_true(number_of(there, "size") > 0);
    const char *note = json_string_value(json_object_get(status, "note"));
    assert_true(strncmp(note, "No photos: ", 11) == 0 && strstr(note, "`data`") == NULL);
    assert_non_null(strstr(note, "); to show them, start the viewer with the new place of the data set"));
    json_decref(there);
    json_decref(status);
    close_viewer(&v, SIGINT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_are_what_render_draws),
        cmocka_unit_test(cameras_are_what_render_draws),
        cmocka_unit_test(times_are_part_of_the_wait),
        cmocka_unit_test(a_picture_that_nobody_waits_for_is_given_up),
        cmocka_unit_test(samples_are_other_points_of_the_pixels),
        cmocka_unit_test(a_background_is_chosen),
        cmocka_unit_test(every_format_and_output),
        cmocka_unit_test(points_lie_behind_their_pixels),
        cmocka_unit_test(masked_and_large_photos),
        cmocka_unit_test(newer_models_are_shown),
        cmocka_unit_test(a_result_folder_is_shown),
        cmocka_unit_test(plain_gaussians_are_shown),
        cmocka_unit_test(the_extent_of_many_gaussians),
        cmocka_unit_test(what_cannot_be_shown),
        cmocka_unit_test(a_model_without_its_photos),
    };
    return cmocka_run_group_tests(tests, train_once, clean_up);
}
