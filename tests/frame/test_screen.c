/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/test_screen.c -- what touches the picture is what the rasterizer draws; and which anchors a
   view decodes by that test. */
#include "anchor/fixture.h"
#include "base/near.h"
#include "base/vec.h"
#include "frame/frame.h"

enum { W = 70, H = 43, CASES = 4000 };

static double uniform(uint64_t seed, uint64_t index, double low, double high)
{
    return low + (high - low) * (double)rng_uniform(seed, 78, index);
}

static gbt_camera random_camera(uint64_t seed)
{
    gbt_camera camera = {.model = seed % 2 == 0 ? GBT_CAMERA_PINHOLE : GBT_CAMERA_SIMPLE_PINHOLE,
                         .width = W,
                         .height = H,
                         .params = {60, seed % 2 == 0 ? 50 : 31, seed % 2 == 0 ? 31 : 20, 20}};
    double q[4], length = 0;
    for (uint64_t i = 0; i < 4; i++) {
        q[i] = rng_normal(seed, 1, i);
        length += q[i] * q[i];
    }
    for (int i = 0; i < 4; i++)
        q[i] /= sqrt(length);
    dquat_to_matrix(q, camera.rotation);
    for (int k = 0; k < 3; k++)
        camera.center[k] = (double)(float)uniform(seed, (uint64_t)k, -1, 1);
    return camera;
}

/* One Gaussian before the camera, beside it or behind it. */
static void random_gaussian(uint64_t seed, const gbt_camera *camera, gaussians *g)
{
    const double z = uniform(seed, 10, -0.5, 6),
                 local[3] = {uniform(seed, 11, -2, 2) * fabs(z), uniform(seed, 12, -2, 2) * fabs(z), z};
    double offset[3], q[4], length = 0;
    dmat_apply_transposed(camera->rotation, local, offset);
    for (uint64_t i = 0; i < 4; i++) {
        q[i] = rng_normal(seed, 2, i);
        length += q[i] * q[i];
    }
    float *const mean[3] = {g->mean_x, g->mean_y, g->mean_z},
                 *const scale[3] = {g->scale_x, g->scale_y, g->scale_z},
                 *const quat[4] = {g->quat_w, g->quat_x, g->quat_y, g->quat_z};
    for (int k = 0; k < 3; k++) {
        mean[k][0] = (float)(camera->center[k] + offset[k]);
        scale[k][0] = (float)exp(uniform(seed, 20 + (uint64_t)k, -6, 0.5));
    }
    for (int i = 0; i < 4; i++)
        quat[i][0] = (float)(q[i] / sqrt(length));
    g->opacity[0] = 0.9f;
}

static void touching_is_being_drawn(void **state)
{
    (void)state;
    gaussians g = {0};
    image rgb = {0};
    raster_scene scene = {0};
    raster_settings settings = raster_settings_default();
    settings.near = 0.2f;
    assert_ok(gaussians_resize(&g, 1, NULL));
    gaussians_pad(&g);
    assert_ok(image_alloc(&rgb, W, H, 3, NULL));
    size_t drawn = 0;
    for (uint64_t seed = 0; seed < CASES; seed++) {
        const gbt_camera camera = random_camera(seed);
        const screen_view screen = screen_of(&camera, (double)settings.near);
        random_gaussian(seed, &camera, &g);
        raster_counters counted = {0};
        assert_ok(raster_forward(&scene, &g, &camera, &settings, false, &rgb, NULL, &counted, NULL));
        const float mean[3] = {g.mean_x[0], g.mean_y[0], g.mean_z[0]},
                    quat[4] = {g.quat_w[0], g.quat_x[0], g.quat_y[0], g.quat_z[0]},
                    scale[3] = {g.scale_x[0], g.scale_y[0], g.scale_z[0]};
        if (screen_touches(&screen, mean, quat, scale) != (counted.drawn == 1))
            fail_msg("seed %llu: %s", (unsigned long long)seed,
                     counted.drawn == 1 ? "drawn, and does not touch" : "touches, and is not drawn");
        drawn += counted.drawn == 1;
    }
    assert_true(drawn > CASES / 5 && drawn < CASES - CASES / 5);
    raster_scene_free(&scene);
    image_free(&rgb);
    gaussians_free(&g);
}

/* An anchor far outside the picture with an offset that reaches into it; its own ellipsoid is small. */
static void an_anchor_outside_is_decoded_for_its_gaussians_alone(void **state)
{
    (void)state;
    anchors a = random_anchors(1, 1, 3);
    decoder d = random_decoder(1, false, 4);
    const gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                               .width = W,
                               .height = H,
                               .params = {60, 60, 0.5 * W, 0.5 * H},
                               .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    const trace_settings settings = trace_settings_default();
    const float position[3] = {-6, 0, 4}, offset[3] = {60, 0, 0};
    memcpy(a.position, position, sizeof position);
    memcpy(a.offset, offset, sizeof offset);
    for (int k = 0; k < 6; k++)
        a.scale_log[k] = logf(0.1f);
    for (int sight = FRAME_SIGHT_WHOLE; sight <= FRAME_SIGHT_BY_ANCHOR; sight++) {
        frame f = {.draw.sight = (frame_sight)sight};
        assert_ok(frame_render(&f, frame_neural(&a, &d), &camera, &settings, false, NULL));
        assert_int_equal(f.visible_count, sight == FRAME_SIGHT_WHOLE);
        frame_free(&f);
        gbt_camera fisheye = camera; /* the reference has no such camera */
        fisheye.model = GBT_CAMERA_FISHEYE;
        f = (frame){.draw.sight = (frame_sight)sight};
        assert_ok(frame_render(&f, frame_neural(&a, &d), &fisheye, &settings, false, NULL));
        assert_int_equal(f.visible_count, 1);
        frame_free(&f);
    }
    anchors_free(&a);
    decoder_free(&d);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(touching_is_being_drawn),
        cmocka_unit_test(an_anchor_outside_is_decoded_for_its_gaussians_alone),
    };
    return cmocka_run_group_tests_name("screen", tests, NULL, NULL);
}
