/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_masks.c -- what a mask or an alpha channel leaves out has no say in training and in
   scores; what is transparent is the background. */
#include "run_support.h"

#include <jansson.h>

#include "gbtrace/evaluate.h"
#include "io/model_file.h"
#include "quiet.h"
#include "train/schedule.h"

/* Photos of `scene`, changed in place. */
static void change_photos(const char *folder, void (*change)(image *photo, size_t view))
{
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(folder, &split, &s, NULL));
    for (size_t i = 0; i < s.view_count; i++) {
        image photo;
        assert_ok(image_read(s.views[i].path, &photo, NULL));
        change(&photo, i);
        assert_ok(image_write(s.views[i].path, &photo, NULL));
        image_free(&photo);
    }
    scene_free(&s);
}

/* The left third, and a block that moves with the view. */
static bool is_masked(int x, int y, size_t view)
{
    const int left = 20 + (int)view;
    return x < 16 || (x >= left && x < left + 9 && y >= 7 && y < 20);
}

static float scrambled;

static void scramble(image *photo, size_t view)
{
    for (int y = 0; y < photo->height; y++)
        for (int x = 0; x < photo->width; x++)
            for (int c = 0; c < 3 && is_masked(x, y, view); c++)
                photo->pixels[photo->channels * (y * photo->width + x) + c] =
                    (x + y + c) % 2 == 0 ? scrambled : 0;
}

static void write_mask(const char *folder, const char *name, int width, int height, size_t view)
{
    image mask;
    assert_ok(image_alloc(&mask, width, height, 1, NULL));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            mask.pixels[y * width + x] = !is_masked(x, y, view);
    char path[2 * PATH_SIZE];
    snprintf(path, sizeof path, "%s/masks/%.60s.png", folder, name);
    assert_ok(image_write(path, &mask, NULL));
    image_free(&mask);
}

/* The tiny scene in `folder` with an empty folder for masks, and open. */
static scene open_maskable_scene(const char *folder)
{
    char masks[PATH_SIZE + 8];
    scene s;
    make_tiny_scene(folder);
    snprintf(masks, sizeof masks, "%s/masks", folder);
    assert_ok(file_make_folder(masks, NULL));
    assert_ok(scene_load(folder, NULL, &s, NULL));
    return s;
}

static const char *masked_scene(void)
{
    const char *folder = in_folder("masked");
    static bool done = false;
    if (done)
        return folder;
    scene s = open_maskable_scene(folder);
    for (size_t i = 0; i < s.view_count; i++)
        write_mask(folder, s.views[i].name, s.views[i].camera.width, s.views[i].camera.height, i);
    scene_free(&s);
    done = true;
    return folder;
}

static json_t *scores_of(const char *run)
{
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    assert_ok(gbt_evaluate(run, &score, NULL));
    char path[PATH_SIZE + 16];
    snprintf(path, sizeof path, "%s/metrics.json", run);
    json_t *metrics = json_load_file(path, 0, NULL);
    assert_non_null(metrics);
    return metrics;
}

static void remove_points(const char *folder)
{
    char path[PATH_SIZE + 32];
    const uint64_t none = 0;
    snprintf(path, sizeof path, "%s/sparse/0/points3D.bin", folder);
    assert_ok(file_write_atomic(path, &none, sizeof none, NULL));
}

/* Whatever stands under the masks, the model is the same to the bit, and so are its scores: without and with
   exposures, and without sparse points. */
static void masked_pixels_have_no_say(void **state)
{
    (void)state;
    enum { EXPOSURE = 1, NO_POINTS = 2 };
    for (int kind = 0; kind <= NO_POINTS; kind++) {
        json_t *metrics[2];
        const char *runs[2] = {in_folder("a%d", kind), in_folder("b%d", kind)};
        masked_scene();
        if (kind == NO_POINTS)
            remove_points(masked_scene());
        for (int i = 0; i < 2; i++) {
            scrambled = (float)i;
            change_photos(masked_scene(), scramble);
            gbt_train_def def = run_def();
            def.exposure = kind == EXPOSURE;
            def.iterations = kind == NO_POINTS ? 4 : STEPS;
            train_ok(masked_scene(), runs[i], &def);
            metrics[i] = scores_of(runs[i]);
        }
        assert_same_file(in_folder("a%d/model.gbt", kind), in_folder("b%d/model.gbt", kind));
        static const char *const names[] = {"psnr", "ssim", "flip"};
        for (int k = 0; k < 3; k++) {
            const double a = json_real_value(json_object_get(metrics[0], names[k])),
                         b = json_real_value(json_object_get(metrics[1], names[k]));
            assert_true(a > 0 && a == b);
        }
        assert_non_null(
            strstr(json_string_value(json_object_get(metrics[0], "scored")), "without masked pixels"));
        json_decref(metrics[0]);
        json_decref(metrics[1]);
    }
}

static void darken_left(image *photo, size_t view)
{
    (void)view;
    for (int y = 0; y < photo->height; y++)
        for (int i = 0; i < photo->channels * (photo->width / 2); i++)
            photo->pixels[photo->channels * photo->width * y + i] *= 0.5f;
}

/* With exposures the left halves are for the matrix alone, but for the rounding of what it made. */
static void fitted_scores_are_of_the_right_halves(void **state)
{
    (void)state;
    double psnr[2], fitted[2];
    gbt_train_def def = run_def();
    def.exposure = true;
    make_tiny_scene(in_folder("halves"));
    train_ok(in_folder("halves"), in_folder("halves_run"), &def);
    for (int i = 0; i < 2; i++) {
        json_t *metrics = scores_of(in_folder("halves_run"));
        psnr[i] = json_real_value(json_object_get(metrics, "psnr"));
        fitted[i] = json_real_value(json_object_get(metrics, "psnr_fitted"));
        json_decref(metrics);
        change_photos(in_folder("halves"), darken_left);
    }
    assert_true(fitted[0] > 0 && fabs(fitted[0] - fitted[1]) < 0.1 && fabs(psnr[0] - psnr[1]) > 1);
}

/* ---- pixels without a ray ---- */

/* A lens that folds inside the picture: nearly two thirds of its pixels have no ray. */
static gbt_camera folded(int width, int height)
{
    return (gbt_camera){.model = GBT_CAMERA_SIMPLE_RADIAL,
                        .width = width,
                        .height = height,
                        .params = {0.7 * height, 0.5 * width, 0.5 * height, -0.5}};
}

static void scramble_without_ray(image *photo, size_t view)
{
    (void)view;
    const gbt_camera camera = folded(photo->width, photo->height);
    size_t without = 0;
    for (int y = 0; y < photo->height; y++)
        for (int x = 0; x < photo->width; x++) {
            double dir[3];
            const bool none = !gbt_camera_unproject(&camera, x + 0.5, y + 0.5, dir);
            without += none;
            for (int c = 0; c < 3 && none; c++)
                photo->pixels[photo->channels * (y * photo->width + x) + c] =
                    (x + y + c) % 2 == 0 ? scrambled : 0;
        }
    assert_true(without > (size_t)(photo->width * photo->height) / 4);
}

/* Of the tiny scene: one camera, as COLMAP writes it. */
static void write_folded_camera(const char *folder)
{
    const gbt_camera camera = folded(48, 36);
    const uint64_t count = 1, size[2] = {48, 36};
    const uint32_t id = 1;
    const int32_t lens = GBT_CAMERA_SIMPLE_RADIAL;
    unsigned char file[64];
    memcpy(file, &count, 8);
    memcpy(file + 8, &id, 4);
    memcpy(file + 12, &lens, 4);
    memcpy(file + 16, size, 16);
    memcpy(file + 32, camera.params, 32);
    char path[PATH_SIZE + 32];
    snprintf(path, sizeof path, "%s/sparse/0/cameras.bin", folder);
    assert_ok(file_write_atomic(path, file, sizeof file, NULL));
}

/* What stands where the lens has no ray is in no loss and in no score. */
static void pixels_without_a_ray_have_no_say(void **state)
{
    (void)state;
    const char *folder = in_folder("folded");
    make_tiny_scene(folder);
    write_folded_camera(folder);
    json_t *metrics[2];
    for (int i = 0; i < 2; i++) {
        scrambled = (float)i;
        change_photos(folder, scramble_without_ray);
        const gbt_train_def def = run_def();
        const char *run = in_folder("folded_%d", i);
        train_ok(folder, run, &def);
        metrics[i] = scores_of(run);
    }
    assert_same_file(in_folder("folded_0/model.gbt"), in_folder("folded_1/model.gbt"));
    static const char *const names[] = {"psnr", "ssim", "flip"};
    for (int k = 0; k < 3; k++) {
        const double a = json_real_value(json_object_get(metrics[0], names[k])),
                     b = json_real_value(json_object_get(metrics[1], names[k]));
        assert_true(a > 0 && a == b);
    }
    json_decref(metrics[0]);
    json_decref(metrics[1]);
}

/* Of the end of a training. */
static void keep_psnr(const gbt_event *event, void *context)
{
    if (event->kind == GBT_EVENT_PROGRESS && strcmp(event->stage, "train") == 0)
        *(double *)context = event->psnr;
}

/* What steps report is of photos that are not masked whole, as the second is. */
static void assert_reports_leave_out_the_black(const char *folder)
{
    for (int views = 1; views <= 2; views++) {
        gbt_train_def def = run_def();
        trainer t;
        step_report r;
        int black_steps = 0;
        def.views = views;
        open_ok(&t, folder, &def);
        for (int i = 0; i < STEPS; i++) {
            int black = 0;
            step_ok(&t, &r);
            for (int k = 0; k < views; k++)
                black += t.train_views[t.slots[k]] == 1;
            black_steps += black > 0;
            assert_false(r.skipped);
            if (black == views)
                assert_true(isnan(r.psnr) && isnan(r.loss));
            else
                assert_true(r.loss > 0 && r.psnr > 0 && r.psnr < 45);
        }
        assert_true(black_steps > 0);
        trainer_free(&t);
    }
}

static void keep_message(const gbt_event *event, void *context)
{
    if (event->kind == GBT_EVENT_MESSAGE)
        snprintf(context, 256, "%s", event->text);
}

/* A photo that is masked whole is no score, and no step that fails. */
static void a_black_mask_leaves_nothing(void **state)
{
    (void)state;
    const char *folder = in_folder("black");
    scene s = open_maskable_scene(folder);
    image black;
    assert_ok(image_alloc(&black, 48, 36, 1, NULL));
    memset(black.pixels, 0, 48 * 36 * sizeof *black.pixels);
    const size_t chosen[] = {0, 1}; /* the first is held out, the second trained on */
    for (int i = 0; i < 2; i++) {
        char path[2 * PATH_SIZE];
        snprintf(path, sizeof path, "%s/masks/%.60s.png", folder, s.views[chosen[i]].name);
        assert_ok(image_write(path, &black, NULL));
    }
    image_free(&black);
    scene_free(&s);
    gbt_train_def def = run_def();
    double late = 0;
    gbt_listen(keep_psnr, &late);
    train_ok(folder, in_folder("black_run"), &def);
    be_quiet();
    assert_true(late > 0 && late < 45);
    assert_reports_leave_out_the_black(folder);
    json_t *metrics = scores_of(in_folder("black_run"));
    assert_true(json_is_null(json_object_get(json_array_get(json_object_get(metrics, "views"), 0), "psnr")));
    assert_true(json_real_value(json_object_get(metrics, "psnr")) > 5);
    static const char *const scores[] = {"psnr", "psnr_fitted", "ssim", "flip"};
    for (int k = 0; k < 4; k++) { /* means over the views that have some */
        double sum = 0, count = 0;
        const json_t *view;
        size_t i;
        json_array_foreach(json_object_get(metrics, "views"), i,
                           view) if (json_is_real(json_object_get(view, "psnr")))
        {
            sum += json_real_value(json_object_get(view, scores[k]));
            count++;
        }
        assert_true(count > 0 &&
                    fabs(json_real_value(json_object_get(metrics, scores[k])) - sum / count) < 1e-6);
    }
    json_decref(metrics);
    /* For the other one that is held out, too. */
    copy_file(in_folder("black/masks/0000.png.png"), in_folder("black/masks/0008.png.png"));
    char said[256] = "";
    gbt_listen(keep_message, said);
    json_decref(scores_of(in_folder("black_run")));
    be_quiet();
    assert_string_equal(said, "no held-out view has a pixel that counts: scores are n/a");
}

/* Masks the wrong way round, say. */
static void black_masks_alone_are_refused(void **state)
{
    (void)state;
    const char *folder = in_folder("all_black");
    scene s = open_maskable_scene(folder);
    image black;
    assert_ok(image_alloc(&black, 48, 36, 1, NULL));
    memset(black.pixels, 0, 48 * 36 * sizeof *black.pixels);
    for (size_t i = 0; i < s.view_count; i++) {
        char path[2 * PATH_SIZE];
        snprintf(path, sizeof path, "%s/masks/%.60s.png", folder, s.views[i].name);
        assert_ok(image_write(path, &black, NULL));
    }
    image_free(&black);
    scene_free(&s);
    const gbt_train_def def = run_def();
    train_fails(folder, in_folder("all_black_run"), &def, GBT_ERR_FORMAT,
                "leave no pixel of any photo to train on");
}

static void write_grey(const char *path, int width, int height)
{
    image im;
    assert_ok(image_alloc(&im, width, height, 3, NULL));
    for (int i = 0; i < 3 * width * height; i++)
        im.pixels[i] = 0.5f;
    assert_ok(image_write(path, &im, NULL));
    image_free(&im);
}

/* Scoring comes last, but a run does not begin when it could not read a photo or a mask that is held out. */
static void what_is_held_out_is_looked_at_first(void **state)
{
    (void)state;
    const char *folder = in_folder("held");
    scene s = open_maskable_scene(folder);
    assert_true(s.views[0].is_test);
    char mask[2 * PATH_SIZE];
    snprintf(mask, sizeof mask, "%s/masks/%.60s.png", folder, s.views[0].name);
    const char *photo = s.views[0].path, *run = in_folder("held_run");
    const gbt_train_def def = run_def();
    const file_bytes whole = read_bytes(photo);

    assert_ok(file_write_atomic(photo, whole.data, whole.count - 20, NULL));
    train_fails(folder, run, &def, GBT_ERR_FORMAT, "PNG is truncated");

    write_grey(photo, 36, 48);
    train_fails(folder, run, &def, GBT_ERR_FORMAT, "36 x 48 is not the shape of its camera, 48 x 36");

    whole.data[whole.count / 2] ^= 1; /* pixels, which no header tells of */
    assert_ok(file_write_atomic(photo, whole.data, whole.count, NULL));
    train_fails(folder, run, &def, GBT_ERR_FORMAT, "PNG chunk is damaged");
    whole.data[whole.count / 2] ^= 1;
    assert_ok(file_write_atomic(photo, whole.data, whole.count, NULL));

    write_grey(mask, 36, 48);
    train_fails(folder, run, &def, GBT_ERR_FORMAT, "36 x 48 is not the shape of its photo, 48 x 36");
    write_grey(mask, 24, 18);
    train_ok(folder, run, &def);
    mem_free(whole.data);
    scene_free(&s);
}

/* ---- alpha ---- */

/* An alpha channel with the shape of the masks; beneath it the colour stays. */
static void cut_out(image *photo, size_t view)
{
    image with_alpha;
    assert_ok(image_alloc(&with_alpha, photo->width, photo->height, 4, NULL));
    for (int i = 0; i < photo->width * photo->height; i++) {
        memcpy(with_alpha.pixels + 4 * i, photo->pixels + photo->channels * i, 3 * sizeof(float));
        with_alpha.pixels[4 * i + 3] = is_masked(i % photo->width, i / photo->width, view) ? 0.25f : 1;
    }
    image_free(photo);
    *photo = with_alpha;
}

static void alpha_is_what_it_is_said_to_be(void **state)
{
    (void)state;
    const char *folder = in_folder("alpha");
    make_tiny_scene(folder);
    change_photos(folder, cut_out);
    static const struct {
        gbt_alpha alpha;
        float background;
        bool masked;
    } cases[] = {{GBT_ALPHA_AUTO, 0, false},
                 {GBT_ALPHA_BLACK, 0, false},
                 {GBT_ALPHA_WHITE, 1, false},
                 {GBT_ALPHA_MASK, -1, true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        gbt_train_def def = run_def();
        def.alpha = cases[i].alpha;
        const char *run = in_folder("alpha_%d", (int)cases[i].alpha);
        train_ok(folder, run, &def);
        json_t *metrics = scores_of(run);
        assert_int_equal(strstr(json_string_value(json_object_get(metrics, "scored")), "masked") != NULL,
                         cases[i].masked);
        json_decref(metrics);
        model m;
        assert_ok(model_load(in_folder("alpha_%d/model.gbt", (int)cases[i].alpha), &m, NULL));
        for (int c = 0; c < 3; c++)
            assert_true(cases[i].background < 0 ? m.background[c] > 0 && m.background[c] < 1
                                                : m.background[c] == cases[i].background);
        model_free(&m);
        trainer t;
        open_ok(&t, folder, &def);
        assert_true(t.rules.opaque_from == SCHEDULE_OPAQUE_FROM);
        trainer_free(&t);
    }
    gbt_train_def def = run_def();
    def.alpha = (gbt_alpha)7;
    train_fails(folder, in_folder("alpha_7"), &def, GBT_ERR_ARGUMENT,
                "alpha: 7 (wanted auto, black, white or mask)");
}

/* With an alpha channel that says nothing. */
static void make_opaque(image *photo, size_t view)
{
    cut_out(photo, view);
    for (int i = 0; i < photo->width * photo->height; i++)
        photo->pixels[4 * i + 3] = 1;
}

static void cut_out_later(image *photo, size_t view) { (view < 2 ? make_opaque : cut_out)(photo, view); }

static void keep_warning(const gbt_event *event, void *context)
{
    if (event->kind == GBT_EVENT_WARNING)
        snprintf(context, PATH_SIZE, "%s", event->text);
}

/* A sky that was asked for and that nothing would show. Photos whose alpha channel is opaque do show it. */
static void a_sky_that_is_not_learned_is_told(void **state)
{
    (void)state;
    static const struct {
        void (*change)(image *photo, size_t view);
        bool compat;
        const char *says;
    } cases[] = {
        {NULL, false, NULL},
        {make_opaque, false, NULL},
        {cut_out, false, "no sky is learned: photos with an alpha channel are composited on one colour"},
        {cut_out_later, false,
         "no sky is learned: photos with an alpha channel are composited on one colour"},
        {NULL, true, "no sky is learned: compat uses one colour"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char warning[PATH_SIZE] = "";
        gbt_train_def def = run_def();
        def.background = GBT_BACKGROUND_SKY;
        def.compat = cases[i].compat;
        trainer t;
        const char *folder = in_folder("sky_%d", (int)i);
        make_tiny_scene(folder);
        if (cases[i].change != NULL)
            change_photos(folder, cases[i].change);
        gbt_listen(keep_warning, warning);
        open_ok(&t, folder, &def);
        be_quiet();
        assert_int_equal(t.settings.sky.varies, cases[i].says == NULL);
        assert_int_equal(t.photos.transparency[t.train_views[0]] != NULL, cases[i].change == cut_out);
        if (cases[i].says == NULL)
            assert_string_equal(warning, "");
        else
            assert_non_null(strstr(warning, cases[i].says));
        trainer_free(&t);
    }
}

/* Of a whole photo, and of picked pixels. */
static void transparent_parts_lie_on_the_colour_asked_for(void **state)
{
    (void)state;
    const char *folder = in_folder("laid");
    make_tiny_scene(folder);
    change_photos(folder, cut_out);
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(folder, &split, &s, NULL));
    const float backdrop[3] = {0.2f, 0.9f, 0.4f};
    image stored, expected = {0}, got = {0};
    assert_ok(image_read(s.views[0].path, &stored, NULL));
    assert_ok(image_alloc(&expected, stored.width, stored.height, 3, NULL));
    for (int i = 0; i < 3 * stored.width * stored.height; i++) {
        const float alpha = stored.pixels[4 * (i / 3) + 3];
        expected.pixels[i] = alpha * stored.pixels[4 * (i / 3) + i % 3] + (1 - alpha) * backdrop[i % 3];
    }
    for (int white = 0; white < 2; white++)
        for (int apart = 1; apart <= 2; apart++) {
            scene_set_alpha(&s, white ? GBT_ALPHA_WHITE : GBT_ALPHA_BLACK);
            const int x0 = apart - 1;
            const photo_sample sample = {.pick = {.first = {x0, 0}, .step = apart}, .backdrop = backdrop};
            photos p;
            assert_ok(photos_open(&p, &s, 1, NULL));
            gbt_camera camera;
            const unsigned char *valid;
            assert_ok(photos_get_sample(&p, 0, &sample, &got, &camera, &valid, NULL));
            assert_true(got.width == expected.width / apart && got.height == expected.height / apart);
            for (int y = 0; y < got.height; y++)
                for (int x = 0; x < got.width; x++)
                    for (int c = 0; c < 3; c++)
                        assert_true(
                            fabsf(got.pixels[3 * (y * got.width + x) + c] -
                                  expected.pixels[3 * (y * apart * expected.width + x * apart + x0) + c]) <
                            1.1f / 255);
            photos_close(&p);
        }
    image_free(&stored);
    image_free(&expected);
    image_free(&got);
    scene_free(&s);
}

/* Late in a run the colour changes from step to step: photos lie on what the scene is drawn on, as their
   exposure shows it. */
static void steps_lay_photos_on_their_background(void **state)
{
    (void)state;
    const char *folder = in_folder("steps");
    make_tiny_scene(folder);
    change_photos(folder, cut_out);
    for (int exposure = 0; exposure < 2; exposure++) {
        gbt_train_def def = run_def();
        def.step_pixels = 0;
        def.exposure = exposure;
        def.find_exposure = false; /* it finds some in what the black behind them adds */
        trainer t;
        int laid = 0;
        open_ok(&t, folder, &def);
        for (size_t i = 0; i < t.exposures.count * AFFINE_NUMBERS; i++)
            t.exposures.matrix[i] = (float[]){0.5f, 0.1f, 0, 0.2f}[i % 4];
        for (t.step = 3 * STEPS / 4; t.step < STEPS; t.step++) {
            step_view *v = &t.views[0];
            step_photos_pick(&t);
            step_view_pick(&t, v, 0);
            assert_int_equal(v->outcome.status, GBT_OK);
            const float *b = v->background;
            if (memcmp(b, t.settings.background, sizeof v->background) == 0)
                continue;
            laid++;
            image stored;
            assert_ok(image_read(t.scene.views[t.train_views[v->slot]].path, &stored, NULL));
            for (int i = 0; i < 3 * stored.width * stored.height; i++) {
                const float alpha = stored.pixels[4 * (i / 3) + 3],
                            behind = exposure ? 0.5f * b[0] + 0.1f * b[1] + 0.2f : b[i % 3],
                            wanted = alpha * stored.pixels[4 * (i / 3) + i % 3] + (1 - alpha) * behind;
                assert_true(fabsf(v->photo.pixels[i] - wanted) < 1.1f / 255);
            }
            image_free(&stored);
        }
        assert_true(laid > 0);
        trainer_free(&t);
    }
}

int main(void)
{
    be_quiet();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(masked_pixels_have_no_say),
        cmocka_unit_test(fitted_scores_are_of_the_right_halves),
        cmocka_unit_test(pixels_without_a_ray_have_no_say),
        cmocka_unit_test(a_black_mask_leaves_nothing),
        cmocka_unit_test(black_masks_alone_are_refused),
        cmocka_unit_test(what_is_held_out_is_looked_at_first),
        cmocka_unit_test(alpha_is_what_it_is_said_to_be),
        cmocka_unit_test(a_sky_that_is_not_learned_is_told),
        cmocka_unit_test(transparent_parts_lie_on_the_colour_asked_for),
        cmocka_unit_test(steps_lay_photos_on_their_background),
    };
    return cmocka_run_group_tests_name("masks", tests, make_root, folder_remove);
}
