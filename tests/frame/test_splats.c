/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/test_splats.c -- splats that stand for rays: of the same footprint, so of the same picture and
   gradient where nothing overlaps; without one they are dilated, which small Gaussians show. Splats whose
   centres are outside of the picture. */
#include "anchor/fixture.h"
#include "base/near.h"
#include "frame/frame.h"
#include "frame/ring.h"

enum { ACROSS = 4, DOWN = 3, COUNT = ACROSS * DOWN };

/* On a plane through the middle of the picture, four std-devs and more apart, from a twentieth of a pixel to
   a pixel; flat and turned. */
static void make_dots(const gbt_camera *camera, gaussian_cloud *c)
{
    assert_ok(gaussian_cloud_alloc(c, COUNT, NULL));
    c->sh_degree = 0;
    for (size_t i = 0; i < COUNT; i++) {
        const double x = ((double)(i % ACROSS) - 1.5) * 1.4 + 0.03,
                     y = ((double)(i / ACROSS) - 1) * 1.4 + 0.05, turn = 0.5 * (double)i;
        const float size = 0.007f * powf(20, (float)i / (COUNT - 1));
        for (size_t k = 0; k < 3; k++) {
            c->mean[3 * i + k] = (float)(x * camera->rotation[k] + y * camera->rotation[3 + k]);
            c->scale_log[3 * i + k] = logf(size) - 0.4f * (float)((i + k) % 3);
        }
        c->quat[4 * i] = (float)cos(turn);
        c->quat[4 * i + 1] = (float)(sin(turn) * 0.6);
        c->quat[4 * i + 2] = (float)(sin(turn) * 0.8);
        c->quat[4 * i + 3] = 0;
        c->opacity[i] = 0.8f;
        memset(c->sh + 48 * i, 0, 48 * sizeof *c->sh);
        for (size_t k = 0; k < 3; k++)
            c->sh[48 * i + k] = 0.3f * (float)k;
    }
}

typedef struct drawn {
    frame f;
    gaussian_cloud d;
    double light;
} drawn;

static void draw(const gaussian_cloud *cloud, const gbt_camera *camera, gbt_renderer renderer,
                 float footprint, drawn *out)
{
    trace_settings settings = trace_settings_default();
    settings.alpha_min = 1e-6f; /* dots of a twentieth of a pixel are faint */
    *out = (drawn){.f.draw = {.renderer = renderer, .footprint = footprint}};
    assert_ok(frame_render(&out->f, frame_plain(cloud), camera, &settings, true, NULL));
    image d_image;
    assert_ok(image_alloc(&d_image, W, H, 3, NULL));
    for (size_t i = 0; i < 3 * W * H; i++) {
        out->light += (double)out->f.rgb.pixels[i];
        d_image.pixels[i] =
            cosf(0.3f * (float)(i / 3 % W)) + 0.1f * (float)(i % 3); /* smooth, as it is about shapes */
    }
    assert_ok(gaussian_cloud_alloc(&out->d, COUNT, NULL));
    assert_ok(frame_backward_plain(&out->f, cloud, &d_image, &out->d, NULL));
    image_free(&d_image);
}

static void drawn_free(drawn *d)
{
    frame_free(&d->f);
    gaussian_cloud_free(&d->d);
}

static double relative_error(const float *got, const float *wanted, size_t count)
{
    double square = 0, norm = 0;
    for (size_t i = 0; i < count; i++) {
        square += pow((double)got[i] - (double)wanted[i], 2);
        norm += pow((double)wanted[i], 2);
    }
    return sqrt(square / norm);
}

static void splats_of_a_footprint_are_rays(void **state)
{
    (void)state;
    const gbt_camera camera = ring_camera(0);
    gaussian_cloud cloud;
    make_dots(&camera, &cloud);
    drawn rays, splats, dilated;
    draw(&cloud, &camera, GBT_RENDERER_TRACE, 0.1f, &rays);
    draw(&cloud, &camera, GBT_RENDERER_RASTER, 0.1f, &splats);
    draw(&cloud, &camera, GBT_RENDERER_RASTER, 0, &dilated);
    const double picture = relative_error(splats.f.rgb.pixels, rays.f.rgb.pixels, 3 * W * H);
    const double scale = relative_error(splats.d.scale_log, rays.d.scale_log, 3 * COUNT);
    const double opacity = relative_error(splats.d.opacity, rays.d.opacity, COUNT);
    const double color = relative_error(splats.d.sh, rays.d.sh, 48 * COUNT);
    print_message("picture %.1e; gradient of scales %.1e, opacities %.1e, colours %.1e; light %.3f of the "
                  "rays', dilated %.3f\n",
                  picture, scale, opacity, color, splats.light / rays.light, dilated.light / rays.light);
    assert_true(picture < 0.02 && scale < 0.03 && opacity < 0.01 && color < 0.01);
    assert_near(splats.light / rays.light, 1, 0.02);
    assert_true(dilated.light / rays.light > 1.3); /* what is smaller than the dilation is too bright */
    drawn_free(&rays);
    drawn_free(&splats);
    drawn_free(&dilated);
    gaussian_cloud_free(&cloud);
}

/* A splat whose centre is outside of the picture is drawn as wide as there, which is wider than at the edge:
   one whose ball does not reach the view's planes may be seen. */
static void splats_beyond_the_edge(void **state)
{
    (void)state;
    enum { SIDE = 1024 };
    static const float away[4][2] = {{24.5f, 0}, {-24.5f, 0}, {0, 24.5f}, {0, -24.5f}};
    const double focal = SIDE / 2 / tan(1.0471975512); /* 120 degrees */
    const gbt_camera camera = {.model = GBT_CAMERA_PINHOLE,
                               .params = {focal, focal, SIDE / 2, SIDE / 2},
                               .width = SIDE,
                               .height = SIDE,
                               .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    const trace_settings settings = trace_settings_default();
    gaussian_cloud cloud;
    assert_ok(gaussian_cloud_alloc(&cloud, 1, NULL));
    cloud.sh_degree = 0;
    memset(cloud.scale_log, 0, 3 * sizeof *cloud.scale_log);
    cloud.quat[0] = 1;
    cloud.quat[1] = cloud.quat[2] = cloud.quat[3] = 0;
    cloud.opacity[0] = 0.99f;
    memset(cloud.sh, 0, 48 * sizeof *cloud.sh); /* grey */
    for (int i = 0; i < 4; i++) {
        frame f = {.draw.renderer = GBT_RENDERER_RASTER};
        float lightest = 0;
        for (int k = 0; k < 2; k++)
            cloud.mean[k] = away[i][k];
        cloud.mean[2] = 10;
        assert_ok(frame_render(&f, frame_plain(&cloud), &camera, &settings, false, NULL));
        for (size_t k = 0; k < 3 * SIDE * SIDE; k++)
            lightest = fmaxf(lightest, f.rgb.pixels[k]);
        assert_true(lightest > 0.005f);
        frame_free(&f);
    }
    gaussian_cloud_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splats_of_a_footprint_are_rays),
        cmocka_unit_test(splats_beyond_the_edge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
