/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/test_plain.c -- spherical harmonics, plain Gaussians as cameras see them, the adjoint of their
   colours and shapes. */
#include "anchor/fixture.h"
#include "base/near.h"
#include "base/vec.h"
#include "frame/frame.h"
#include "frame/ring.h"
#include "base/sh.h"

/* ---- spherical harmonics ---- */

static void basis_is_orthonormal(void **state)
{
    (void)state;
    enum { N = 20000 };
    double product[16][16] = {{0}};
    for (int i = 0; i < N; i++) {
        const double z = 1 - (2 * i + 1.0) / N, r = sqrt(1 - z * z), turn = i * 2.399963229728653;
        float y[16];
        sh_basis((const float[3]){(float)(r * cos(turn)), (float)(r * sin(turn)), (float)z}, y);
        for (int k = 0; k < 16; k++)
            for (int l = 0; l < 16; l++)
                product[k][l] += 4 * 3.14159265358979 / N * (double)y[k] * (double)y[l];
    }
    for (int k = 0; k < 16; k++)
        for (int l = 0; l < 16; l++)
            assert_near(product[k][l], k == l, 1e-4);
}

/* Differences over four points along a line are exact for polynomials of the third degree. */
static void basis_gradient_is_the_derivative(void **state)
{
    (void)state;
    const float step = 0.25f;
    for (uint64_t i = 0; i < 100; i++) {
        double d[3], u[3], t[3];
        for (uint64_t k = 0; k < 3; k++) {
            d[k] = rng_normal(2, 1 + k, i);
            u[k] = rng_normal(2, 4 + k, i);
        }
        dvec_normalize(d);
        dvec_cross(d, u, t);
        dvec_normalize(t);
        float y[4][GAUSSIAN_SH_COUNT], gradient[GAUSSIAN_SH_COUNT][3];
        for (int p = 0; p < 4; p++) {
            const double at = (double)step * (p < 2 ? p - 2 : p - 1);
            sh_basis((const float[3]){(float)(d[0] + at * t[0]), (float)(d[1] + at * t[1]),
                                      (float)(d[2] + at * t[2])},
                     y[p]);
        }
        sh_basis_gradient((const float[3]){(float)d[0], (float)d[1], (float)d[2]}, gradient);
        for (int k = 0; k < GAUSSIAN_SH_COUNT; k++) {
            double along = 0;
            for (int c = 0; c < 3; c++)
                along += (double)gradient[k][c] * t[c];
            assert_near((8 * ((double)y[2][k] - (double)y[1][k]) - ((double)y[3][k] - (double)y[0][k])) /
                            (12 * (double)step),
                        along, 1e-5);
        }
    }
}

/* Half a turn about z, which .glb files need: every second function changes its sign. */
static void half_a_turn(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < 100; i++) {
        double d[3] = {rng_normal(1, 1, i), rng_normal(1, 2, i), rng_normal(1, 3, i)};
        dvec_normalize(d);
        float y[16], turned[16];
        sh_basis((const float[3]){(float)d[0], (float)d[1], (float)d[2]}, y);
        sh_basis((const float[3]){(float)-d[0], (float)-d[1], (float)d[2]}, turned);
        for (int k = 0; k < 16; k++)
            assert_near((double)turned[k], k % 2 == 0 ? (double)y[k] : -(double)y[k], 2e-6);
    }
}

/* ---- pictures ---- */

static void random_cloud(gaussian_cloud *c, size_t count)
{
    assert_ok(gaussian_cloud_alloc(c, count, NULL));
    c->sh_degree = 3;
    for (size_t i = 0; i < count; i++) {
        double q[4], length = 0;
        for (uint64_t k = 0; k < 4; k++) {
            q[k] = rng_normal(3, 1, 4 * i + k);
            length += q[k] * q[k];
        }
        for (size_t k = 0; k < 4; k++)
            c->quat[4 * i + k] = (float)(q[k] / sqrt(length));
        for (size_t k = 0; k < 3; k++) {
            c->mean[3 * i + k] = spread(3, 2, 3 * i + k, -1.5f, 1.5f);
            c->scale_log[3 * i + k] = spread(3, 3, 3 * i + k, -2.5f, -0.7f);
        }
        c->opacity[i] = spread(3, 4, i, 0.1f, 0.9f);
        for (size_t k = 0; k < 48; k++)
            c->sh[48 * i + k] = spread(3, 5, 48 * i + k, -0.8f, 0.8f);
    }
}

static gbt_status trace_all(void *context, trace_scene *scene, const ray_image *rays, image *rgb,
                            gbt_error *err)
{
    (void)context;
    return trace_forward(scene, rays, false, &(trace_outputs){.rgb = rgb}, NULL, err);
}

/* What is left out is not seen: a frame of the visible Gaussians against a trace of all, cameras of every
   kind in the middle and around. */
static void nothing_visible_is_left_out(void **state)
{
    (void)state;
    enum { COUNT = 3000 };
    const gbt_camera_model models[] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_ORTHOGRAPHIC,
                                       GBT_CAMERA_EQUIRECTANGULAR};
    gaussian_cloud cloud;
    random_cloud(&cloud, COUNT);
    size_t left_out = 0;
    for (int i = 0; i < 9; i++) {
        gbt_camera camera = ring_camera(i);
        camera.model = models[i % 3];
        for (int k = 0; k < 3; k++)
            camera.center[k] *= i / 3 * 0.4; /* inside, at the edge, outside */
        if (camera.model == GBT_CAMERA_EQUIRECTANGULAR) {
            camera.params[0] = W;
            camera.params[1] = H;
        }
        const trace_settings settings = trace_settings_default();
        frame f = {.draw.footprint = 0.3f};
        assert_ok(frame_render(&f, frame_plain(&cloud), &camera, &settings, true, NULL));
        left_out += COUNT - f.visible_count;
        assert_ok(frame_blend_weights(&f, NULL));
        double weight = 0;
        for (size_t k = 0; k < f.visible_count; k++)
            weight += (double)f.blend_weight[k];
        assert_true(weight > 0);

        frame all = {.draw.footprint = 0.3f};
        const ray_shot shot = ray_shot_of(&camera);
        frame_tracer tracer = {.trace = trace_all};
        assert_ok(frame_render_with(&all, frame_plain(&cloud), &shot, &settings, &tracer, NULL));
        assert_int_equal(all.visible_count, COUNT);
        for (size_t k = 0; k < 3 * W * H; k++)
            assert_near((double)f.rgb.pixels[k], (double)all.rgb.pixels[k], 1e-5); /* another tree adds in
                                                                                      another order */
        frame_free(&f);
        frame_free(&all);
    }
    if (left_out <= COUNT / 2)
        fail_msg("only %zu left out", left_out);
    gaussian_cloud_free(&cloud);
}

/* ---- adjoint ---- */

/* The tracer's adjoint has its own tests: here it is taken as it is, and the way from the cloud's parameters
   to its fields is differentiated in double. */
static void adjoint_of_colors_and_shapes(void **state)
{
    (void)state;
    enum { COUNT = 60 };
    gaussian_cloud cloud, d;
    random_cloud(&cloud, COUNT);
    assert_ok(gaussian_cloud_alloc(&d, COUNT, NULL));
    for (int wide = 0; wide < 2; wide++) {
        const trace_settings settings = trace_settings_default();
        const gbt_camera camera = ring_camera(1);
        frame f = {.draw.footprint = wide ? 0.3f : 0};
        assert_ok(frame_render(&f, frame_plain(&cloud), &camera, &settings, true, NULL));
        image d_image;
        assert_ok(image_alloc(&d_image, W, H, 3, NULL));
        for (size_t i = 0; i < 3 * W * H; i++)
            d_image.pixels[i] = spread(4, 1, i, -1, 1);
        assert_ok(frame_backward_plain(&f, &cloud, &d_image, &d, NULL));
        size_t cut = 0, seen = 0;
        assert_int_equal(f.visible_count, COUNT); /* so Gaussian i is i in all arrays */
        for (size_t i = 0; i < COUNT; i++) {
            double direction[3];
            for (size_t k = 0; k < 3; k++)
                direction[k] = (double)cloud.mean[3 * i + k] - camera.center[k];
            dvec_normalize(direction);
            float y[16];
            sh_basis((const float[3]){(float)direction[0], (float)direction[1], (float)direction[2]}, y);
            const float *const field[3] = {f.gaussians.red, f.gaussians.green, f.gaussians.blue},
                               *const d_field[3] = {f.d_gaussians.red, f.d_gaussians.green,
                                                    f.d_gaussians.blue};
            const float *const d_scale[3] = {f.d_gaussians.scale_x, f.d_gaussians.scale_y,
                                             f.d_gaussians.scale_z};
            seen += f.blend_weight[i] > 0;
            for (size_t c = 0; c < 3; c++) {
                double color = 0.5;
                for (size_t k = 0; k < 16; k++)
                    color += (double)y[k] * (double)cloud.sh[48 * i + 3 * k + c];
                assert_near((double)field[c][i], fmax(color, 0), 1e-6);
                cut += color < 0;
                for (size_t k = 0; k < 16; k++)
                    assert_near((double)d.sh[48 * i + 3 * k + c],
                                color > 0 ? (double)y[k] * (double)d_field[c][i] : 0,
                                1e-5 * (1 + fabs((double)d_field[c][i])));
                const double scale = exp((double)cloud.scale_log[3 * i + c]);
                assert_near((double)d.scale_log[3 * i + c], scale * (double)d_scale[c][i],
                            1e-5 * (1 + fabs((double)d_scale[c][i])));
            }
            assert_near((double)d.opacity[i], (double)f.d_gaussians.opacity[i], 0);
        }
        assert_true(cut > 5 && seen > COUNT / 2);
        image_free(&d_image);
        frame_free(&f);
    }
    gaussian_cloud_free(&cloud);
    gaussian_cloud_free(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(basis_is_orthonormal),
        cmocka_unit_test(basis_gradient_is_the_derivative),
        cmocka_unit_test(half_a_turn),
        cmocka_unit_test(nothing_visible_is_left_out),
        cmocka_unit_test(adjoint_of_colors_and_shapes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
