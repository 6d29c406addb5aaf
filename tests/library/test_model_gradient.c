/* SPDX-License-Identifier: Apache-2.0 */
/* tests/library/test_model_gradient.c -- gradients of pictures by the pose and by plain Gaussians, against
   central differences in double.

   The differences move the real camera: its rays, the eye of its colours, the footprints of its pixels, all
   in double (double_scene.h). */
#include "double_scene.h"

#include <unistd.h>

#include "base/rng.h"
#include "gbtrace/model.h"
#include "gbtrace/train.h"
#include "io/model_file.h"

enum { W = 22, H = 15, VALUES = 3 * W * H, COUNT = 70, ANCHORS = 40, OFFSETS = 2 };

static const double origin[3] = {20, -7.5, 3}; /* of a trained model: its cameras are not in local coordinates
                                                */
static const double motion_step = 1e-7;

typedef struct camera_case {
    const char *name;
    gbt_camera_model model;
    double params[8], back; /* back: distance from the middle of the scene */
    gbt_camera_shutter shutter;
} camera_case;

static const camera_case cameras[] = {
    {"PINHOLE", GBT_CAMERA_PINHOLE, {20, 21, 11, 7}, 4, GBT_CAMERA_SHUTTER_GLOBAL},
    {"PINHOLE, inside", GBT_CAMERA_PINHOLE, {14, 14, 11.5, 7}, 0.6, GBT_CAMERA_SHUTTER_GLOBAL}, /* at 0.5 a
                                                                        cut lies within the step of the
                                                                        differences */
    {"OPENCV", GBT_CAMERA_OPENCV, {18, 18, 11, 7.5, -0.12, 0.03, 0.01, -0.02}, 4, GBT_CAMERA_SHUTTER_GLOBAL},
    {"OPENCV_FISHEYE",
     GBT_CAMERA_OPENCV_FISHEYE,
     {9, 9, 11, 7.5, 0.02, -0.01, 0.003, 0},
     2,
     GBT_CAMERA_SHUTTER_GLOBAL},
    {"EQUIRECTANGULAR", GBT_CAMERA_EQUIRECTANGULAR, {W, H}, 1, GBT_CAMERA_SHUTTER_GLOBAL},
    {"ORTHOGRAPHIC", GBT_CAMERA_ORTHOGRAPHIC, {6, 6, 9, 8}, 3, GBT_CAMERA_SHUTTER_GLOBAL},
    {"PINHOLE, rolling shutter", GBT_CAMERA_PINHOLE, {20, 21, 11, 7}, 4, GBT_CAMERA_SHUTTER_ROWS},
};
enum { CAMERAS = sizeof cameras / sizeof *cameras, CASES = CAMERAS * 4 };

/* At a turned pose, looking past the middle of the scene at `at`. Coordinates are floats: the eye is rounded
   to such. */
static gbt_camera camera_of(const camera_case *c, const double at[3])
{
    gbt_camera camera = {.model = c->model,
                         .width = W,
                         .height = H,
                         .shutter = c->shutter,
                         .motion = {0.4, -0.3, 0.2, 0.1, -0.2, 0.15}};
    const double q[4] = {0.8, 0.36, -0.48, 0}; /* of length 1 */
    memcpy(camera.params, c->params, sizeof c->params);
    dquat_to_matrix(q, camera.rotation);
    for (int k = 0; k < 3; k++)
        camera.center[k] = (double)(float)(at[k] + 0.2 * (k - 1) - c->back * camera.rotation[6 + k]);
    return camera;
}

static float weights[VALUES];

static void make_weights(void)
{
    for (uint64_t i = 0; i < VALUES; i++)
        weights[i] = (float)rng_normal(7, 1, i);
}

/* ---- the two kinds of scenes ---- */

typedef struct world {
    gbt_model *model;
    double_scene exact;
    float *arrays[5]; /* of plain ones: mean, scale_log, quat, opacity, sh */
    decode_ref networks;
    uint32_t all[ANCHORS];
    float anchor_pixel[ANCHORS];
} world;

static const size_t widths[5] = {3, 3, 4, 1, 3 * GAUSSIAN_SH_COUNT}, firsts[5] = {0, 3, 6, 10, 11};
static const char *const class_names[5] = {"mean", "scale_log", "quat", "opacity", "sh"};

static gbt_gaussians gaussians_of(const world *w)
{
    return (gbt_gaussians){.count = COUNT,
                           .sh_degree = 3,
                           .mean = w->arrays[0],
                           .scale_log = w->arrays[1],
                           .quat = w->arrays[2],
                           .opacity = w->arrays[3],
                           .sh = w->arrays[4]};
}

static void set_up(world *w, double footprint)
{
    gbt_model_settings settings = gbt_model_get_settings(w->model);
    settings.footprint = (float)footprint;
    settings.alpha_min = 1e-5f;
    settings.transmittance_min = 1e-6f;
    settings.t_near = 0.05f;
    settings.background[0] = 0.3f;
    settings.background[1] = 0.1f;
    settings.background[2] = 0.9f;
    assert_ok(gbt_model_set_settings(w->model, &settings, NULL));
    trace_settings *s = &w->exact.settings;
    *s = trace_settings_default();
    s->alpha_min = settings.alpha_min;
    s->transmittance_min = settings.transmittance_min;
    s->t_near = settings.t_near;
    memcpy(s->background, settings.background, sizeof s->background);
    w->exact.footprint = (double)settings.footprint;
}

static void make_plain(world *w, double footprint)
{
    memset(w, 0, sizeof *w);
    w->exact.count = COUNT;
    w->exact.functions = GAUSSIAN_SH_COUNT;
    w->exact.plain = mem_alloc(COUNT, PLAIN_FLOATS * sizeof(double), "test", NULL);
    for (int c = 0; c < 5; c++)
        w->arrays[c] = mem_alloc(COUNT * widths[c], sizeof(float), "test", NULL);
    for (size_t i = 0; i < COUNT; i++)
        for (int c = 0; c < 5; c++)
            for (size_t k = 0; k < widths[c]; k++) {
                const double normal = rng_normal(3, firsts[c] + k, i), uniform = (double)rng_uniform(4, 3, i);
                const double value = c == 0   ? normal
                                     : c == 1 ? -1.6 + 0.5 * normal
                                     : c == 3 ? 0.15 + 0.8 * uniform
                                     : c == 4 ? 0.25 * normal
                                              : normal;
                w->arrays[c][i * widths[c] + k] = (float)value;
                w->exact.plain[i * PLAIN_FLOATS + firsts[c] + k] = (double)(float)value;
            }
    const gbt_gaussians g = gaussians_of(w);
    gbt_error err = {0};
    if (gbt_model_from_gaussians(&g, &w->model, &err) != GBT_OK)
        fail_msg("%s", err.text);
    set_up(w, footprint);
}

static void make_neural(world *w, double footprint)
{
    memset(w, 0, sizeof *w);
    model m = {
        .voxel_size = 0.1f, .extent = 2, .t_near = 0.05f, .iterations = 11, .anchor_pixel = w->anchor_pixel};
    memcpy(m.origin, origin, sizeof origin);
    m.anchors.offset_count = OFFSETS;
    assert_ok(anchors_resize(&m.anchors, ANCHORS, NULL));
    assert_ok(decoder_init(&m.decoder, OFFSETS, true, 5, NULL));
    m.decoder.distance_scale = 0.4f;
    m.decoder.distance_min = 0.2f;
    m.decoder.distance_max = 2.5f;
    for (uint64_t i = 0; i < m.decoder.param_count; i++) /* a view that matters */
        m.decoder.params[i] *= 2;
    decoder_network networks[3];
    decoder_networks(&m.decoder, networks);
    for (size_t i = 0; i < OFFSETS; i++) /* biases of the opacities */
        m.decoder.params[networks[0].end - 1 - i] = 0.6f;
    for (uint32_t i = 0; i < ANCHORS; i++) {
        w->all[i] = i;
        w->anchor_pixel[i] = i % 3 == 0 ? 0.5f : 0;
        for (uint64_t k = 0; k < 3; k++)
            m.anchors.position[3 * i + k] = (float)rng_normal(9, k, i);
        for (uint64_t k = 0; k < ANCHOR_FEATURE_DIM; k++)
            m.anchors.feature[ANCHOR_FEATURE_DIM * i + k] = (float)rng_normal(9, 10 + k, i);
        for (uint64_t k = 0; k < 3 * OFFSETS; k++)
            m.anchors.offset[3 * OFFSETS * i + k] = (float)rng_normal(9, 50 + k, i);
        for (uint64_t k = 0; k < 6; k++)
            m.anchors.scale_log[6 * i + k] = (float)(-1 + 0.3 * rng_normal(9, 90 + k, i));
    }
    char path[] = "/tmp/gbt_model_gradient_XXXXXX";
    close(mkstemp(path));
    gbt_error err = {0};
    if (model_save(path, &m, &err) != GBT_OK || gbt_model_open(path, &w->model, &err) != GBT_OK)
        fail_msg("%s", err.text);
    unlink(path);
    assert_ok(decode_ref_load(&w->networks, &m.anchors, &m.decoder, NULL));
    m.anchor_pixel = NULL;
    model_free(&m);
    for (size_t i = 0; i < 3 * ANCHORS; i++) /* differences in world coordinates */
        w->networks.position[i] += origin[i % 3];
    w->exact = (double_scene){.count = ANCHORS * OFFSETS,
                              .networks = &w->networks,
                              .anchors = w->all,
                              .anchor_pixel = w->anchor_pixel};
    set_up(w, footprint);
}

static void free_world(world *w)
{
    gbt_model_close(w->model);
    mem_free(w->exact.plain);
    for (int c = 0; c < 5; c++)
        mem_free(w->arrays[c]);
    decode_ref_free(&w->networks);
}

/* ---- pose ---- */

typedef struct pose_case {
    char name[64];
    const camera_case *camera;
    bool neural;
    double footprint;
} pose_case;

static pose_case pose_cases[CASES];

static void render_ok(world *w, const gbt_camera *camera, float rgb[VALUES])
{
    gbt_error err = {0};
    if (gbt_model_render(w->model, camera, 1, &(gbt_picture){.rgb = rgb}, &err) != GBT_OK)
        fail_msg("%s", err.text);
}

static void pose_agrees_with_differences(void **state)
{
    const pose_case *c = *state;
    static world w;
    static float rgb[VALUES];
    static double wanted_rgb[VALUES];
    (c->neural ? make_neural : make_plain)(&w, c->footprint);
    const double none[3] = {0, 0, 0};
    const gbt_camera camera = camera_of(c->camera, c->neural ? origin : none);
    double got[6], wanted[6], error = 0, size = 0, picture = 0;
    render_ok(&w, &camera, rgb);
    double_loss(&w.exact, &camera, weights, wanted_rgb);
    for (int i = 0; i < VALUES; i++)
        picture = fmax(picture, fabs((double)rgb[i] - wanted_rgb[i]));
    assert_ok(gbt_model_gradient(w.model, weights, got, NULL, NULL));
    for (int k = 0; k < 6; k++) {
        double motion[6] = {0};
        motion[k] = motion_step;
        const gbt_camera there = gbt_camera_moved(&camera, motion);
        motion[k] = -motion_step;
        const gbt_camera back = gbt_camera_moved(&camera, motion);
        wanted[k] =
            (double_loss(&w.exact, &there, weights, NULL) - double_loss(&w.exact, &back, weights, NULL)) /
            (2 * motion_step);
        error += (got[k] - wanted[k]) * (got[k] - wanted[k]);
        size += wanted[k] * wanted[k];
    }
    print_message("| %s | %.1e | %.3g | %.1e |\n", c->name, picture, sqrt(size), sqrt(error / size));
    if (!(picture < 3e-6))
        fail_msg("the pictures differ by %g", picture);
    if (!(sqrt(error / size) < 3e-5) || !(size > 1e-3))
        fail_msg("got %g %g %g  %g %g %g, wanted %g %g %g  %g %g %g", got[0], got[1], got[2], got[3], got[4],
                 got[5], wanted[0], wanted[1], wanted[2], wanted[3], wanted[4], wanted[5]);
    free_world(&w);
}

/* ---- plain Gaussians ---- */

static void gaussians_agree_with_differences(void **state)
{
    const pose_case *c = *state;
    static world w;
    static float rgb[VALUES];
    make_plain(&w, c->footprint);
    const gbt_camera camera = camera_of(c->camera, (const double[3]){0, 0, 0});
    float *got[5];
    for (int k = 0; k < 5; k++)
        got[k] = mem_alloc(COUNT * widths[k], sizeof(float), "test", NULL);
    render_ok(&w, &camera, rgb);
    const gbt_gaussians_gradient gradient = {got[0], got[1], got[2], got[3], got[4]};
    assert_ok(gbt_model_gradient(w.model, weights, NULL, &gradient, NULL));
    for (int class = 0; class < 5; class ++)
        for (uint64_t attempt = 0; attempt < 2; attempt++) {
            double along = 0, size = 0, losses[2];
            for (int side = 0; side < 2; side++) {
                const double step = (side == 0 ? 1 : -1) * motion_step;
                for (size_t i = 0; i < COUNT; i++)
                    for (size_t k = 0; k < widths[class]; k++)
                        w.exact.plain[i * PLAIN_FLOATS + firsts[class] + k] +=
                            step * rng_normal(30 + attempt, k, i);
                losses[side] = double_loss(&w.exact, &camera, weights, NULL);
                for (size_t i = 0; i < COUNT; i++)
                    for (size_t k = 0; k < widths[class]; k++)
                        w.exact.plain[i * PLAIN_FLOATS + firsts[class] + k] =
                            (double)w.arrays[class][i * widths[class] + k];
            }
            for (size_t i = 0; i < COUNT * widths[class]; i++) {
                along +=
                    (double)got[class][i] * rng_normal(30 + attempt, i % widths[class], i / widths[class]);
                size += (double)got[class][i] * (double)got[class][i];
            }
            const double wanted = (losses[0] - losses[1]) / (2 * motion_step);
            if (!(fabs(along - wanted) < 3e-5 * sqrt(size)) || !(size > 1e-6))
                fail_msg("%s along direction %d: %g, not %g (gradient of size %g)", class_names[class],
                         (int)attempt, along, wanted, sqrt(size));
        }
    for (int k = 0; k < 5; k++)
        mem_free(got[k]);
    free_world(&w);
}

/* ---- threads, memory ---- */

static void threads_do_not_matter(void **state)
{
    (void)state;
    const double none[3] = {0, 0, 0};
    for (int neural = 0; neural < 2; neural++) {
        static world w;
        static float rgb[VALUES];
        double first[6] = {0}, got[6];
        (neural ? make_neural : make_plain)(&w, 0.2);
        const gbt_camera camera = camera_of(&cameras[0], neural ? origin : none);
        for (int threads = 1; threads <= 3; threads++) {
            gbt_set_threads(threads);
            render_ok(&w, &camera, rgb);
            assert_ok(gbt_model_gradient(w.model, weights, threads == 1 ? first : got, NULL, NULL));
            assert_true(threads == 1 || memcmp(got, first, sizeof got) == 0);
        }
        free_world(&w);
    }
}

static void no_memory_is_a_status(void **state)
{
    (void)state;
    const double none[3] = {0, 0, 0};
    for (int neural = 0; neural < 2; neural++) {
        static world w;
        static float rgb[VALUES], mean[3 * COUNT];
        double got[6];
        gbt_status status = GBT_ERR_NO_MEMORY;
        long k = 0;
        for (; status != GBT_OK; k++) {
            (neural ? make_neural : make_plain)(&w, 0.2);
            const gbt_camera camera = camera_of(&cameras[0], neural ? origin : none);
            const gbt_gaussians_gradient gradient = {.mean = mean};
            mem_fail_after(k);
            gbt_error err = {0};
            status = gbt_model_render(w.model, &camera, 1, &(gbt_picture){.rgb = rgb}, &err);
            if (status == GBT_OK)
                status = gbt_model_gradient(w.model, weights, got, neural ? NULL : &gradient, &err);
            mem_fail_after(-1);
            if (status != GBT_OK && (status != GBT_ERR_NO_MEMORY || err.text[0] == '\0'))
                fail_msg("allocation %ld: status %d, \"%s\"", k, (int)status, err.text);
            free_world(&w);
        }
        assert_true(k > 10);
    }
}

int main(void)
{
    static struct CMUnitTest tests[2 * CASES + 2];
    size_t count = 0;
    make_weights();
    for (size_t i = 0; i < CASES; i++) {
        pose_case *c = &pose_cases[i];
        *c = (pose_case){.camera = &cameras[i % CAMERAS],
                         .neural = i / CAMERAS % 2 == 1,
                         .footprint = i / CAMERAS / 2 == 1 ? 0.3 : 0};
        snprintf(c->name, sizeof c->name, "%s | %s | %s", c->camera->name, c->neural ? "networks" : "plain",
                 c->footprint > 0 ? "0.3 px^2" : "thin");
        tests[count++] = (struct CMUnitTest){
            .name = c->name, .test_func = pose_agrees_with_differences, .initial_state = c};
        if (!c->neural)
            tests[count++] = (struct CMUnitTest){
                .name = c->name, .test_func = gaussians_agree_with_differences, .initial_state = c};
    }
    tests[count++] = (struct CMUnitTest)cmocka_unit_test(threads_do_not_matter);
    tests[count++] = (struct CMUnitTest)cmocka_unit_test(no_memory_is_a_status);
    print_message(
        "| camera | scene | footprint | picture differs by | size of the gradient | relative error |\n");
    return _cmocka_run_group_tests("model_gradient", tests, count, NULL, NULL);
}
