/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/test_one_start.c -- rays from one point in place of a rolling camera's: where Gaussians go, and
   how near the picture comes. */
#include "test_support.h"

#include <math.h>

#include "base/camera_lens.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"
#include "frame/frame.h"
#include "frame/one_start.h"

enum { W = 120, H = 90, COUNT = 4000 };

/* Moves by a tenth of its distance from the middle of the cloud, and turns by 0.2 radians. */
static gbt_camera rolling_camera(gbt_camera_shutter shutter)
{
    gbt_camera camera = {.model = GBT_CAMERA_OPENCV,
                         .width = W,
                         .height = H,
                         .params = {100, 100, 0.5 * W, 0.5 * H, -0.05, 0.01, 0.001, -0.001},
                         .shutter = shutter,
                         .motion = {0.3, -0.2, 0.25, 0.1, 0.15, -0.1}};
    const double q[4] = {0.8, 0.36, -0.48, 0};
    dquat_to_matrix(q, camera.rotation);
    for (int k = 0; k < 3; k++)
        camera.center[k] = (double)(float)(-4.5 * camera.rotation[6 + k]);
    return camera;
}

/* Small Gaussians all over the view, in front of the camera and some behind. */
static void fill(gaussian_cloud *c)
{
    assert_ok(gaussian_cloud_alloc(c, COUNT, NULL));
    c->sh_degree = 0;
    for (size_t i = 0; i < COUNT; i++) {
        for (size_t k = 0; k < 3; k++) {
            c->mean[3 * i + k] = 4 * rng_uniform(5, k, i) - 2;
            c->scale_log[3 * i + k] = -3.5f + 0.5f * rng_uniform(5, 3 + k, i);
            c->sh[48 * i + k] = 2 * rng_uniform(5, 6 + k, i) - 1;
        }
        c->quat[4 * i] = 1;
        c->opacity[i] = 0.9f * rng_uniform(5, 9, i);
    }
}

/* From the camera's own centre a moved mean lies on the direction of the ray that meets the mean, to what the
   camera moves in a line; what it does not see stays. */
static void means_move_with_their_lines(void **state)
{
    (void)state;
    for (gbt_camera_shutter s = GBT_CAMERA_SHUTTER_ROWS; s <= GBT_CAMERA_SHUTTER_COLUMNS; s++) {
        const gbt_camera camera = rolling_camera(s);
        const int lines = s == GBT_CAMERA_SHUTTER_ROWS ? H : W;
        const double in_a_line = dvec_length(camera.motion) / lines;
        camera_lens lens;
        gaussians g = {0};
        assert_true(camera_lens_prepare(&camera, &lens));
        assert_ok(gaussians_resize(&g, COUNT, NULL));
        float *const mean[3] = {g.mean_x, g.mean_y, g.mean_z};
        for (size_t i = 0; i < COUNT; i++)
            for (uint64_t k = 0; k < 3; k++)
                mean[k][i] = 12 * rng_uniform(6, k, i) - 6;
        double worst = 0;
        size_t inside = 0, behind = 0;
        for (int threads = 1; threads <= 3; threads++) {
            gaussians moved = {0};
            parallel_set_threads(threads);
            assert_ok(gaussians_resize(&moved, COUNT, NULL));
            float *const to[3] = {moved.mean_x, moved.mean_y, moved.mean_z};
            for (int k = 0; k < 3; k++)
                memcpy(to[k], mean[k], COUNT * sizeof(float));
            assert_ok(one_start_move(&camera, &lens, &moved, NULL));
            for (size_t i = 0; i < COUNT; i++) {
                double point[3], pixel[2], start[3], dir[3], from[3], off[3];
                for (int k = 0; k < 3; k++) {
                    point[k] = (double)mean[k][i];
                    from[k] = (double)to[k][i] - camera.center[k];
                }
                if (!gbt_camera_pixel(&camera, point, pixel)) {
                    behind += memcmp(&to[0][i], &mean[0][i], sizeof(float)) == 0;
                    continue;
                }
                if (pixel[0] < 0 || pixel[1] < 0 || pixel[0] >= W || pixel[1] >= H || dvec_length(from) < 2)
                    continue; /* what is near moves by half the picture */
                assert_true(gbt_camera_ray(&camera, pixel[0], pixel[1], start, dir));
                dvec_cross(from, dir, off);
                worst = fmax(worst, dvec_length(off) / in_a_line);
                inside++;
            }
            gaussians_free(&moved);
        }
        print_message("at most %.2f lines off\n", worst);
        assert_true(worst < 1.5);
        if (inside < COUNT / 5 || behind < COUNT / 5) /* of three times as many */
            fail_msg("%zu inside, %zu behind", inside, behind);
        gaussians_free(&g);
    }
    parallel_set_threads(2);
}

static double mean_square(const frame *a, const frame *b)
{
    double sum = 0;
    for (size_t i = 0; i < 3 * W * H; i++) {
        const double d = (double)a->rgb.pixels[i] - (double)b->rgb.pixels[i];
        sum += d * d / (3.0 * W * H);
    }
    return sum;
}

/* The picture from one point is near that of the rays as they are, and far nearer than one taken at once. */
static void the_picture_is_near(void **state)
{
    (void)state;
    gaussian_cloud cloud;
    fill(&cloud);
    const trace_settings settings = trace_settings_default();
    for (gbt_camera_shutter s = GBT_CAMERA_SHUTTER_ROWS; s <= GBT_CAMERA_SHUTTER_COLUMNS; s++) {
        const gbt_camera camera = rolling_camera(s);
        gbt_camera still = camera;
        still.shutter = GBT_CAMERA_SHUTTER_GLOBAL;
        frame exact = {.draw.footprint = 0.1f}, near = {.draw.footprint = 0.1f, .draw.one_start = true},
              once = {.draw.footprint = 0.1f};
        assert_ok(frame_render(&exact, frame_plain(&cloud), &camera, &settings, false, NULL));
        assert_ok(frame_render(&near, frame_plain(&cloud), &camera, &settings, true, NULL));
        assert_ok(frame_render(&once, frame_plain(&cloud), &still, &settings, false, NULL));
        assert_false(exact.rays.common_origin);
        assert_true(near.rays.common_origin);
        const double off = mean_square(&near, &exact), apart = mean_square(&once, &exact);
        print_message("%.1f dB from one point, %.1f dB as if taken at once\n", -10 * log10(off),
                      -10 * log10(apart));
        assert_true(off < 0.02 * apart && off < 1e-3);
        image d = {0};
        assert_ok(image_fit(&d, W, H, 3, NULL));
        for (size_t i = 0; i < 3 * W * H; i++)
            d.pixels[i] = near.rgb.pixels[i] - exact.rgb.pixels[i];
        assert_ok(frame_backward_gaussians(&near, &d, NULL));
        image_free(&d);
        frame_free(&exact);
        frame_free(&near);
        frame_free(&once);
    }
    gaussian_cloud_free(&cloud);
}

static void memory_runs_out(void **state)
{
    (void)state;
    const gbt_camera camera = rolling_camera(GBT_CAMERA_SHUTTER_ROWS);
    camera_lens lens;
    gaussians g = {0};
    gbt_error err = {0};
    assert_true(camera_lens_prepare(&camera, &lens));
    mem_fail_after(0);
    assert_int_equal(one_start_move(&camera, &lens, &g, &err), GBT_ERR_NO_MEMORY);
    mem_fail_after(-1);
    assert_true(err.text[0] != '\0');
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(means_move_with_their_lines),
                                       cmocka_unit_test(the_picture_is_near),
                                       cmocka_unit_test(memory_runs_out)};
    return cmocka_run_group_tests_name("one start", tests, NULL, NULL);
}
