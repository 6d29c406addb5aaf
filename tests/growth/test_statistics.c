/* SPDX-License-Identifier: Apache-2.0 */
/* tests/growth/test_statistics.c -- what a view tells of Gaussians, for every lens: those that its rays
   blended have a gradient, wherever in the picture they are. */
#include "anchor/fixture.h"

#include "growth/statistics.h"

static const double degrees = 57.29577951308232;
#define HALF_TURN 3.141592653589793

enum { ANCHORS = 3000, OFFSETS = 2, SIZE = 96 };

typedef struct lens_case {
    const char *name;
    gbt_camera camera; /* at the origin, along z */
    bool turned;       /* looks along -z */
    double beyond_deg; /* from the axis: there must be Gaussians there that are seen */
} lens_case;

#define CENTRE 0.5 * SIZE
static lens_case cases[] = {
    {"pinhole", {.model = GBT_CAMERA_PINHOLE, .params = {60, 60, CENTRE, CENTRE}}, false, 30},
    {"pinhole, principal point in a corner",
     {.model = GBT_CAMERA_PINHOLE, .params = {60, 60, 0, SIZE}},
     false,
     50},
    {"barrel", {.model = GBT_CAMERA_SIMPLE_RADIAL, .params = {40, CENTRE, CENTRE, -0.12}}, false, 45},
    {"fisheye of 180 degrees",
     {.model = GBT_CAMERA_FISHEYE, .params = {SIZE / HALF_TURN, SIZE / HALF_TURN, CENTRE, CENTRE}},
     false,
     70},
    {"panorama", {.model = GBT_CAMERA_EQUIRECTANGULAR, .params = {SIZE, SIZE}}, false, 120},
    {"panorama, turned", {.model = GBT_CAMERA_EQUIRECTANGULAR, .params = {SIZE, SIZE}}, true, 120},
};
enum { CASES = sizeof cases / sizeof *cases };

static anchors anchors_around(void)
{
    anchors a = random_anchors(ANCHORS, OFFSETS, 3);
    for (size_t i = 0; i < a.count; i++) {
        double d[3], length = 0;
        for (uint64_t k = 0; k < 3; k++) {
            d[k] = rng_normal(5, k, i);
            length += d[k] * d[k];
        }
        for (size_t k = 0; k < 3; k++) /* from 2 to 6 away */
            a.position[3 * i + k] = (float)(d[k] / sqrt(length)) * spread(5, 9, i, 2, 6);
        for (size_t k = 0; k < 6; k++)
            a.scale_log[6 * i + k] = spread(5, 10 + k, i, -3.0f, -1.8f);
    }
    return a;
}

typedef struct gathered {
    frame f;
    growth_stats s;
} gathered;

static void gather(const lens_case *c, const anchors *a, const decoder *d, growth_counting counting,
                   gathered *g)
{
    gbt_camera camera = c->camera;
    camera.width = camera.height = SIZE;
    const double turn = c->turned ? -1 : 1, pose[9] = {turn, 0, 0, 0, 1, 0, 0, 0, turn};
    memcpy(camera.rotation, pose, sizeof pose);
    image d_image;
    *g = (gathered){0};
    const trace_settings settings = trace_settings_default();
    assert_ok(frame_render(&g->f, frame_neural(a, d), &camera, &settings, true, NULL));
    assert_ok(image_alloc(&d_image, camera.width, camera.height, 3, NULL));
    for (size_t i = 0; i < 3 * (size_t)camera.width * (size_t)camera.height; i++)
        d_image.pixels[i] = 1e-3f;
    assert_ok(frame_backward_gaussians(&g->f, &d_image, NULL));
    assert_ok(growth_stats_resize(&g->s, ANCHORS, OFFSETS, NULL));
    growth_stats_gather(&g->s, &g->f, GROWTH_BY_SHARE, counting, 0.01f);
    image_free(&d_image);
}

static void free_gathered(gathered *g)
{
    frame_free(&g->f);
    growth_stats_free(&g->s);
}

static size_t slot_of(const frame *f, size_t i)
{
    return (size_t)f->visible[f->tape.slot[i] / OFFSETS] * OFFSETS + f->tape.slot[i] % OFFSETS;
}

static double angle_of(const lens_case *c, const gaussians *g, size_t i)
{
    const double x = (double)g->mean_x[i], y = (double)g->mean_y[i], z = (double)g->mean_z[i];
    return acos((c->turned ? -z : z) / sqrt(x * x + y * y + z * z)) * degrees;
}

static void what_rays_blended_is_counted(void **state)
{
    const lens_case *c = *state;
    anchors a = anchors_around();
    decoder d = random_decoder(OFFSETS, false, 7);
    gathered by_rays, in_cone;
    gather(c, &a, &d, GROWTH_COUNT_BLENDED, &by_rays);
    gather(c, &a, &d, GROWTH_COUNT_IN_CONE, &in_cone);
    const frame *f = &by_rays.f;
    double outer = 0;
    size_t steep = 0, missed = 0;
    for (size_t i = 0; i < f->gaussians.count; i++) {
        const size_t slot = slot_of(f, i);
        assert_true(by_rays.s.grad_count[slot] == (f->blend_weight[i] > 0 ? 1 : 0));
        assert_true(f->blend_weight[i] > 0 || by_rays.s.grad_accum[slot] == 0);
        if (!(f->blend_weight[i] > 0) || angle_of(c, &f->gaussians, i) < c->beyond_deg)
            continue;
        outer += (double)f->blend_weight[i];
        steep += by_rays.s.grad_accum[slot] > 1e-5f;
        missed += in_cone.s.grad_count[slot] == 0;
    }
    assert_true(outer > 10 && steep > 10);
    assert_true((missed > 0) == (strcmp(c->name, "pinhole") != 0)); /* what the cone leaves out */
    free_gathered(&by_rays);
    free_gathered(&in_cone);
    anchors_free(&a);
    decoder_free(&d);
}

/* A panorama has no front: looking the other way tells the same of every Gaussian. */
static void a_panorama_has_no_front(void **state)
{
    (void)state;
    anchors a = anchors_around();
    decoder d = random_decoder(OFFSETS, false, 7);
    gathered way[2];
    for (int i = 0; i < 2; i++)
        gather(&cases[CASES - 2 + i], &a, &d, GROWTH_COUNT_BLENDED, &way[i]);
    for (size_t slot = 0; slot < ANCHORS * OFFSETS; slot++) {
        const double one = (double)way[0].s.grad_accum[slot], other = (double)way[1].s.grad_accum[slot];
        assert_true(fabs(one - other) <= 1e-6 + 1e-3 * one);
    }
    for (int i = 0; i < 2; i++)
        free_gathered(&way[i]);
    anchors_free(&a);
    decoder_free(&d);
}

int main(void)
{
    struct CMUnitTest tests[CASES + 1];
    for (size_t i = 0; i < CASES; i++)
        tests[i] = (struct CMUnitTest){
            .name = cases[i].name, .test_func = what_rays_blended_is_counted, .initial_state = &cases[i]};
    tests[CASES] = (struct CMUnitTest)cmocka_unit_test(a_panorama_has_no_front);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
