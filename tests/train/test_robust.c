/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_robust.c -- training that cannot break: photos, learning rates and gradients that are not
   numbers; photos that differ in exposure. */
#include "run_support.h"

#include <jansson.h>
#include <signal.h>

#include "base/log.h"
#include "base/parallel.h"
#include "base/stop_signal.h"
#include "data/colmap_write.h"
#include "gbtrace/compress.h"
#include "gbtrace/evaluate.h"
#include "io/container.h"
#include "io/model_file.h"
#include "quiet.h"
#include "run/loaded_run.h"
#include "train/camera_sees.h"
#include "train/checkpoint.h"
#include "train/gradient_check.h"
#include "train/run_log.h"
#include "train/schedule.h"

/* A path that lives for the next few calls. */
static const char *joined(const char *folder, const char *name)
{
    static char paths[8][2 * PATH_SIZE];
    static int next = 0;
    char *path = paths[next = (next + 1) % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

/* ---- scenes ---- */

/* A data set like `from`, whose photos `change` has gone over. They become EXR files under their old names:
   magic decides. */
static void copy_scene(const char *from, const char *folder, void (*change)(image *photo, size_t view))
{
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(from, &split, &s, NULL));
    assert_ok(file_make_folder(joined(folder, "images"), NULL));
    static const char *const models[] = {"sparse/0/cameras.bin", "sparse/0/images.bin",
                                         "sparse/0/points3D.bin"};
    for (int i = 0; i < 3; i++)
        copy_file(joined(from, models[i]), joined(folder, models[i]));
    for (size_t i = 0; i < s.view_count; i++) {
        image photo;
        assert_ok(image_read(s.views[i].path, &photo, NULL));
        change(&photo, i);
        assert_ok(image_write(joined(folder, "photo.exr"), &photo, NULL));
        char target[PATH_SIZE];
        snprintf(target, sizeof target, "images/%.100s", s.views[i].name);
        assert_int_equal(rename(joined(folder, "photo.exr"), joined(folder, target)), 0);
        image_free(&photo);
    }
    scene_free(&s);
}

enum { POISONED_VIEW = 3, POISONED_X = 20, POISONED_Y = 10 };

static float poison;

static void poison_one(image *photo, size_t view)
{
    if (view == POISONED_VIEW)
        photo->pixels[3 * (POISONED_Y * photo->width + POISONED_X) + 1] = poison;
}

static const char *poisoned_scene(void)
{
    static bool done = false;
    if (!done) {
        poison = NAN;
        copy_scene(tiny, in_folder("poisoned"), poison_one);
        done = true;
    }
    return in_folder("poisoned");
}

/* ---- nothing that is not a number in any file ---- */

static void assert_no_nan_in_text(const char *path)
{
    file_bytes b = read_bytes(path);
    const char *text = (const char *)b.data;
    static const char *const words[] = {"nan", "NaN", "inf", "Inf"};
    for (int i = 0; i < 4; i++)
        for (const char *at = text; (at = strstr(at, words[i])) != NULL; at++)
            if (strchr(",: ", at[-1]) != NULL || at[-1] == '-')
                fail_msg("%s: ...%.40s", path, at - 10);
    mem_free(b.data);
}

static void assert_no_nan_in_container(const char *path)
{
    container c;
    assert_ok(container_load(path, &c, NULL));
    size_t floats = 0;
    for (size_t s = 0; s < c.count; s++) {
        const container_section *section = &c.sections[s];
        for (size_t i = 0; section->dtype == CONTAINER_F32 && i < section->byte_count / sizeof(float);
             i++, floats++)
            if (!isfinite(((const float *)section->data)[i]) && strcmp(section->name, "decoder.numbers") != 0)
                fail_msg("%s: %s[%zu] is not finite", path, section->name, i);
    }
    assert_true(floats > 1000);
    container_free(&c);
}

static void assert_no_nan_in_renders(const char *run, const char *data)
{
    gbt_render_def def = gbt_render_def_default();
    def.data = data;
    def.split = GBT_SPLIT_ALL;
    def.format = GBT_PICTURE_EXR;
    assert_ok(gbt_render(run, joined(run, "exr"), &def, NULL));
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(data, &split, &s, NULL));
    for (size_t i = 0; i < s.view_count; i++) {
        char name[64];
        snprintf(name, sizeof name, "exr/%.40s", s.views[i].name);
        strcpy(strrchr(name, '.'), ".exr");
        image render;
        image_names names;
        assert_ok(image_read_raw(joined(run, name), &render, &names, NULL));
        for (int k = 0; k < render.width * render.height * render.channels; k++)
            assert_true(isfinite(render.pixels[k]));
        image_free(&render);
    }
    scene_free(&s);
}

static void assert_sound(const char *run, const char *data)
{
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    assert_ok(gbt_evaluate(run, &score, NULL));
    static const char *const texts[] = {"log.csv", "train.json", "metrics.json", "config"};
    for (int i = 0; i < 4; i++)
        assert_no_nan_in_text(joined(run, texts[i]));
    assert_no_nan_in_container(joined(run, "model.gbt"));
    assert_no_nan_in_container(joined(run, "checkpoints/last.gbt"));
    assert_no_nan_in_renders(run, data);
}

static int64_t skipped_in(const char *run)
{
    json_t *metrics = json_load_file(joined(run, "metrics.json"), 0, NULL);
    assert_true(json_is_integer(json_object_get(metrics, "skipped_steps")));
    const int64_t skipped = json_integer_value(json_object_get(metrics, "skipped_steps"));
    json_decref(metrics);
    return skipped;
}

/* A thousand steps where a photo holds a NaN, at rates that tear the scene apart. */
static void wild_rates_and_photos_leave_no_nan(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double factor;
        bool exposure, compat;
        gbt_distance_input distance;
        uint64_t steps;
    } runs[] = {
        {"rates 1", 1, false, false, GBT_DISTANCE_INPUT_AUTO, 200},
        {"rates 100", 100, false, false, GBT_DISTANCE_INPUT_ON, 1000},
        {"rates 1000", 1000, true, false, GBT_DISTANCE_INPUT_ON, 200},
        {"compat 100", 100, false, true, GBT_DISTANCE_INPUT_OFF, 200},
    };
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        gbt_train_def def = run_def();
        def.iterations = runs[i].steps, def.learning_rate_factor = runs[i].factor,
        def.exposure = runs[i].exposure, def.compat = runs[i].compat;
        def.distance = runs[i].distance;
        const char *run = in_folder("%s", runs[i].name);
        train_ok(poisoned_scene(), run, &def);
        assert_sound(run, poisoned_scene());
        print_message("%s: %d of %d steps skipped\n", runs[i].name, (int)skipped_in(run), (int)runs[i].steps);
    }
}

/* ---- a pixel that is not a number counts in no loss ---- */

static void pixels_that_are_not_numbers_are_marked(void **state)
{
    (void)state;
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(poisoned_scene(), &split, &s, NULL));
    photos p;
    assert_ok(photos_open(&p, &s, 1, NULL));
    image photo = {0};
    for (int level = 0; level <= 2; level++)
        for (size_t view = 0; view < s.view_count; view++) {
            const unsigned char *valid;
            assert_ok(photos_get(&p, view, level, &photo, &valid, NULL));
            if (view != POISONED_VIEW) {
                assert_null(valid);
                continue;
            }
            assert_non_null(valid);
            for (int y = 0; y < photo.height; y++)
                for (int x = 0; x < photo.width; x++) /* 48 x 36 halves evenly */
                    assert_int_equal(valid[y * photo.width + x],
                                     x != POISONED_X >> level || y != POISONED_Y >> level);
        }
    for (int phase = 0; phase < 4; phase++) { /* picked pixels carry their own marks */
        const photo_sample sample = {.pick = {.first = {phase % 2, phase / 2}, .step = 2}};
        gbt_camera camera;
        const unsigned char *valid;
        assert_ok(photos_get_sample(&p, POISONED_VIEW, &sample, &photo, &camera, &valid, NULL));
        for (int y = 0; y < photo.height; y++)
            for (int x = 0; x < photo.width; x++)
                assert_int_equal(valid[y * photo.width + x], 2 * x + sample.pick.first[0] != POISONED_X ||
                                                                 2 * y + sample.pick.first[1] != POISONED_Y);
    }
    image_free(&photo);
    photos_close(&p);
    scene_free(&s);
}

/* What stands in the bad pixel does not matter, and no step is lost for it. */
static void a_bad_pixel_has_no_say(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    train_ok(poisoned_scene(), in_folder("nan"), &def);
    poison = INFINITY;
    copy_scene(tiny, in_folder("infinite"), poison_one);
    train_ok(in_folder("infinite"), in_folder("inf"), &def);
    model a, b;
    assert_ok(model_load(in_folder("nan/model.gbt"), &a, NULL));
    assert_ok(model_load(in_folder("inf/model.gbt"), &b, NULL));
    assert_int_equal(a.anchors.count, b.anchors.count);
    assert_memory_equal(a.anchors.feature, b.anchors.feature,
                        a.anchors.count * ANCHOR_FEATURE_DIM * sizeof(float));
    assert_memory_equal(a.decoder.params, b.decoder.params, a.decoder.param_count * sizeof(float));
    assert_int_equal(a.iterations, STEPS);
    model_free(&a);
    model_free(&b);
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    assert_ok(gbt_evaluate(in_folder("nan"), &score, NULL));
    assert_int_equal(skipped_in(in_folder("nan")), 0);
}

/* ---- steps that teach nothing ---- */

typedef struct learned {
    float *values;
    size_t count;
} learned;

static void append(learned *out, const float *values, size_t count)
{
    out->values = realloc(out->values, (out->count + count) * sizeof *values);
    assert_non_null(out->values);
    memcpy(out->values + out->count, values, count * sizeof *values);
    out->count += count;
}

/* Everything that a step changes: parameters, moments, statistics, exposures. */
static learned snapshot(const trainer *t)
{
    learned out = {0};
    const anchors *sets[] = {&t->anchors, &t->moment1.anchors, &t->moment2.anchors};
    for (int i = 0; i < 3; i++)
        for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
            append(&out, sets[i]->field[f], sets[i]->count * anchors_width(sets[i], f));
    const float *networks[] = {t->decoder.params, t->moment1.networks, t->moment2.networks};
    for (int i = 0; i < 3; i++)
        append(&out, networks[i], t->decoder.param_count);
    append(&out, t->stats.importance_accum, t->stats.count);
    append(&out, t->stats.visit_count, t->stats.count);
    append(&out, t->stats.grad_accum, t->stats.count * (size_t)t->stats.offset_count);
    const float *exposure[] = {t->exposures.matrix, t->exposures.moment1, t->exposures.moment2};
    for (int i = 0; i < 3 && t->exposures.count > 0; i++)
        append(&out, exposure[i], t->exposures.count * AFFINE_NUMBERS);
    return out;
}

static void assert_unchanged(const trainer *t, learned before)
{
    learned now = snapshot(t);
    assert_int_equal(now.count, before.count);
    assert_memory_equal(now.values, before.values, now.count * sizeof(float));
    free(now.values);
    free(before.values);
}

static void assert_no_gradient_left(const trainer *t)
{
    const anchors *g = &t->gradient.anchors;
    for (size_t i = 0; i < g->count * ANCHOR_FEATURE_DIM; i++)
        assert_true(g->feature[i] == 0);
    for (size_t i = 0; i < g->count * 6; i++)
        assert_true(g->scale_log[i] == 0);
    for (size_t i = 0; i < t->decoder.param_count; i++)
        assert_true(t->gradient.networks[i] == 0);
}

/* A background that is not a number makes the loss one; an exposure of 1e30 makes gradients too large for
   Adam. */
static void a_bad_step_changes_nothing(void **state)
{
    (void)state;
    for (int test = 0; test < 4; test++) {
        const int kind = test % 2;
        gbt_train_def def = run_def();
        def.exposure = true;
        def.views = test < 2 ? 1 : 4;
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        for (int i = 0; i < 5; i++)
            step_ok(&t, &r);
        assert_false(r.skipped);
        const float background = t.settings.background[0];
        float *matrix = mem_alloc(t.exposures.count * AFFINE_NUMBERS, sizeof *matrix, "test", NULL);
        memcpy(matrix, t.exposures.matrix, t.exposures.count * AFFINE_NUMBERS * sizeof *matrix);
        if (kind == 0)
            t.settings.background[0] = NAN;
        for (size_t i = 0; kind == 1 && i < t.exposures.count; i++)
            t.exposures.matrix[i * AFFINE_NUMBERS] = 1e30f;
        const learned before = snapshot(&t);
        step_ok(&t, &r);
        assert_true(r.skipped && t.skipped_steps == 1 && t.skipped_in_row == 1 && t.step == 6);
        assert_unchanged(&t, before);
        assert_no_gradient_left(&t);
        t.settings.background[0] = background;
        memcpy(t.exposures.matrix, matrix, t.exposures.count * AFFINE_NUMBERS * sizeof *matrix);
        step_ok(&t, &r); /* and the run goes on */
        assert_true(!r.skipped && t.skipped_steps == 1 && t.skipped_in_row == 0 && t.step == 7);
        mem_free(matrix);
        trainer_free(&t);
    }
}

static void skipped_steps_are_in_no_mean(void **state)
{
    (void)state;
    const gbt_train_def def = run_def();
    trainer t;
    step_report r;
    run_log log;
    double psnr[4];
    open_ok(&t, tiny, &def);
    assert_ok(run_log_open(&log, &t, in_folder("skipped.csv"), in_folder("skipped.events"), NULL));
    for (int i = 0; i < 4; i++) { /* bad, good, bad, good */
        const float background = t.settings.background[0];
        if (i % 2 == 0)
            t.settings.background[0] = NAN;
        step_ok(&t, &r);
        t.settings.background[0] = background;
        assert_int_equal(r.skipped, i % 2 == 0);
        run_log_step(&log, &t, &r);
        psnr[i] = r.psnr;
    }
    assert_true(log.all.steps == 4 && log.all.compared == 2 && isfinite(log.all.loss));
    assert_true(fabs(log.all.psnr - (psnr[1] + psnr[3])) < 1e-9);
    assert_true(fabs(log.psnr_smooth - (0.98 * psnr[1] + 0.02 * psnr[3])) < 1e-9);
    run_log_close(&log);
    trainer_free(&t);
}

static void ten_bad_steps_end_the_run(void **state)
{
    (void)state;
    static const struct {
        bool exposure;
        const char *says;
    } cases[] = {{false, "the loss is not finite (photo 00"}, {true, "of anchor"}};
    for (int kind = 0; kind <= 1; kind++) {
        gbt_train_def def = run_def();
        def.exposure = cases[kind].exposure;
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        if (kind == 0)
            t.settings.background[1] = INFINITY;
        for (size_t i = 0; kind == 1 && i < t.exposures.count; i++)
            t.exposures.matrix[i * AFFINE_NUMBERS] = 1e30f;
        for (int i = 0; i < 9; i++)
            step_ok(&t, &r);
        gbt_error err = {0};
        assert_int_equal(trainer_step(&t, &r, &err), GBT_ERR_FORMAT);
        if (strstr(err.text, "10 steps in a row") == NULL || strstr(err.text, cases[kind].says) == NULL ||
            strchr(err.text, '\n') != NULL)
            fail_msg("%s", err.text);
        print_message("%s\n", err.text);
        trainer_free(&t);
    }
}

/* When all has been read. */
static void remove_photo(const gbt_event *event, void *context)
{
    if (event->kind == GBT_EVENT_MESSAGE && strstr(event->text, "photos to train on") != NULL)
        remove(context);
}

static void a_photo_that_goes_ends_the_run_saved(void **state)
{
    (void)state;
    const char *folder = in_folder("going"), *run = in_folder("gone");
    scene s;
    make_tiny_scene(folder);
    assert_ok(scene_load(folder, NULL, &s, NULL));
    assert_true(s.views[0].is_test);
    gbt_train_def def = run_def(); /* saves nothing on the way */
    def.iterations = 1000000;
    for (double at = 0.1; def.eval_at_count < GBT_TRAIN_MAX_EVALS; at *= 2)
        def.eval_at_seconds[def.eval_at_count++] = at;
    gbt_listen(remove_photo, s.views[0].path);
    train_fails(folder, run, &def, GBT_ERR_IO, "; saved in ");
    be_quiet();
    assert_true(file_exists(joined(run, "checkpoints/last.gbt")) && file_exists(joined(run, "model.gbt")));
    scene_free(&s);
}

/* Every place of a gradient, every value that is no good. */
static void a_bad_gradient_is_named(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    trainer t;
    step_report r;
    open_ok(&t, tiny, &def);
    step_ok(&t, &r);
    char where[80] = "untouched";
    double exposure[AFFINE_NUMBERS] = {1};
    assert_false(gradient_is_bad(&t.gradient, &t.views[0].frame, &t.decoder, exposure, where, sizeof where));
    assert_string_equal(where, "untouched");
    const size_t anchor = t.views[0].frame.visible[t.views[0].frame.visible_count - 1],
                 k = (size_t)t.gradient.anchors.offset_count;
    decoder_network networks[3];
    decoder_networks(&t.decoder, networks);
    const struct {
        float *place;
        const char *name;
        size_t value;
        bool of_anchor;
    } places[] = {
        {t.gradient.anchors.feature + anchor * 32 + 31, "feature", 31, true},
        {t.gradient.anchors.offset + anchor * 3 * k, "offset", 0, true},
        {t.gradient.anchors.scale_log + anchor * 6 + 5, "scale", 5, true},
        {t.gradient.networks, "opacity network", 0, false},
        {t.gradient.networks + networks[1].begin + 7, "shape network", 7, false},
        {t.gradient.networks + networks[2].end - 1, "colour network", networks[2].end - 1 - networks[2].begin,
         false},
    };
    static const float values[] = {NAN, INFINITY, -INFINITY, 1.1e18f, -3e38f};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        for (size_t v = 0; v < sizeof values / sizeof *values; v++) {
            char wanted[80];
            *places[i].place = values[v];
            assert_true(
                gradient_is_bad(&t.gradient, &t.views[0].frame, &t.decoder, exposure, where, sizeof where));
            if (places[i].of_anchor)
                snprintf(wanted, sizeof wanted, "%s of anchor %zu, value %zu", places[i].name, anchor,
                         places[i].value);
            else
                snprintf(wanted, sizeof wanted, "%s, value %zu", places[i].name, places[i].value);
            assert_string_equal(where, wanted);
            *places[i].place = v == 3 ? GRADIENT_LIMIT : 0; /* the limit itself is good */
            assert_false(
                gradient_is_bad(&t.gradient, &t.views[0].frame, &t.decoder, exposure, where, sizeof where));
            *places[i].place = 0;
        }
    exposure[11] = NAN;
    assert_true(gradient_is_bad(&t.gradient, &t.views[0].frame, &t.decoder, exposure, where, sizeof where));
    assert_string_equal(where, "exposure, value 11");
    assert_false(gradient_is_bad(&t.gradient, &t.views[0].frame, &t.decoder, NULL, where, sizeof where));
    trainer_free(&t);
}

/* Log-scales that run away are held, whatever the rate. */
static void scales_stay_in_their_range(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.learning_rate_factor = 1000;
    def.grow = false; /* transparent anchors stay */
    trainer t;
    step_report r;
    open_ok(&t, tiny, &def);
    size_t held = 0;
    for (int i = 0; i < STEPS; i++)
        step_ok(&t, &r);
    for (size_t i = 0; i < t.anchors.count * 6; i++) {
        const float most = t.scale_log_max[i / 6];
        assert_true(t.anchors.scale_log[i] >= t.scale_log_min && t.anchors.scale_log[i] <= most);
        held += t.anchors.scale_log[i] <= t.scale_log_min || t.anchors.scale_log[i] >= most;
    }
    assert_true(held > 0);
    assert_true(exp((double)t.scale_log_limit) > 50 * t.extent &&
                exp((double)t.scale_log_min) < 1e-5 * t.extent);
    trainer_free(&t);
}

/* ---- what stands before a camera ---- */

/* Where a photo was taken there is room; the held-out ones say nothing, nor do points that no track names. */
static void nothing_is_nearer_than_photos_show(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    trainer t;
    def.near = 0;
    open_ok(&t, tiny, &def);
    const float least = t.settings.t_near;
    double nearest = INFINITY;
    for (size_t v = 0; v < t.scene.view_count; v++) {
        assert_true(t.scene.views[v].nearest > 0);
        if (!t.scene.views[v].is_test)
            nearest = fmin(nearest, t.scene.views[v].nearest);
    }
    trainer_free(&t);
    assert_true(least > 0 && nearest > (double)least);
    for (int i = 1; i <= 2; i++) {
        def.near = 0.5 * i;
        open_ok(&t, tiny, &def);
        assert_true(t.settings.t_near == fmaxf(least, (float)(def.near * nearest)) &&
                    t.settings.t_near > least);
        trainer_free(&t);
    }
}

/* ---- a scene that has lost all its Gaussians ---- */

/* Opacities far below 0 have no gradient: without help the scene would stay empty for ever. */
static void an_empty_scene_comes_back(void **state)
{
    (void)state;
    for (int compat = 0; compat <= 1; compat++) {
        gbt_train_def def = run_def();
        def.compat = compat == 1;
        def.grow = false;
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        t.rules.raises_until = 0;
        decoder_network networks[3];
        decoder_networks(&t.decoder, networks);
        step_ok(&t, &r);
        for (int k = 0; k < t.decoder.offset_count; k++)
            t.decoder.params[networks[0].end - 1 - (size_t)k] = -4;
        for (int i = 0; i < 4; i++) {
            step_ok(&t, &r);
            assert_true(r.gaussians == 0 && r.visible > 0 && t.opacity_raises == 0);
        }
        step_ok(&t, &r);
        assert_int_equal(t.opacity_raises, 1);
        for (int i = 0; i < 10; i++)
            step_ok(&t, &r);
        assert_true(r.gaussians > t.anchors.count / 2 && t.opacity_raises == 1);
        trainer_free(&t);
    }
}

/* An offset that is below 0 for every anchor, at the start or some steps later, is raised until anchors grow;
   not after, and with --compat it stays as the reference has it. */
static void no_offset_dies_at_the_start(void **state)
{
    (void)state;
    static const struct {
        bool compat;
        int before; /* steps */
        double until;
        bool raised;
    } cases[] = {{false, 0, 0.1, true}, {false, 3, 0.1, true}, {false, 3, 0.02, false}, {true, 0, 0, false}};
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        gbt_train_def def = run_def();
        def.compat = cases[n].compat;
        def.iterations = 100;
        def.grow = false;
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        assert_true(t.rules.raises_until == (def.compat ? 0 : SCHEDULE_ADJUST_FROM));
        t.rules.raises_until = cases[n].until;
        for (int i = 0; i < cases[n].before; i++)
            step_ok(&t, &r);
        decoder_network networks[3];
        decoder_networks(&t.decoder, networks);
        const size_t k_count = (size_t)t.decoder.offset_count;
        t.decoder.params[networks[0].end - k_count] = -2;
        size_t count[2] = {0, 0};
        for (int step = 0; step < 2; step++) {
            step_ok(&t, &r);
            for (size_t i = 0; i < t.views[0].frame.gaussians.count; i++)
                count[step] += t.views[0].frame.tape.slot[i] % k_count == 0;
        }
        assert_int_equal(count[0], 0);
        assert_true(cases[n].raised ? count[1] > t.views[0].frame.visible_count / 2 : count[1] == 0);
        trainer_free(&t);
    }
}

/* The mean opacity of an offset that is too low becomes what was asked for; one that is high stays. */
static void opacities_are_raised(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    trainer t;
    open_ok(&t, tiny, &def);
    decoder_network networks[3];
    decoder_networks(&t.decoder, networks);
    const size_t k_count = (size_t)t.decoder.offset_count;
    float *bias = t.decoder.params + networks[0].end - k_count;
    bias[0] = -1;
    bias[1] = 1.5f;
    const gbt_camera camera = photos_camera(&t.photos, 0, 0);
    for (int pass = 0; pass < 2; pass++) {
        assert_ok(frame_render(&t.views[0].frame, frame_neural(&t.anchors, &t.decoder), &camera, &t.settings,
                               true, NULL));
        if (pass == 0)
            decode_raise_opacity(&t.views[0].frame.tape, 0.1f, 0.25f, &t.decoder);
    }
    assert_true(bias[0] > 0 && bias[1] == 1.5f);
    double sum = 0;
    for (size_t i = 0; i < t.views[0].frame.gaussians.count; i++)
        if (t.views[0].frame.tape.slot[i] % k_count == 0)
            sum += (double)t.views[0].frame.gaussians.opacity[i];
    assert_true(fabs(sum / (double)t.views[0].frame.visible_count - 0.25) < 0.05);
    trainer_free(&t);
}

/* ---- poor points ---- */

enum { POINTS_MOST = 1200 };

/* A copy of the tiny scene, in units of which each of its own has `unit`, with the first `keep` of its
   points, moved along the optical axes by `shift`. Returns its folder. */
static const char *copy_tiny(const char *name, const scene *s, size_t keep, double unit, double shift)
{
    colmap_image pictures[VIEWS];
    static colmap_point points[POINTS_MOST];
    memset(pictures, 0, sizeof pictures);
    assert_true(s->view_count == VIEWS && keep <= POINTS_MOST);
    const char *folder = in_folder("%s", name);
    assert_ok(file_make_folder(folder, NULL));
    assert_int_equal(symlink("../tiny/images", joined(folder, "images")), 0);
    for (size_t v = 0; v < VIEWS; v++) {
        pictures[v] = (colmap_image){.name = s->views[v].name, .camera = s->views[v].camera};
        for (int k = 0; k < 3; k++)
            pictures[v].camera.center[k] *= unit;
    }
    for (size_t p = 0; p < keep; p++)
        for (size_t k = 0; k < 3; k++) {
            points[p].position[k] = unit * (double)s->points.position[3 * p + k] + (k == 2 ? shift : 0);
            points[p].color[k] = (unsigned char)(255 * s->points.color[3 * p + k] + 0.5f);
        }
    assert_ok(colmap_write(joined(folder, "sparse/0"), pictures, VIEWS, points, keep, NULL));
    return folder;
}

static void note_unseen(const gbt_event *event, void *seen)
{
    if (event->kind == GBT_EVENT_WARNING &&
        strstr(event->text, "training photos see no sparse point") != NULL)
        *(bool *)seen = true;
}

static void points_that_tell_nothing_are_replaced(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        size_t keep;
        double shift;
        bool by_one; /* a single photo, and at most its neighbours, see a single point */
        const char *says;
    } cases[] = {{"few", 60, 0, false, "60 sparse points and "},
                 {"unseen", 150, 1e4, false, "none that half of the photos see"},
                 {"all", 150, 0, false, "150 sparse points"},
                 {"chance", 150, 1e4, true, "none that half of the photos see"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        scene s;
        const scene_split split = {.kind = SCENE_SPLIT_NONE};
        assert_ok(scene_load(tiny, &split, &s, NULL));
        const gbt_camera *camera = &s.views[3].camera;
        for (size_t k = 0; k < 3 && cases[i].by_one; k++)
            s.points.position[k] =
                (float)(camera->center[k] + 1e4 * camera->rotation[6 + k] - (k == 2 ? cases[i].shift : 0));
        const char *folder = copy_tiny(cases[i].name, &s, cases[i].keep, 1, cases[i].shift);
        gbt_train_def def = run_def();
        trainer t;
        step_report r;
        bool warned = false;
        gbt_listen(note_unseen, &warned);
        open_ok(&t, folder, &def);
        be_quiet();
        if (warned != (cases[i].shift > 0) || strstr(t.start_text, cases[i].says) == NULL)
            fail_msg("%s: %s", cases[i].name, t.start_text);
        assert_true(i == 2 ? t.scene.points.count == 150 : t.scene.points.count > 400);
        for (size_t v = 0; v < t.scene.view_count; v++) /* the origin is near the cameras, too */
            assert_true(fabs(t.scene.views[v].camera.center[2]) < 100);
        step_ok(&t, &r);
        trainer_free(&t);
        scene_free(&s);
    }
}

/* Whoever opens a run of such data has no points either, and the model's near distance. */
static void they_are_forgotten_by_all(void **state)
{
    (void)state;
    static loaded_run run;
    scene s;
    const gbt_train_def def = run_def();
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    train_ok(copy_tiny("elsewhere", &s, 150, 1, 1e4), in_folder("lost"), &def);
    assert_ok(loaded_run_open(in_folder("lost"), NULL, 0, &run, NULL));
    assert_true(run.scene.points.count == 0);
    assert_true(loaded_run_settings(&run, 0).t_near == run.settings.t_near);
    loaded_run_close(&run);
    scene_free(&s);
}

/* The world stays where it is, and the origin is among the cameras. */
static void what_points_say_is_forgotten(void **state)
{
    (void)state;
    scene s, before;
    assert_ok(scene_load(tiny, NULL, &s, NULL));
    assert_ok(scene_load(tiny, NULL, &before, NULL));
    assert_true(s.views[0].nearest > 0 && s.views[0].seen_count > 0);
    assert_ok(scene_forget_points(&s, true, NULL));
    size_t at_origin[3] = {0, 0, 0};
    for (size_t v = 0; v < s.view_count; v++) {
        assert_true(s.views[v].nearest == 0 && s.views[v].seen_count == 0);
        for (size_t k = 0; k < 3; k++) {
            at_origin[k] += s.views[v].camera.center[k] == 0;
            assert_true(fabs(s.views[v].camera.center[k] + s.origin[k] - before.views[v].camera.center[k] -
                             before.origin[k]) < 1e-12);
        }
    }
    assert_true(s.points.count == 0 && at_origin[0] > 0 && at_origin[1] > 0 && at_origin[2] > 0);
    scene_free(&s);
    scene_free(&before);
}

/* A camera that turns in the middle of the points: half of them are nearer than what first sizes are a
   hundredth of, at most. */
static void sizes_are_of_what_stands_around(void **state)
{
    (void)state;
    scene s;
    trainer t;
    const gbt_train_def def = run_def();
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    const double middle[3] = {0, 0, 0}, up[3] = {0.3, 0.5, 0.8};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    for (size_t v = 0; v < VIEWS; v++) {
        const float *p = s.points.position + 3 * (16 * v);
        const double target[3] = {(double)p[0], (double)p[1], (double)p[2]};
        assert_true(gbt_camera_look_at(middle, target, up, &s.views[v].camera));
    }
    open_ok(&t, copy_tiny("around", &s, 150, 1, 0), &def);
    size_t seen = 0, nearer = 0;
    for (size_t i = 0; i < t.scene.points.count; i++) {
        double distance;
        if (!camera_sees(&t.scene.views[t.train_views[0]].camera, t.scene.points.position + 3 * i, &distance))
            continue;
        seen++;
        nearer += distance < 100 * t.first_scale_max;
    }
    assert_true(seen > 0 && 2 * nearer + 2 >= seen && 2 * nearer <= seen + 2);
    trainer_free(&t);
    scene_free(&s);
}

/* Every third anchor is in no picture, and these would be the sample of 1,200: others are asked, in any unit
   of length. */
static void distances_are_of_what_photos_show(void **state)
{
    (void)state;
    double distance[2];
    for (int u = 0; u < 2; u++) {
        scene s;
        trainer t;
        gbt_train_def def = run_def();
        const scene_split split = {.kind = SCENE_SPLIT_NONE};
        assert_ok(scene_load(tiny, &split, &s, NULL));
        assert_int_equal(s.points.count, 150);
        scene_points many = {.count = POINTS_MOST, .has_color = true};
        many.position = mem_alloc(POINTS_MOST, 3 * sizeof *many.position, "test", NULL);
        many.color = mem_alloc(POINTS_MOST, 3 * sizeof *many.color, "test", NULL);
        for (size_t i = 0; i < 3 * POINTS_MOST; i++) {
            const bool unseen = i / 3 % 3 == 0 && i % 3 == 2;
            many.position[i] = s.points.position[i % 450] + 1e-5f * (float)(i / 450) + (unseen ? 1e4f : 0);
            many.color[i] = s.points.color[i % 450];
        }
        mem_free(s.points.position);
        mem_free(s.points.color);
        s.points = many;
        def.init = GBT_INIT_RANDOM;
        def.init_count = 1;
        open_ok(&t, copy_tiny(u == 0 ? "thirds" : "large thirds", &s, POINTS_MOST, u == 0 ? 1 : 1024, 0),
                &def);
        assert_int_equal(t.anchors.count, POINTS_MOST);
        distance[u] = t.distance;
        trainer_free(&t);
        scene_free(&s);
    }
    assert_true(distance[0] < 100 && fabs(distance[1] / distance[0] / 1024 - 1) < 1e-3);
}

/* ---- units ---- */

/* Metres or millimetres: a scene in another unit of length is learned as well. */
static void the_unit_of_length_does_not_matter(void **state)
{
    (void)state;
    static const struct {
        double unit;
        gbt_init_kind init;
    } cases[] = {{1, GBT_INIT_GB},    {1024, GBT_INIT_GB}, {1.0 / 1024, GBT_INIT_GB},
                 {1e-9, GBT_INIT_GB}, {1, GBT_INIT_VOXEL}, {1e-9, GBT_INIT_VOXEL}};
    enum { CASES = sizeof cases / sizeof *cases };
    double losses[CASES] = {0};
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    for (int i = 0; i < CASES; i++) {
        char name[16];
        snprintf(name, sizeof name, "unit%d", i);
        const char *folder = copy_tiny(name, &s, s.points.count, cases[i].unit, 0);
        gbt_train_def def = run_def();
        def.init = cases[i].init;
        trainer t;
        open_ok(&t, folder, &def);
        for (int step = 0; step < STEPS; step++) {
            step_report r;
            step_ok(&t, &r);
            losses[i] += step >= STEPS / 2 ? r.loss : 0;
        }
        trainer_free(&t);
    }
    scene_free(&s);
    for (int i = 1; i < CASES; i++) {
        const int in_one = cases[i].init == GBT_INIT_GB ? 0 : 4;
        print_message("loss in units of %g: %.4f of that in units of 1\n", cases[i].unit,
                      losses[i] / losses[in_one]);
        assert_true(fabs(losses[i] / losses[in_one] - 1) < 0.03);
    }
}

/* ---- photos that differ in exposure ---- */

/* Half as bright, so that twice that does not clip. */
static void expose(image *photo, size_t view)
{
    static const float factors[3] = {0.5f, 1, 2};
    for (int i = 0; i < 3 * photo->width * photo->height; i++)
        photo->pixels[i] *= 0.5f * factors[view * 7 % 3];
}

static double score_of(const char *run, const char *data, gbt_train_def def)
{
    train_ok(data, run, &def);
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    assert_ok(gbt_evaluate(run, &score, NULL));
    json_t *metrics = json_load_file(joined(run, "metrics.json"), 0, NULL);
    const double psnr = json_number_value(json_object_get(metrics, "psnr"));
    assert_int_equal(json_is_true(json_object_get(metrics, "exposure")), def.exposure);
    assert_int_equal(strncmp(json_string_value(json_object_get(metrics, "scored")),
                             def.exposure ? "right half" : "whole image", 10),
                     0);
    assert_int_equal(strstr(json_string_value(json_object_get(metrics, "scored")), "aligned poses") != NULL,
                     def.refine_poses);
    json_decref(metrics);

    trainer t; /* in passing and at the end: one protocol. Eval also knows the smallest pixel of each anchor
                  (frame/frame.h). */
    double in_passing;
    open_ok(&t, data, &def);
    assert_ok(checkpoint_load(&t, joined(run, "checkpoints/last.gbt"), NULL));
    assert_ok(held_out_psnr(&t, &in_passing, NULL));
    if (!(fabs(in_passing - psnr) < 0.01))
        fail_msg("%.9f dB in passing, %.9f dB by eval", in_passing, psnr);
    trainer_free(&t);
    return psnr;
}

/* What one photo takes, the others give: the scene has the photos' mean exposure. */
static void exposures_stay_centred(void **state)
{
    (void)state;
    exposures e = {0};
    float identity[AFFINE_NUMBERS];
    affine_identity(identity);
    assert_ok(exposures_make(&e, 4, NULL));
    for (size_t step = 0; step < 10; step++) {
        double gradient[AFFINE_NUMBERS];
        for (size_t k = 0; k < AFFINE_NUMBERS; k++)
            gradient[k] = (double)k - 4.5;
        exposures_step(&e, step % 3, gradient, 0.01);
        for (size_t k = 0; k < AFFINE_NUMBERS; k++) {
            double mean = 0;
            for (size_t i = 0; i < 4; i++)
                mean += (double)e.matrix[i * AFFINE_NUMBERS + k] / 4;
            assert_true(fabs(mean - (double)identity[k]) < 1e-6);
            /* Against its gradient, more than photo 3, which is never seen. */
            const float moved = e.matrix[step % 3 * AFFINE_NUMBERS + k] - e.matrix[3 * AFFINE_NUMBERS + k];
            assert_true(k < 5 ? moved > 0.009f : moved < -0.009f);
        }
    }
    exposures_free(&e);
}

/* Measured with 400 steps: 15.4 dB without, 27.9 dB with. */
static void exposure_is_learned(void **state)
{
    (void)state;
    gbt_make_scene_def make = gbt_make_scene_def_default();
    make.width = 80;
    make.height = 60;
    make.view_count = 20;
    make.points = 800;
    make.samples = 4;
    assert_ok(gbt_make_scene(&make, in_folder("even"), NULL));
    copy_scene(in_folder("even"), in_folder("exposed"), expose);
    gbt_train_def def = run_def();
    def.iterations = 400;
    def.find_exposure = false;
    const double without = score_of(in_folder("without"), in_folder("exposed"), def);
    def.exposure = true;
    const double with = score_of(in_folder("with"), in_folder("exposed"), def);
    print_message("held-out PSNR %.2f dB without, %.2f dB with exposure\n", without, with);
    assert_true(with >= without + 10);
    assert_true(file_exists(in_folder("with/exposure.json")) &&
                !file_exists(in_folder("without/exposure.json")));

    /* The mean of the matrices is the identity, and each shows its photo's factor. */
    json_t *file = json_load_file(in_folder("with/exposure.json"), 0, NULL);
    const json_t *list = json_object_get(file, "photos");
    double sum[AFFINE_NUMBERS] = {0};
    for (size_t i = 0; i < json_array_size(list); i++)
        for (size_t k = 0; k < AFFINE_NUMBERS; k++)
            sum[k] +=
                json_number_value(json_array_get(json_object_get(json_array_get(list, i), "matrix"), k));
    assert_int_equal(json_array_size(list), 17);
    for (size_t k = 0; k < AFFINE_NUMBERS; k++)
        assert_true(fabs(sum[k] / 17 - (k % 5 == 0)) < 1e-5);
    json_decref(file);
}

static void count_unaligned(const gbt_event *event, void *context)
{
    *(int *)context += event->kind == GBT_EVENT_WARNING && strstr(event->text, "not aligned") != NULL;
}

/* Whoever opens a run has its sky and its poses. */
static void sky_and_poses_are_scored(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.find_exposure = false;
    def.iterations = 200;
    def.footprint = 0; /* no smallest pixels, of which only eval knows */
    def.background = GBT_BACKGROUND_SKY;
    score_of(in_folder("sky"), tiny, def);
    def.background = GBT_BACKGROUND_CONSTANT;
    def.refine_poses = true;
    int warned = 0;
    gbt_listen(count_unaligned, &warned);
    score_of(in_folder("refined"), tiny, def);
    assert_int_equal(warned, 0);
    def.stop_at_step = 3;
    train_fails(tiny, in_folder("refined half"), &def, GBT_ERR_INTERRUPTED, "stopped");
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    assert_ok(gbt_evaluate(in_folder("refined half"), &score, NULL));
    be_quiet();
    assert_int_equal(warned, 1);
}

/* Interrupted or not, one thread or three. */
static void exposure_resumes_to_the_same_bits(void **state)
{
    (void)state;
    const int before = parallel_threads();
    gbt_train_def def = run_def();
    def.exposure = true;
    train_ok(tiny, in_folder("exposure straight"), &def);
    def.stop_at_step = 23;
    train_fails(tiny, in_folder("exposure halves"), &def, GBT_ERR_INTERRUPTED, "resume continues");
    gbt_train_def more = gbt_train_def_default();
    more.resume = true;
    gbt_set_threads(3);
    train_ok(tiny, in_folder("exposure halves"), &more);
    gbt_set_threads(before);
    assert_same_file(in_folder("exposure straight/model.gbt"), in_folder("exposure halves/model.gbt"));
    assert_same_file(in_folder("exposure straight/exposure.json"),
                     in_folder("exposure halves/exposure.json"));
}

static void signal_at_warning(const gbt_event *event, void *context)
{
    (void)context;
    if (event->kind == GBT_EVENT_WARNING)
        raise(SIGTERM);
}

/* A run that raises a signal when it is opened: with the warning that poses of training are not there. */
static void train_for_a_signal(const char *run)
{
    gbt_train_def def = run_def();
    def.iterations = 3;
    def.refine_poses = true;
    train_ok(tiny, run, &def);
    assert_int_equal(remove(joined(run, "poses.json")), 0);
    gbt_listen(signal_at_warning, NULL);
}

static void making_small_stops_at_a_signal(void **state)
{
    (void)state;
    const char *run = in_folder("large");
    const gbt_compress_def small = gbt_compress_def_default();
    gbt_error err = {0};
    train_for_a_signal(run);
    assert_int_equal(gbt_compress(run, &small, in_folder("small.gbt"), NULL, &err), GBT_ERR_INTERRUPTED);
    be_quiet();
    assert_string_equal(err.text, "stopped while the model was made small (compress, or resume of a "
                                  "training, does it again)");
    assert_false(file_exists(in_folder("small.gbt")));
    assert_ok(gbt_compress(run, &small, in_folder("small.gbt"), NULL, NULL));
}

static void a_far_anchor_does_not_move_the_others(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 3;
    train_ok(tiny, in_folder("stray"), &def);
    for (int far = 0; far < 2; far++) {
        const gbt_compress_def small = gbt_compress_def_default();
        model m, back;
        assert_ok(model_load(in_folder("stray/model.gbt"), &m, NULL));
        if (far == 1) {
            m.anchors.position[0] += 1e6f * m.extent;
            assert_ok(model_save(in_folder("stray/model.gbt"), &m, NULL));
        }
        assert_ok(gbt_compress(in_folder("stray"), &small, in_folder("stray.gbt"), NULL, NULL));
        assert_ok(model_load(in_folder("stray.gbt"), &back, NULL));
        const size_t size = 3 * m.anchors.count * sizeof(float);
        assert_int_equal(back.anchors.count, m.anchors.count);
        assert_true((memcmp(back.anchors.position, m.anchors.position, size) == 0) == (far == 1));
        model_free(&m);
        model_free(&back);
    }
}

static void scoring_stops_at_a_signal(void **state)
{
    (void)state;
    const char *run = in_folder("unscored");
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    gbt_error err = {0};
    train_for_a_signal(run);
    assert_int_equal(gbt_evaluate(run, &score, &err), GBT_ERR_INTERRUPTED);
    be_quiet();
    assert_string_equal(err.text, "stopped while held-out views were scored (eval scores the run)");
    assert_false(file_exists(joined(run, "metrics.json")));
    assert_ok(gbt_evaluate(run, &score, NULL));
    assert_true(file_exists(joined(run, "metrics.json")));
}

static void scoring_in_passing_stops_at_a_signal(void **state)
{
    (void)state;
    trainer t;
    const gbt_train_def def = run_def();
    double psnr;
    gbt_error err = {0};
    open_ok(&t, tiny, &def);
    stop_signal_catch();
    raise(SIGTERM);
    const gbt_status status = held_out_psnr(&t, &psnr, &err);
    stop_signal_release();
    assert_int_equal(status, GBT_ERR_INTERRUPTED);
    assert_string_equal(err.text, "stopped while held-out photos were scored");
    assert_ok(held_out_psnr(&t, &psnr, NULL));
    assert_true(isfinite(psnr));
    trainer_free(&t);
}

int main(void)
{
    be_quiet();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_that_are_not_numbers_are_marked),
        cmocka_unit_test(a_bad_pixel_has_no_say),
        cmocka_unit_test(a_bad_gradient_is_named),
        cmocka_unit_test(a_bad_step_changes_nothing),
        cmocka_unit_test(skipped_steps_are_in_no_mean),
        cmocka_unit_test(ten_bad_steps_end_the_run),
        cmocka_unit_test(a_photo_that_goes_ends_the_run_saved),
        cmocka_unit_test(scales_stay_in_their_range),
        cmocka_unit_test(an_empty_scene_comes_back),
        cmocka_unit_test(no_offset_dies_at_the_start),
        cmocka_unit_test(nothing_is_nearer_than_photos_show),
        cmocka_unit_test(opacities_are_raised),
        cmocka_unit_test(points_that_tell_nothing_are_replaced),
        cmocka_unit_test(what_points_say_is_forgotten),
        cmocka_unit_test(they_are_forgotten_by_all),
        cmocka_unit_test(sizes_are_of_what_stands_around),
        cmocka_unit_test(distances_are_of_what_photos_show),
        cmocka_unit_test(the_unit_of_length_does_not_matter),
        cmocka_unit_test(wild_rates_and_photos_leave_no_nan),
        cmocka_unit_test(exposures_stay_centred),
        cmocka_unit_test(exposure_is_learned),
        cmocka_unit_test(sky_and_poses_are_scored),
        cmocka_unit_test(exposure_resumes_to_the_same_bits),
        cmocka_unit_test(making_small_stops_at_a_signal),
        cmocka_unit_test(a_far_anchor_does_not_move_the_others),
        cmocka_unit_test(scoring_stops_at_a_signal),
        cmocka_unit_test(scoring_in_passing_stops_at_a_signal),
    };
    return cmocka_run_group_tests_name("robust training", tests, make_root, folder_remove);
}
