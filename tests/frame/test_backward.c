/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/test_backward.c -- gradients of a view by what is not its Gaussians, against differences: the
   camera's pose, by rays and by splats, and the sky. */
#include "base/near.h"
#include "frame/frame.h"
#include "frame/ring.h"
#include "test_support.h"

enum { ACROSS = 4, DOWN = 3, COUNT = ACROSS * DOWN, VALUES = 3 * W * H };

/* Apart from each other in the picture: where Gaussians change places in depth a picture jumps, and no
   adjoint knows of that. */
static void make_cloud(const gbt_camera *camera, gaussian_cloud *c)
{
    assert_ok(gaussian_cloud_alloc(c, COUNT, NULL));
    c->sh_degree = 0;
    for (size_t i = 0; i < COUNT; i++) {
        const double x = ((double)(i % ACROSS) - 1.5) * 1.4 + 0.03,
                     y = ((double)(i / ACROSS) - 1) * 1.4 + 0.05, turn = 0.7 * (double)i;
        for (size_t k = 0; k < 3; k++) {
            c->mean[3 * i + k] = (float)(x * camera->rotation[k] + y * camera->rotation[3 + k] +
                                         0.3 * sin((double)i) * camera->rotation[6 + k]);
            c->scale_log[3 * i + k] = logf(0.07f + 0.05f * (float)((i + k) % 3));
            c->sh[48 * i + k] = cosf((float)(i + 5 * k));
        }
        c->quat[4 * i] = (float)cos(turn);
        c->quat[4 * i + 1] = (float)(sin(turn) * 0.6);
        c->quat[4 * i + 2] = (float)(sin(turn) * 0.8);
        c->quat[4 * i + 3] = 0;
        c->opacity[i] = 0.5f;
    }
}

/* Nothing that jumps when things move a little. */
static trace_settings smooth_settings(const gbt_camera *camera)
{
    trace_settings s = trace_settings_default();
    s.alpha_min = 1e-6f;
    s.transmittance_min = 1e-7f;
    s.sky = (sky){.varies = true, .has_horizon = true, .ground = {0.2f, 0.4f, 0.6f}};
    for (size_t k = 0; k < 3; k++) /* the horizon crosses the picture */
        s.sky.up[k] = (float)-camera->rotation[3 + k];
    for (int k = 0; k < 3 * SH_COUNT; k++)
        if (k < 3)
            s.background[k] = 0.5f;
        else
            s.sky.harmonic[k / 3 - 1][k % 3] = 0.02f * cosf(1.3f * (float)k);
    return s;
}

static double weight(size_t i) { return cos(0.3 * (double)(i / 3 % W)) + 0.1 * (double)(i % 3); }

static double loss_of(frame *f, const gaussian_cloud *cloud, const gbt_camera *camera,
                      const trace_settings *s)
{
    double loss = 0;
    assert_ok(frame_render(f, frame_plain(cloud), camera, s, true, NULL));
    for (size_t i = 0; i < VALUES; i++)
        loss += weight(i) * (double)f->rgb.pixels[i];
    return loss;
}

/* All gradients of the last loss_of(). */
static void backward(frame *f, const gaussian_cloud *cloud, const sky *behind, double pose[6],
                     double d_sky[SH_COUNT][3])
{
    image d_image;
    assert_ok(image_alloc(&d_image, W, H, 3, NULL));
    for (size_t i = 0; i < VALUES; i++)
        d_image.pixels[i] = (float)weight(i);
    assert_ok(frame_backward_sky(f, behind, &d_image, d_sky, NULL));
    assert_ok(frame_backward_gaussians(f, &d_image, NULL));
    assert_ok(frame_backward_pose(f, frame_plain(cloud), pose, NULL));
    image_free(&d_image);
}

static void gradients_agree_with_differences(void **state)
{
    (void)state;
    gaussian_cloud cloud;
    const gbt_camera camera = ring_camera(2);
    make_cloud(&camera, &cloud);
    static const gbt_renderer renderers[] = {GBT_RENDERER_TRACE, GBT_RENDERER_RASTER};
    for (int r = 0; r < 2; r++) {
        frame f = {.draw = {.renderer = renderers[r], .footprint = 0.1f}};
        trace_settings s = smooth_settings(&camera), one_color = s;
        one_color.sky.varies = false; /* the pose's gradient leaves out that the sky turns */
        double pose[6], unused[6], d_sky[SH_COUNT][3], off = 0, all = 0, off_sky = 0, all_sky = 0;
        loss_of(&f, &cloud, &camera, &s);
        backward(&f, &cloud, &s.sky, unused, d_sky);
        for (int k = 0; k < 3 * SH_COUNT; k++) {
            const float h = 0.01f; /* the loss is linear in them */
            float *value = k < 3 ? &s.background[k] : &s.sky.harmonic[k / 3 - 1][k % 3], keep = *value;
            *value = keep + h;
            const double high = loss_of(&f, &cloud, &camera, &s);
            *value = keep - h;
            const double wanted = (high - loss_of(&f, &cloud, &camera, &s)) / (2 * (double)h);
            *value = keep;
            off_sky += pow(d_sky[k / 3][k % 3] - wanted, 2);
            all_sky += wanted * wanted;
        }
        loss_of(&f, &cloud, &camera, &one_color);
        backward(&f, &cloud, &s.sky, pose, d_sky); /* of the same transmittances */
        for (int k = 0; k < 6; k++) {
            double motion[6] = {0}, loss[2];
            for (int side = 0; side < 2; side++) {
                motion[k] = side == 0 ? -2e-3 : 2e-3;
                const gbt_camera there = gbt_camera_moved(&camera, motion);
                loss[side] = loss_of(&f, &cloud, &there, &one_color);
            }
            const double wanted = (loss[1] - loss[0]) / 4e-3;
            off += pow(pose[k] - wanted, 2);
            all += wanted * wanted;
        }
        print_message("%s: pose off by %.1e of %.3g, sky by %.1e of %.3g\n", r == 0 ? "rays" : "splats",
                      sqrt(off / all), sqrt(all), sqrt(off_sky / all_sky), sqrt(all_sky));
        assert_true(sqrt(off / all) < 0.01 && sqrt(off_sky / all_sky) < 1e-3);
        frame_free(&f);
    }
    gaussian_cloud_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gradients_agree_with_differences),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
