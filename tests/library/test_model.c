/* SPDX-License-Identifier: Apache-2.0 */
/* tests/library/test_model.c -- models in memory: what is refused, what can be asked, where pictures go. */
#include "folder.h"

#include "base/image.h"
#include "gbtrace/evaluate.h"
#include "gbtrace/make_scene.h"
#include "gbtrace/model.h"
#include "gbtrace/train.h"

enum { W = 9, H = 7, COUNT = 2 };

/* A white opaque ball at (0, 0, 5), and a faint one behind the camera. */
static float mean[3 * COUNT] = {0, 0, 5, 1, 2, -9}, scale_log[3 * COUNT] = {-1, -1, -1, -2, -2, -2};
static float quat[4 * COUNT] = {2, 0, 0, 0, 0, 1, 0, 0};
static float opacity[COUNT] = {1, 0.25f}, sh[3 * COUNT] = {1.7724539f, 1.7724539f, 1.7724539f, 0, 0, 0};

static gbt_gaussians two(void)
{
    return (gbt_gaussians){.count = COUNT,
                           .sh_degree = 0,
                           .mean = mean,
                           .scale_log = scale_log,
                           .quat = quat,
                           .opacity = opacity,
                           .sh = sh};
}

static const gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                                  .width = W,
                                  .height = H,
                                  .params = {12, 12, 4.5, 3.5},
                                  .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

static gbt_model *made(void)
{
    const gbt_gaussians g = two();
    gbt_model *model;
    assert_ok(gbt_model_from_gaussians(&g, &model, NULL));
    return model;
}

/* Refused with a line that says `says`. */
static void assert_refused(gbt_status status, const gbt_error *err, gbt_status wanted, const char *says)
{
    if (status != wanted || err->status != wanted || strstr(err->text, says) == NULL)
        fail_msg("wanted status %d and \"%s\", got %d: %s", (int)wanted, says, (int)status, err->text);
}

static void what_cannot_be_opened(void **state)
{
    (void)state;
    const char *path = in_folder("a.ply");
    write_text(path, "ply\nno\n");
    const struct {
        const char *path;
        gbt_status status;
    } rows[] = {{"/nowhere/run", GBT_ERR_IO},
                {"/tmp", GBT_ERR_IO},
                {path, GBT_ERR_FORMAT},
                {"/nowhere/scene.spz", GBT_ERR_IO}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_error err = {0};
        gbt_model *model = (gbt_model *)&err;
        assert_refused(gbt_model_open(rows[i].path, &model, &err), &err, rows[i].status, rows[i].path);
        assert_null(model);
    }
    gbt_model_close(NULL);
}

static void gaussians_that_are_refused(void **state)
{
    (void)state;
    static float bad_mean[3 * COUNT] = {0, NAN}, bad_scale[3 * COUNT] = {0, 0, 0, 31},
                              bad_quat[4 * COUNT] = {1};
    static float bad_opacity[COUNT] = {0, 1.5f}, bad_sh[3 * COUNT] = {INFINITY};
    const struct {
        gbt_gaussians g;
        const char *says;
    } rows[] = {{{0, 0, mean, scale_log, quat, opacity, sh}, "0 (wanted 1"},
                {{COUNT, 4, mean, scale_log, quat, opacity, sh}, "sh_degree 4"},
                {{COUNT, 0, bad_mean, scale_log, quat, opacity, sh}, "mean of Gaussian 0 is nan"},
                {{COUNT, 0, mean, bad_scale, quat, opacity, sh}, "scale_log of Gaussian 1 is 31"},
                {{COUNT, 0, mean, scale_log, bad_quat, opacity, sh}, "quat of Gaussian 1 has length 0"},
                {{COUNT, 0, mean, scale_log, quat, bad_opacity, sh}, "opacity of Gaussian 1 is 1.5"},
                {{COUNT, 0, mean, scale_log, quat, opacity, bad_sh}, "sh of Gaussian 0 is inf"},
                {{COUNT, 0, mean, scale_log, quat, NULL, sh}, "opacity is NULL"}};
    gbt_model *kept = made();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_error err = {0}, again = {0};
        gbt_model *model;
        assert_refused(gbt_model_from_gaussians(&rows[i].g, &model, &err), &err, GBT_ERR_ARGUMENT,
                       rows[i].says);
        assert_null(model);
        assert_refused(gbt_model_set_gaussians(kept, &rows[i].g, &again), &again, GBT_ERR_ARGUMENT,
                       rows[i].says);
        assert_int_equal(gbt_model_get_info(kept).gaussians, COUNT);
    }
    gbt_model_close(kept);
}

static void what_can_be_asked(void **state)
{
    (void)state;
    gbt_model *model = made();
    const gbt_model_info info = gbt_model_get_info(model);
    assert_true(info.gaussians == COUNT && info.anchors == 0 && info.sh_degree == 0 && info.iterations == 0);
    const double low[3] = {0, 0, -9}, high[3] = {1, 2, 5};
    for (int k = 0; k < 3; k++)
        assert_true(fabs(info.low[k] - low[k]) < 1e-6 && fabs(info.high[k] - high[k]) < 1e-6);
    gbt_model_view view;
    size_t count = 5;
    gbt_error err = {0}, none = {0};
    assert_refused(gbt_model_open_views(model, NULL, &count, &err), &err, GBT_ERR_ARGUMENT, "");
    assert_int_equal(count, 0);
    assert_refused(gbt_model_get_view(model, 0, &view, &none), &none, GBT_ERR_ARGUMENT, "view 0");
    gbt_model_close(model);
}

/* Small photos. */
static void make_data(const char *folder, int width, int view_count)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = width;
    def.height = 3 * width / 4;
    def.view_count = view_count;
    def.samples = 1;
    def.points = 150;
    assert_ok(gbt_make_scene(&def, folder, NULL));
}

/* Cameras stay where they are in the world when the Gaussians are others. */
static void views_stay_with_other_gaussians(void **state)
{
    (void)state;
    const char *data = in_folder("data");
    make_data(data, 16, 4);
    gbt_model *model = made();
    size_t count;
    assert_ok(gbt_model_open_views(model, data, &count, NULL));
    assert_int_equal(count, 4);
    gbt_model_view before, after;
    assert_ok(gbt_model_get_view(model, 2, &before, NULL));
    float moved[3 * COUNT];
    for (int i = 0; i < 3 * COUNT; i++)
        moved[i] = mean[i] + 7;
    gbt_gaussians g = two();
    g.mean = moved;
    assert_ok(gbt_model_set_gaussians(model, &g, NULL));
    assert_ok(gbt_model_get_view(model, 2, &after, NULL));
    for (int k = 0; k < 3; k++)
        assert_true(fabs(before.camera.center[k] - after.camera.center[k]) < 1e-12);
    gbt_model_close(model);
}

/* Quaternions of length 2, opacities as logits. The second row is not usable, the third out of view. */
static const char of_a_file[] = "ply\nformat ascii 1.0\ncomment gbtrace near 2\nelement vertex 3\n"
                                "property float x\nproperty float y\nproperty float z\n"
                                "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n"
                                "property float opacity\n"
                                "property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
                                "property float rot_0\nproperty float rot_1\nproperty float rot_2\n"
                                "property float rot_3\nend_header\n"
                                "0.25 0 5  1 0.5 0.25  0.5  0.75 0.25 0.5  1 1 1 1\n"
                                "nan 0 5  0 0 0  0.5  0 0 0  1 0 0 0\n"
                                "1 2 -9  0 0 0  -1  -2 -2 -2  0 2 0 0\n";

/* What a file's Gaussians became can be had, shows the same, and is what gradients are of. */
static void gaussians_of_a_file(void **state)
{
    (void)state;
    enum { CLASSES = 5, WIDEST = 4, VALUES = 3 * W * H };
    static const int widths[CLASSES] = {3, 3, 4, 1, 3};
    static const float wanted[CLASSES][WIDEST * COUNT] = {{0.25f, 0, 5, 1, 2, -9},
                                                          {0.75f, 0.25f, 0.5f, -2, -2, -2},
                                                          {0.5f, 0.5f, 0.5f, 0.5f, 0, 1, 0, 0},
                                                          {0.62245933f, 0.26894142f},
                                                          {1, 0.5f, 0.25f, 0, 0, 0}};
    static float of_file[VALUES], of_arrays[VALUES], d_rgb[VALUES];
    float values[CLASSES][WIDEST * COUNT], d[CLASSES][WIDEST * COUNT];
    const char *path = in_folder("a.ply");
    write_text(path, of_a_file);
    gbt_model *file, *arrays;
    assert_ok(gbt_model_open(path, &file, NULL));
    assert_int_equal(gbt_model_get_info(file).gaussians, COUNT);
    assert_ok(gbt_model_get_gaussians(file, NULL, NULL, NULL, NULL, NULL, NULL));
    assert_ok(gbt_model_get_gaussians(file, values[0], values[1], values[2], values[3], values[4], NULL));
    for (int c = 0; c < CLASSES; c++)
        for (int i = 0; i < widths[c] * COUNT; i++)
            assert_true(fabsf(values[c][i] - wanted[c][i]) < 1e-6f);
    const gbt_gaussians g = {COUNT, 0, values[0], values[1], values[2], values[3], values[4]};
    const gbt_model_settings settings = gbt_model_get_settings(file);
    assert_true(settings.t_near == 2);
    assert_ok(gbt_model_from_gaussians(&g, &arrays, NULL));
    assert_ok(gbt_model_set_settings(arrays, &settings, NULL));
    assert_ok(gbt_model_render(file, &camera, 1, &(gbt_picture){.rgb = of_file}, NULL));
    assert_ok(gbt_model_render(arrays, &camera, 0, &(gbt_picture){.rgb = of_arrays}, NULL));
    assert_memory_equal(of_file, of_arrays, sizeof of_file);
    for (int i = 0; i < VALUES; i++)
        d_rgb[i] = (float)(i % 7);
    assert_ok(
        gbt_model_gradient(file, d_rgb, NULL, &(gbt_gaussians_gradient){d[0], d[1], d[2], d[3], d[4]}, NULL));
    for (int c = 0; c < CLASSES; c++) {
        double largest = 0;
        for (int k = 0; k < widths[c]; k++)
            largest = fmax(largest, fabs((double)d[c][k]));
        assert_true(largest > 1);
        for (int k = 0; k < widths[c]; k++) {
            const float before = values[c][k], step = 0.01f;
            double sum[2] = {0, 0};
            for (int side = 0; side < 2; side++) {
                values[c][k] = side == 0 ? before + step : before - step;
                assert_ok(gbt_model_set_gaussians(arrays, &g, NULL));
                assert_ok(gbt_model_render(arrays, &camera, 0, &(gbt_picture){.rgb = of_arrays}, NULL));
                for (int i = 0; i < VALUES; i++)
                    sum[side] += (double)d_rgb[i] * (double)of_arrays[i];
            }
            values[c][k] = before;
            const double slope = (sum[0] - sum[1]) / (2 * (double)step);
            if (!(fabs(slope - (double)d[c][k]) < 0.01 * largest))
                fail_msg("array %d, value %d: %g, by differences %g", c, k, (double)d[c][k], slope);
        }
    }
    gbt_model_close(file);
    gbt_model_close(arrays);
}

/* Of a result folder: its cameras.json, and a data set whose photos are divided as cfg_args says. Which were
   open before does not matter. */
static void views_do_not_depend_on_those_before(void **state)
{
    (void)state;
    const char *data = in_folder("data");
    make_data(data, 32, 4);
    write_text(in_folder("cfg_args"),
               "Namespace(source_path='/nowhere', resolution=2, white_background=True)");
    write_text(in_folder("cameras.json"),
               "[{\"id\": 0, \"img_name\": \"0\", \"width\": 40, \"height\": 30, \"fx\": 30, \"fy\": 30,"
               " \"position\": [0, 0, 0], \"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]");
    write_text(in_folder("point_cloud/iteration_7/point_cloud.ply"), of_a_file);
    gbt_model *model;
    assert_ok(gbt_model_open(test_folder, &model, NULL));
    const gbt_model_settings settings = gbt_model_get_settings(model);
    assert_true(settings.background[1] == 1);
    const char *const from[] = {data, NULL, data};
    const int widths[] = {16, 40, 16};
    for (int i = 0; i < 3; i++) {
        size_t count;
        gbt_model_view view;
        assert_ok(gbt_model_open_views(model, from[i], &count, NULL));
        assert_ok(gbt_model_get_view(model, 0, &view, NULL));
        assert_int_equal(view.camera.width, widths[i]);
    }
    gbt_model_close(model);
}

/* The first photo of a COLMAP model is taken from a third of its distance to the world's origin. */
static void bring_nearer(const char *data)
{
    enum { AT = 8 + 4 + 4 * 8 }; /* behind the count, its number and its rotation */
    char path[128];
    double translation[3];
    snprintf(path, sizeof path, "%s/sparse/0/images.bin", data);
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    assert_int_equal(fseek(file, AT, SEEK_SET), 0);
    assert_int_equal(fread(translation, sizeof translation, 1, file), 1);
    for (int k = 0; k < 3; k++)
        translation[k] /= 3;
    assert_int_equal(fseek(file, AT, SEEK_SET), 0);
    assert_int_equal(fwrite(translation, sizeof translation, 1, file), 1);
    assert_int_equal(fclose(file), 0);
}

/* A photo from nearby has a near distance of its own, and with it the picture that gbt_render() makes. */
static void a_close_up_looks_as_in_training(void **state)
{
    (void)state;
    const char *data = in_folder("data"), *run = in_folder("run"), *out = in_folder("out");
    make_data(data, 48, 24);
    bring_nearer(data);
    gbt_train_def def = gbt_train_def_default();
    def.iterations = 20;
    assert_ok(gbt_train(data, run, &def, NULL));
    gbt_render_def render = gbt_render_def_default();
    render.split = GBT_SPLIT_ALL;
    assert_ok(gbt_render(run, out, &render, NULL));
    gbt_model *model;
    gbt_model_view near, other, again;
    size_t count;
    assert_ok(gbt_model_open(run, &model, NULL));
    assert_ok(gbt_model_open_views(model, NULL, &count, NULL));
    assert_ok(gbt_model_get_view(model, 0, &near, NULL));
    assert_ok(gbt_model_get_view(model, 1, &other, NULL));
    gbt_model_settings settings = gbt_model_get_settings(model);
    assert_true(near.t_near > 0 && near.t_near < 0.8f * other.t_near && near.t_near < settings.t_near);
    settings.t_near = near.t_near;
    assert_ok(gbt_model_set_settings(model, &settings, NULL));
    assert_ok(gbt_model_get_view(model, 1, &again, NULL));
    assert_true(again.t_near == other.t_near);
    const size_t values = 3 * (size_t)near.camera.width * (size_t)near.camera.height;
    float *rgb = malloc(values * sizeof *rgb);
    image png;
    assert_ok(gbt_model_render(model, &near.camera, 0, &(gbt_picture){.rgb = rgb}, NULL));
    assert_ok(image_read(in_folder("out/%s", near.name), &png, NULL));
    assert_int_equal(3 * (size_t)png.width * (size_t)png.height, values);
    for (size_t i = 0; i < values; i++)
        assert_true(fabsf(fminf(fmaxf(rgb[i], 0), 1) - png.pixels[i]) < 1.0f / 255);
    image_free(&png);
    free(rgb);
    gbt_error err = {0};
    assert_refused(gbt_model_get_gaussians(model, NULL, NULL, NULL, NULL, NULL, &err), &err, GBT_ERR_ARGUMENT,
                   "networks");
    gbt_model_close(model);
}

static void settings_are_checked(void **state)
{
    (void)state;
    gbt_model *model = made();
    const gbt_model_settings fine = gbt_model_get_settings(model);
    assert_true(fine.footprint == 0.1f && fine.alpha_max == 0.99f && fine.background[1] == 0);
    gbt_model_settings rows[10];
    for (int i = 0; i < 10; i++)
        rows[i] = fine;
    rows[0].background[2] = NAN;
    rows[1].footprint = 5;
    rows[2].t_near = -1;
    rows[3].alpha_min = 0;
    rows[4].alpha_max = 1;
    rows[5].transmittance_min = NAN;
    rows[6].footprint = NAN;
    rows[7].t_near = INFINITY;
    rows[8].alpha_max = 0.99f * fine.alpha_min;
    rows[9].alpha_min = 0.9e-30f;
    for (int i = 0; i < 10; i++) {
        gbt_error err = {0};
        assert_refused(gbt_model_set_settings(model, &rows[i], &err), &err, GBT_ERR_ARGUMENT, "settings:");
        const gbt_model_settings now = gbt_model_get_settings(model);
        assert_memory_equal(&now, &fine, sizeof now);
    }
    gbt_model_close(model);
}

/* Into the middle of larger arrays: all of the picture is written, and nothing beside it. */
static void pictures_go_where_they_should(void **state)
{
    (void)state;
    enum { MARGIN = 5, PIXELS = W * H };
    static float rgb[3 * PIXELS + 2 * MARGIN], depth[PIXELS + 2 * MARGIN], clear[PIXELS + 2 * MARGIN];
    for (int keep = 0; keep < 2; keep++) {
        gbt_model *model = made();
        gbt_model_settings settings = gbt_model_get_settings(model);
        settings.background[0] = 0.5f;
        settings.footprint = 0;
        assert_ok(gbt_model_set_settings(model, &settings, NULL));
        for (int i = 0; i < 3 * PIXELS + 2 * MARGIN; i++)
            rgb[i] = -7;
        for (int i = 0; i < PIXELS + 2 * MARGIN; i++)
            depth[i] = clear[i] = -7;
        assert_ok(gbt_model_render(model, &camera, keep,
                                   &(gbt_picture){rgb + MARGIN, depth + MARGIN, clear + MARGIN}, NULL));
        for (int i = 0; i < 3 * PIXELS + 2 * MARGIN; i++)
            assert_true((rgb[i] == -7) == (i < MARGIN || i >= 3 * PIXELS + MARGIN));
        for (int i = 0; i < PIXELS + 2 * MARGIN; i++) {
            assert_true((depth[i] == -7) == (i < MARGIN || i >= PIXELS + MARGIN));
            assert_true((clear[i] == -7) == (i < MARGIN || i >= PIXELS + MARGIN));
        }
        const int middle =
            MARGIN + PIXELS / 2; /* looks through the centre of the ball, which is white and cut at 0.99 */
        assert_true(fabsf(depth[middle] - 5) < 1e-4f && fabsf(clear[middle] - 0.01f) < 1e-5f);
        assert_true(fabsf(rgb[MARGIN + 3 * (PIXELS / 2)] - 0.995f) < 1e-4f &&
                    fabsf(rgb[MARGIN + 3 * (PIXELS / 2) + 1] - 0.99f) < 1e-4f);
        assert_true(rgb[MARGIN] == 0.5f && depth[MARGIN] == 0 && clear[MARGIN] == 1); /* a corner sees nothing
                                                                                       */
        gbt_model_close(model);
    }
}

/* The others are where they were, although floats around the middle of all are 32 apart. */
static void one_far_from_the_others(void **state)
{
    (void)state;
    enum { ALL = 8 };
    static float means[3 * ALL], scales[3 * ALL], quats[4 * ALL], opacities[ALL], colors[3 * ALL],
        rgb[3 * W * H], depth[W * H];
    for (size_t i = 0; i < ALL; i++) {
        means[3 * i + 2] = i == 5 ? 1e9f : 5;
        quats[4 * i] = 1;
        opacities[i] = 0.9f;
        for (size_t k = 0; k < 3; k++)
            scales[3 * i + k] = -1;
    }
    const gbt_gaussians g = {
        .count = ALL, .mean = means, .scale_log = scales, .quat = quats, .opacity = opacities, .sh = colors};
    gbt_model *model;
    assert_ok(gbt_model_from_gaussians(&g, &model, NULL));
    assert_ok(gbt_model_render(model, &camera, 0, &(gbt_picture){.rgb = rgb, .depth = depth}, NULL));
    assert_true(fabsf(depth[W * H / 2] - 5) < 1e-4f);
    gbt_model_close(model);
}

static void what_is_not_rendered(void **state)
{
    (void)state;
    static float rgb[3 * W * H], d_rgb[3 * W * H];
    double pose[6];
    gbt_model *model = made();
    const gbt_picture picture = {.rgb = rgb};
    gbt_camera bad = camera, twice_as_large = camera;
    bad.params[0] = 0;
    for (int k = 0; k < 9; k++)
        twice_as_large.rotation[k] *= 2;
    gbt_error no_rgb = {0}, no_camera = {0}, no_rotation = {0}, not_kept = {0}, twice = {0}, nan = {0},
              large = {0}, changed = {0};
    assert_refused(gbt_model_render(model, &camera, 0, &(gbt_picture){0}, &no_rgb), &no_rgb, GBT_ERR_ARGUMENT,
                   "rgb is NULL");
    assert_refused(gbt_model_render(model, &bad, 1, &picture, &no_camera), &no_camera, GBT_ERR_ARGUMENT,
                   "camera");
    assert_refused(gbt_model_render(model, &twice_as_large, 1, &picture, &no_rotation), &no_rotation,
                   GBT_ERR_ARGUMENT, "rotation");
    assert_refused(gbt_model_gradient(model, d_rgb, pose, NULL, &not_kept), &not_kept, GBT_ERR_ARGUMENT,
                   "keep");
    assert_ok(gbt_model_render(model, &camera, 1, &picture, NULL));
    d_rgb[4] = NAN;
    assert_refused(gbt_model_gradient(model, d_rgb, pose, NULL, &nan), &nan, GBT_ERR_ARGUMENT, "value 4");
    for (int i = 0; i < 3 * W * H; i++)
        d_rgb[i] = 3e38f;
    float d_mean[3 * COUNT] = {7};
    assert_refused(gbt_model_gradient(model, d_rgb, pose, NULL, &large), &large, GBT_ERR_ARGUMENT, "range");
    assert_ok(gbt_model_render(model, &camera, 1, &picture, NULL));
    large = (gbt_error){0};
    assert_refused(gbt_model_gradient(model, d_rgb, NULL, &(gbt_gaussians_gradient){.mean = d_mean}, &large),
                   &large, GBT_ERR_ARGUMENT, "range");
    assert_true(d_mean[0] == 7);
    for (int i = 0; i < 3 * W * H; i++)
        d_rgb[i] = i == 4;
    assert_ok(gbt_model_render(model, &camera, 1, &picture, NULL));
    assert_ok(gbt_model_gradient(model, d_rgb, pose, NULL, NULL));
    assert_refused(gbt_model_gradient(model, d_rgb, pose, NULL, &twice), &twice, GBT_ERR_ARGUMENT, "keep");
    assert_ok(gbt_model_render(model, &camera, 1, &picture, NULL));
    const gbt_gaussians g = two();
    assert_ok(gbt_model_set_gaussians(model, &g, NULL));
    assert_refused(gbt_model_gradient(model, d_rgb, pose, NULL, &changed), &changed, GBT_ERR_ARGUMENT,
                   "keep");
    gbt_model_close(model);
}

/* The gradient moves the ball towards a pixel that wants more of it, and the camera the other way. */
static void gradients_point_the_right_way(void **state)
{
    (void)state;
    static float rgb[3 * W * H], d_rgb[3 * W * H];
    float d_mean[3 * COUNT], d_opacity[COUNT];
    double pose[6];
    gbt_model *model = made();
    assert_ok(gbt_model_render(model, &camera, 1, &(gbt_picture){.rgb = rgb}, NULL));
    d_rgb[3 * (3 * W + 5)] = -1; /* right of the middle wants to be brighter */
    assert_ok(gbt_model_gradient(model, d_rgb, pose,
                                 &(gbt_gaussians_gradient){.mean = d_mean, .opacity = d_opacity}, NULL));
    assert_true(d_mean[0] < -0.1f && pose[0] > 0.1 && pose[4] > 0.1); /* a step to the left, or a turn to the
                                                                         left, brings the ball to the right */
    assert_true(fabs(pose[0] + (double)d_mean[0]) < 1e-4);
    assert_true(d_opacity[0] < 0 && d_opacity[1] == 0 && d_mean[3] == 0 && d_mean[5] == 0);
    gbt_model_close(model);
}

/* Of a needle: what is thinner than a 10,000th of the largest scale is drawn as that, and follows it. */
static void raised_scales_follow_the_largest(void **state)
{
    (void)state;
    static float rgb[3 * W * H], d_rgb[3 * W * H];
    const float step = 0.01f, start[3] = {2.5f, -15, -1};
    float values[3], d_scale[3];
    gbt_gaussians g = two();
    g.count = 1;
    g.scale_log = values;
    for (int i = 0; i < 3 * W * H; i++)
        d_rgb[i] = 1;
    gbt_model *model;
    memcpy(values, start, sizeof start);
    assert_ok(gbt_model_from_gaussians(&g, &model, NULL));
    assert_ok(gbt_model_render(model, &camera, 1, &(gbt_picture){.rgb = rgb}, NULL));
    assert_ok(gbt_model_gradient(model, d_rgb, NULL, &(gbt_gaussians_gradient){.scale_log = d_scale}, NULL));
    for (int k = 0; k < 3; k++) {
        double sum[2] = {0, 0};
        for (int side = 0; side < 2; side++) {
            memcpy(values, start, sizeof start);
            values[k] += side == 0 ? step : -step;
            assert_ok(gbt_model_set_gaussians(model, &g, NULL));
            assert_ok(gbt_model_render(model, &camera, 0, &(gbt_picture){.rgb = rgb}, NULL));
            for (int i = 0; i < 3 * W * H; i++)
                sum[side] += (double)rgb[i];
        }
        const double slope = (sum[0] - sum[1]) / (2 * (double)step);
        if (!(fabs(slope - (double)d_scale[k]) < 0.02 * fabs((double)d_scale[0]) &&
              fabs((double)d_scale[0]) > 1e-4))
            fail_msg("scale %d: %g, by differences %g", k, (double)d_scale[k], slope);
    }
    gbt_model_close(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_cannot_be_opened, folder_make, folder_remove),
        cmocka_unit_test(gaussians_that_are_refused),
        cmocka_unit_test(what_can_be_asked),
        cmocka_unit_test_setup_teardown(views_stay_with_other_gaussians, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(gaussians_of_a_file, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(views_do_not_depend_on_those_before, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(a_close_up_looks_as_in_training, folder_make, folder_remove),
        cmocka_unit_test(settings_are_checked),
        cmocka_unit_test(pictures_go_where_they_should),
        cmocka_unit_test(one_far_from_the_others),
        cmocka_unit_test(what_is_not_rendered),
        cmocka_unit_test(gradients_point_the_right_way),
        cmocka_unit_test(raised_scales_follow_the_largest)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
