/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_ellipsoids.c -- solid ellipsoids as pictures: where they are, which is in front, and what
   is left out. */
#include "base/image.h"
#include "base/near.h"
#include "base/parallel.h"
#include "render/ellipsoids.h"

enum { SIDE = 64 };

static gbt_camera pinhole(void)
{
    return (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = SIDE,
                        .height = SIDE,
                        .params = {64, 64, 32, 32},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

static gbt_camera parallel_rays(void)
{
    gbt_camera c = pinhole();
    c.model = GBT_CAMERA_ORTHOGRAPHIC;
    c.params[0] = c.params[1] = 16; /* pixels per unit */
    return c;
}

static image draw(const ellipsoids *set, const gbt_camera *camera)
{
    image out;
    assert_ok(image_alloc(&out, SIDE, SIDE, 4, &assert_ok_err_));
    memset(out.pixels, 0, 4 * SIDE * SIDE * sizeof *out.pixels);
    assert_ok(ellipsoids_draw(set, camera, &out, &assert_ok_err_));
    return out;
}

static double at(const image *im, int x, int y, int channel)
{
    return (double)im->pixels[4 * (y * SIDE + x) + channel];
}

static double area(const image *im)
{
    double sum = 0;
    for (int i = 0; i < SIDE * SIDE; i++)
        sum += (double)im->pixels[4 * i + 3];
    return sum;
}

static const float white[3] = {1, 1, 1};

/** A sphere of radius 1 at distance 4 has the silhouette tan(asin(1/4)); parallel rays see its radius. */
static void a_sphere(void **state)
{
    (void)state;
    const float center[3] = {0, 0, 4}, axes[3] = {1, 1, 1};
    const ellipsoids set = {.count = 1, .center = center, .axes = axes, .color = white};
    gbt_camera camera = pinhole();
    image im = draw(&set, &camera);
    const double radius = 64 * tan(asin(0.25));
    assert_near(area(&im), 3.14159265 * radius * radius, 0.02 * area(&im));
    assert_near(at(&im, 32, 32, 3), 1, 0);
    assert_near(at(&im, 32, 32, 0), 1, 0.01);    /* faces the camera */
    assert_true(at(&im, 32 + 15, 32, 0) < 0.75); /* the rim is darker */
    assert_near(at(&im, 32 + 18, 32, 3), 0, 0);
    image_free(&im);
    ellipsoids limited = set;
    for (int k = 0; k < 2; k++) { /* 16 pixels at its distance */
        limited.most_pixels = 15.9f + 0.2f * (float)k;
        im = draw(&limited, &camera);
        assert_true((area(&im) > 0) == (k == 1));
        image_free(&im);
    }
    camera = parallel_rays();
    im = draw(&set, &camera);
    assert_near(area(&im), 3.14159265 * 256, 0.02 * area(&im));
    image_free(&im);
}

/** Half axes 2, 0.5, 0.5, turned by 45 degrees about z: long from the upper left to the lower right. */
static void turned(void **state)
{
    (void)state;
    const float center[3] = {0, 0, 4}, axes[3] = {2, 0.5f, 0.5f},
                quat[4] = {cosf(0.39269908f), 0, 0, sinf(0.39269908f)};
    const ellipsoids set = {.count = 1, .center = center, .axes = axes, .quat = quat, .color = white};
    const gbt_camera camera = parallel_rays();
    image im = draw(&set, &camera);
    assert_near(area(&im), 3.14159265 * 32 * 8, 0.02 * area(&im));
    assert_near(at(&im, 32 + 18, 32 + 18, 3), 1, 0);
    assert_near(at(&im, 32 + 18, 32 - 18, 3), 0, 0);
    image_free(&im);
}

static void order_and_limits(void **state)
{
    (void)state;
    /* behind, in front, around the camera, behind it, not a number, a flat one seen from its edge, a point
       beside */
    const float center[21] = {0, 0, 6, 0, 0, 4, 0, 0, 0.5f, 0, 0, -4, NAN, 0, 4, 0, 1.2f, 4, 1.2f, 0, 4};
    const float axes[21] = {2, 2, 2, 0.5f, 0.5f, 0.5f, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0.5f, 0, 0.5f, 0, 0, 0};
    const float color[21] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1, 0};
    const ellipsoids set = {.count = 7, .center = center, .axes = axes, .color = color, .least_pixels = 1};
    const gbt_camera camera = pinhole();
    image im = draw(&set, &camera), same;
    assert_true(at(&im, 32, 32, 1) > 0.9 && at(&im, 32, 32, 0) == 0); /* the green one hides the red one */
    assert_true(at(&im, 32 + 12, 32 - 6, 0) > 0.4 && at(&im, 32 + 12, 32 - 6, 1) == 0);
    for (int i = 0; i < SIDE * SIDE; i++)
        assert_true(im.pixels[4 * i + 2] == 0 || im.pixels[4 * i] > 0.2f); /* nothing blue: only what is white
                                                                              has blue */
    assert_true(at(&im, 32, 32 + 19, 2) > 0.3); /* not thinner than it can be seen */
    assert_true(at(&im, 32 + 19, 32, 3) == 1 && at(&im, 32 + 19, 32, 1) > 0.3);
    parallel_set_threads(3);
    same = draw(&set, &camera);
    parallel_set_threads(1);
    assert_memory_equal(im.pixels, same.pixels, 4 * SIDE * SIDE * sizeof *im.pixels);
    image_free(&im);
    image_free(&same);
}

/** Drawn over what is there, which shows where a pixel is covered in part. */
static void over_a_picture(void **state)
{
    (void)state;
    const float center[3] = {0, 0, 4}, axes[3] = {1, 1, 1}, red[3] = {1, 0, 0};
    const ellipsoids set = {.count = 1, .center = center, .axes = axes, .color = red};
    const gbt_camera camera = parallel_rays();
    image im;
    assert_ok(image_alloc(&im, SIDE, SIDE, 4, &assert_ok_err_));
    for (int i = 0; i < 4 * SIDE * SIDE; i++)
        im.pixels[i] = 1;
    assert_ok(ellipsoids_draw(&set, &camera, &im, &assert_ok_err_));
    for (int i = 0; i < SIDE * SIDE; i++)
        assert_near((double)im.pixels[4 * i + 3], 1, 1e-6);
    assert_near(at(&im, 2, 2, 1), 1, 0);
    assert_near(at(&im, 32, 32, 1), 0, 0);
    image_free(&im);
}

static void refuses(void **state)
{
    (void)state;
    const ellipsoids set = {0};
    image im;
    gbt_error err = {0};
    gbt_camera camera = pinhole();
    assert_ok(image_alloc(&im, SIDE, SIDE, 4, &assert_ok_err_));
    camera.model = GBT_CAMERA_FISHEYE;
    assert_int_equal(ellipsoids_draw(&set, &camera, &im, &err), GBT_ERR_ARGUMENT);
    camera = pinhole();
    camera.width = SIDE + 1;
    memset(&err, 0, sizeof err);
    assert_int_equal(ellipsoids_draw(&set, &camera, &im, &err), GBT_ERR_ARGUMENT);
    image_free(&im);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_sphere), cmocka_unit_test(turned),
                                       cmocka_unit_test(order_and_limits), cmocka_unit_test(over_a_picture),
                                       cmocka_unit_test(refuses)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
