/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_presets.c -- what cut-offs leave out of a picture stays below the bounds of
   docs/accuracy.md, and comes near them. */
#include "base/memory.h"
#include "base/near.h"
#include "data/gaussian_file.h"
#include "gaussians_support.h"
#include "trace/fixture.h"
#include "trace/random_scene.h"
#include "trace/reference.h"
#include "trace/trace.h"

static const double half_step = 0.5 / 255;

static trace_settings preset(gbt_preset which)
{
    trace_settings s = trace_settings_default();
    trace_settings_preset(which, &s);
    return s;
}

/* No cut-offs but alpha_max, which is the model's. */
static trace_settings whole(void)
{
    trace_settings s = trace_settings_default();
    s.alpha_min = 1e-12f;
    s.transmittance_min = 1e-20f;
    return s;
}

static void presets_by_name(void **state)
{
    (void)state;
    trace_settings s = trace_settings_default(), before;
    s.alpha_max = 0.5f;
    s.t_near = 3;
    s.background[1] = 0.25f;
    s.alpha_min = 0.25f;
    s.transmittance_min = 0.5f;
    before = s;
    trace_settings_preset(GBT_PRESET_AS_TRAINED, &s);
    assert_memory_equal(&s, &before, sizeof s);
    trace_settings_preset(GBT_PRESET_DEFAULT, &s);
    const trace_settings d = trace_settings_default();
    assert_true(s.alpha_min == d.alpha_min && s.transmittance_min == d.transmittance_min);
    assert_true(s.alpha_max == 0.5f && s.t_near == 3 && s.background[1] == 0.25f); /* the model's stay */
    const trace_settings exact = preset(GBT_PRESET_EXACT), fast = preset(GBT_PRESET_FAST);
    assert_true(exact.alpha_min < d.alpha_min && d.alpha_min < fast.alpha_min);
    assert_true(exact.transmittance_min < d.transmittance_min &&
                d.transmittance_min < fast.transmittance_min);
}

/* ---- the bounds, on every ray ---- */

/* Hits of one ray in order; `hits` is used again and freed with mem_free(). */
typedef struct ray_hits {
    reference_hit *hits;
    size_t count, capacity;
} ray_hits;

static void find_hits(const reference_scene *scene, const trace_settings *s, const ray_image *rays,
                      size_t ray, ray_hits *out)
{
    double origin[3], dir[3];
    for (size_t k = 0; k < 3; k++) {
        origin[k] = (double)ray_image_origin(rays, ray)[k];
        dir[k] = (double)rays->dir[3 * ray + k];
    }
    assert_ok(reference_scene_ray_hits(scene, s, origin, dir, &out->hits, &out->count, &out->capacity, NULL));
}

/* What the bound of one ray is made of. */
typedef struct ray_bound {
    double dropped;      /* W: weight that hits below alpha_min have in the whole picture */
    double dropped_odds; /* 1 - prod (1 - alpha) over them */
    size_t dropped_count;
} ray_bound;

static ray_bound bound_ray(const ray_hits *list, double alpha_min)
{
    ray_bound b = {0};
    double T = 1, open = 1;
    for (size_t i = 0; i < list->count; i++) {
        const double alpha = list->hits[i].alpha;
        if (alpha < alpha_min) {
            b.dropped += T * alpha;
            open *= 1 - alpha;
            b.dropped_count++;
        }
        T *= 1 - alpha;
    }
    b.dropped_odds = 1 - open;
    return b;
}

typedef struct preset_figures {
    double error, bound,
        of_bound; /* worst error of the tracer, worst bound, worst error as a part of its ray's bound */
} preset_figures;

/* Cut-offs, and between what the worst error must be. */
typedef struct cut_row {
    const char *name;
    gbt_preset preset;
    float alpha_max; /* 0: the model's, with and without cut-offs */
    double error_low, error_high;
} cut_row;

static preset_figures check_preset(const gaussians *g, const ray_image *rays, const cut_row *row,
                                   const float background[3])
{
    trace_settings s = preset(row->preset), all = whole(), uncut = all; /* uncut: but for alpha_max */
    if (row->alpha_max > 0) {
        s.alpha_max = uncut.alpha_max = row->alpha_max;
        all.alpha_max = 0.9999999f;
    }
    memcpy(s.background, background, sizeof s.background);
    memcpy(all.background, background, sizeof all.background);
    const size_t count = ray_image_count(rays);
    const double stop = (double)s.transmittance_min / (1 - (double)s.alpha_max),
                 cap = row->alpha_max > 0 ? 1 - (double)s.alpha_max : 0;
    double *want = mem_alloc(count, 3 * sizeof *want, "test", NULL),
           *cut = mem_alloc(count, 3 * sizeof *cut, "test", NULL), color_max = 1;
    for (size_t i = 0; i < g->count; i++)
        color_max = fmax(color_max, (double)fmaxf(g->red[i], fmaxf(g->green[i], g->blue[i])));
    trace_scene traced = {0};
    image rgb = {0};
    reference_scene scene;
    ray_hits list = {0};
    preset_figures worst = {0};
    assert_ok(image_alloc(&rgb, rays->width, rays->height, 3, NULL));
    assert_ok(trace_build(&traced, g, &s, ray_image_reach(rays), NULL));
    assert_ok(trace_forward(&traced, rays, false, &(trace_outputs){.rgb = &rgb}, NULL, NULL));
    assert_ok(reference_scene_make(g, &scene, NULL));
    assert_ok(reference_scene_forward(&scene, &all, rays, want, NULL, NULL, NULL));
    assert_ok(reference_scene_forward(&scene, &s, rays, cut, NULL, NULL, NULL));
    for (size_t i = 0; i < count; i++) {
        find_hits(&scene, &uncut, rays, i, &list);
        const ray_bound b = bound_ray(&list, (double)s.alpha_min),
                        wider = bound_ray(&list, (double)s.alpha_min * (1 + 1e-4));
        const double m = (double)b.dropped_count, a = (double)s.alpha_min;
        assert_true(b.dropped <= b.dropped_odds + 1e-12);
        assert_true(b.dropped_odds <= 1 - pow(1 - a, m) + 1e-12 && 1 - pow(1 - a, m) <= m * a + 1e-12);
        const double bound = color_max * (b.dropped + stop + cap),
                     float_bound = color_max * (wider.dropped + stop * (1 + 1e-4) + cap) + 3e-5;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            assert_near(cut[k], want[k], bound + 1e-9);
            assert_near((double)rgb.pixels[k], want[k], float_bound);
            worst.error = fmax(worst.error, fabs((double)rgb.pixels[k] - want[k]));
            worst.of_bound = fmax(worst.of_bound, fabs(cut[k] - want[k]) / bound);
        }
        worst.bound = fmax(worst.bound, bound);
    }
    mem_free(want);
    mem_free(cut);
    mem_free(list.hits);
    reference_scene_free(&scene);
    trace_scene_free(&traced);
    image_free(&rgb);
    return worst;
}

static void check_scene(const char *scene, const gaussians *g, const ray_image *rays)
{
    const float background[3] = {0, 0.5f, 1};
    const cut_row rows[] = {{"exact", GBT_PRESET_EXACT, 0, 0, 0.5 * half_step},
                            {"default", GBT_PRESET_DEFAULT, 0, half_step, INFINITY},
                            {"fast", GBT_PRESET_FAST, 0, half_step, INFINITY},
                            {"alpha_max", GBT_PRESET_EXACT, 0.9f, 0, INFINITY}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const preset_figures f = check_preset(g, rays, &rows[i], background);
        print_message("%-14s %-10s max error %.2e, bound %.2e, %2.0f %% of a ray's bound reached\n", scene,
                      rows[i].name, f.error, f.bound, 100 * f.of_bound);
        assert_true(f.error >= rows[i].error_low && f.error < rows[i].error_high);
    }
}

static void random_scenes_stay_in_bounds(void **state)
{
    (void)state;
    const struct {
        const char *name;
        size_t count;
        float opacity_low;
    } scenes[] = {{"thin", 60, 0.02f}, {"thick", 1500, 0.05f}, {"opaque", 300, 0.95f}};
    ray_image rays = pinhole_rays(24, 20);
    for (size_t i = 0; i < 3; i++) {
        gaussians g = random_gaussians(scenes[i].count, scenes[i].opacity_low, 30 + i);
        check_scene(scenes[i].name, &g, &rays);
        gaussians_free(&g);
    }
    ray_image_free(&rays);
}

static void peer_scene_stays_in_bounds(void **state)
{
    (void)state;
    const char *path = shared_path("peer/match2k/scene.ply");
    if (path == NULL)
        skip();
    gaussian_cloud cloud;
    assert_ok(gaussian_file_read(path, &cloud, NULL));
    gaussians g = gaussians_of_cloud(&cloud, 0.12f); /* to where pinhole_rays() looks */
    gaussian_cloud_free(&cloud);
    ray_image rays = pinhole_rays(40, 40);
    check_scene("match2k", &g, &rays);
    ray_image_free(&rays);
    gaussians_free(&g);
}

/* ---- the bounds are reached ---- */

/* Red of the ray through the middle: discs of these opacities, one behind the other, of these colours, on
   black. */
static double blend_discs(const trace_settings *s, size_t count, const float *opacity, const float *color)
{
    gaussians g = some(count, 0);
    for (size_t i = 0; i < count; i++) {
        g.mean_z[i] = 0.1f * (float)i;
        g.scale_z[i] = 0.01f;
        g.scale_x[i] = g.scale_y[i] = 1e4f;
        g.opacity[i] = opacity[i];
        g.red[i] = color[i];
    }
    ray_image rays = pinhole_rays(1, 1);
    double rgb[3];
    assert_ok(reference_forward(&g, s, &rays, rgb, NULL, NULL, NULL));
    ray_image_free(&rays);
    gaussians_free(&g);
    return rgb[0];
}

static void dropped_hits_reach_their_bound(void **state)
{
    (void)state;
    enum { COUNT = 50 };
    const trace_settings all = whole();
    for (size_t i = 0; i < 3; i++) {
        const trace_settings s = preset((gbt_preset)i);
        float opacity[COUNT], white[COUNT];
        for (int k = 0; k < COUNT; k++) {
            opacity[k] = 0.999f * s.alpha_min;
            white[k] = 1;
        }
        assert_near(blend_discs(&s, COUNT, opacity, white), 0, 0);
        assert_near(blend_discs(&all, COUNT, opacity, white), 1 - pow(1 - (double)opacity[0], COUNT), 1e-7);
    }
}

/* The bound is for one hit: of thousands that are left out on one ray the error is the sum, also with
   "exact". */
static void many_dropped_hits_add_up(void **state)
{
    (void)state;
    enum { COUNT = 5000 };
    const trace_settings s = preset(GBT_PRESET_EXACT), all = whole();
    float opacity[COUNT], white[COUNT];
    for (int k = 0; k < COUNT; k++) {
        opacity[k] = 9.9e-6f;
        white[k] = 1;
    }
    const double bound = COUNT * (double)s.alpha_min,
                 error = blend_discs(&all, COUNT, opacity, white) - blend_discs(&s, COUNT, opacity, white);
    assert_true(error > 0.048 && error <= bound && error > 20 * half_step);
}

/* A hit of alpha_max that would bring T just below T_min is not blended, and T_min / (1 - alpha_max) is what
   it would have covered. */
static void the_stop_reaches_its_bound(void **state)
{
    (void)state;
    const trace_settings all = whole();
    for (size_t i = 0; i < 3; i++) {
        const trace_settings s = preset((gbt_preset)i);
        const double stop = (double)s.transmittance_min / (1 - (double)s.alpha_max), left = 0.99 * stop;
        const float in_front = (float)(1 - sqrt(left)), opacity[3] = {in_front, in_front, 1},
                    color[3] = {0, 0, 1};
        const double error = fabs(blend_discs(&s, 3, opacity, color) - blend_discs(&all, 3, opacity, color));
        assert_true(error <= stop && error > 0.97 * stop);
    }
}

static void alpha_max_reaches_its_bound(void **state)
{
    (void)state;
    trace_settings all = whole(), cut = whole();
    all.alpha_max = 0.9999999f;
    for (float alpha_max = 0.9f; alpha_max < 0.9995f; alpha_max = 1 - 0.1f * (1 - alpha_max)) {
        const float opacity[3] = {1, 1, 1}, color[3] = {1, 0, 0};
        cut.alpha_max = alpha_max;
        assert_near(blend_discs(&all, 3, opacity, color) - blend_discs(&cut, 3, opacity, color),
                    1 - (double)alpha_max, 2e-7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(presets_by_name),
        cmocka_unit_test(random_scenes_stay_in_bounds),
        cmocka_unit_test(peer_scene_stays_in_bounds),
        cmocka_unit_test(dropped_hits_reach_their_bound),
        cmocka_unit_test(many_dropped_hits_add_up),
        cmocka_unit_test(the_stop_reaches_its_bound),
        cmocka_unit_test(alpha_max_reaches_its_bound),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
