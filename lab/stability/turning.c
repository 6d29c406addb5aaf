/* SPDX-License-Identifier: Apache-2.0 */
/* stability/turning.c -- case A1 of the study "stability": what changes when only the direction of the camera
   changes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/memory.h"
#include "base/rng.h"
#include "stability/crowd.h"
#include "stability/draw.h"

static const double degree = 0.017453292519943295;

typedef struct placed_ray {
    uint64_t place; /* pixel in which the camera of a pose sees the ray: tile, then pixel in it */
    uint32_t id;
} placed_ray;

static int by_place(const void *a, const void *b)
{
    const placed_ray *p = a, *q = b;
    return p->place != q->place ? (p->place > q->place) - (p->place < q->place)
                                : (p->id > q->id) - (p->id < q->id);
}

/* Sort the rays in the order in which the tiles of a panorama of this pose would contain them. */
static void place_rays(const float *dirs, size_t count, double yaw, double pitch, placed_ray *out)
{
    gbt_camera camera = {
        .model = GBT_CAMERA_EQUIRECTANGULAR, .width = 2048, .height = 1024, .params = {2048, 1024}};
    double rotation[9];
    draw_turned(yaw, pitch, rotation);
    for (size_t i = 0; i < count; i++) {
        double cam[3], pixel[2] = {0, 0};
        for (int k = 0; k < 3; k++)
            cam[k] = rotation[3 * k] * (double)dirs[3 * i] + rotation[3 * k + 1] * (double)dirs[3 * i + 1] +
                     rotation[3 * k + 2] * (double)dirs[3 * i + 2];
        gbt_camera_project(&camera, cam, pixel);
        const uint64_t x = (uint64_t)fmax(pixel[0], 0), y = (uint64_t)fmax(pixel[1], 0);
        out[i] = (placed_ray){(y / 16) << 48 | (x / 16) << 32 | (y % 16) << 16 | x % 16, (uint32_t)i};
    }
    qsort(out, count, sizeof *out, by_place);
}

typedef struct turning {
    size_t count;
    bool *on_edge; /* [count]: within rounding of a tie or cut-off, where the last bit can be visible */
    float *dirs, *first,
        *turned; /* [count][3]: the rays, their colours in the first pose, and in the current pose */
    placed_ray *order;
} turning;

/* Trace the rays in the order of one pose's tiles, and put the colours back into the original order. */
static void trace_pose(stability *s, const turning *t, drawing *d, const gaussians *g, ray_image *rays,
                       double yaw, double pitch, float *out)
{
    const trace_settings settings = trace_settings_default();
    if (s->status != GBT_OK ||
        !stability_ok(s, ray_image_reserve(rays, 16, (int)(t->count / 16), true, s->err)))
        return;
    place_rays(t->dirs, t->count, yaw, pitch, t->order);
    rays->origin[0] = rays->origin[1] = rays->origin[2] = 0;
    for (size_t i = 0; i < t->count; i++)
        memcpy(rays->dir + 3 * i, t->dirs + 3 * t->order[i].id, 3 * sizeof(float));
    draw_traced(s, d, g, &settings, rays);
    for (size_t i = 0; i < t->count && s->status == GBT_OK; i++)
        memcpy(out + 3 * t->order[i].id, d->rgb.pixels + 3 * i, 3 * sizeof(float));
}

static void compare_poses(stability *s, const turning *t, const gaussians *g, trace_kernel kernel,
                          double *changed, double *most)
{
    const int poses = (int)stability_number(s, "poses");
    drawing d = {.traced.kernel = kernel};
    ray_image rays = {0};
    *changed = *most = 0;
    for (int p = 0; p < poses && s->status == GBT_OK; p++) {
        trace_pose(s, t, &d, g, &rays, 0.7 * p, 0.3 * (p % 8 - 3.5), p == 0 ? t->first : t->turned);
        for (size_t i = 0; i < 3 * t->count && p > 0 && s->status == GBT_OK; i++) {
            *changed += memcmp(&t->first[i], &t->turned[i], sizeof(float)) != 0;
            if (!t->on_edge[i / 3])
                *most = larger_or_nan(*most, draw_difference(&t->first[i], &t->turned[i], 1));
        }
    }
    ray_image_free(&rays);
    drawing_free(&d);
}

static void same_rays(stability *s)
{
    turning t = {.count = (size_t)stability_number(s, "rays") / 16 * 16};
    gaussians g = {0};
    double changed, most, unused;
    stability_crowd(s, &g);
    t.dirs = mem_alloc(t.count, 9 * sizeof *t.dirs, "rays and colours", s->err);
    t.order = mem_alloc(t.count, sizeof *t.order, "order of rays", s->err);
    t.on_edge = mem_calloc(t.count, sizeof *t.on_edge, "rays on edges", s->err);
    if (t.dirs == NULL || t.order == NULL || t.on_edge == NULL)
        stability_ok(s, GBT_ERR_NO_MEMORY);
    if (s->status == GBT_OK) {
        t.first = t.dirs + 3 * t.count;
        t.turned = t.first + 3 * t.count;
        for (size_t i = 0; i < t.count; i++) {
            const float x = 0.8f * rng_uniform(7, 0, i) - 0.4f, y = 0.8f * rng_uniform(7, 1, i) - 0.4f,
                        z = 1 / sqrtf(1 + x * x + y * y);
            t.dirs[3 * i] = x * z;
            t.dirs[3 * i + 1] = y * z;
            t.dirs[3 * i + 2] = z;
        }
        const size_t edges = stability_find_edges(s, &g, t.dirs, t.count, t.on_edge);
        compare_poses(s, &t, &g, TRACE_SINGLE, &changed, &unused);
        stability_check(s, "A1a", changed, NAN,
                        "The same ray gives the same bits, whichever rays are traced beside it.");
        compare_poses(s, &t, &g, TRACE_TREE, &changed, &most);
        stability_check(s, "A1b", most, NAN,
                        "Tiles measure from axes of their own, so the last bits differ. Left out: %zu rays "
                        "within rounding of a tie or a cut.",
                        edges);
    }
    mem_free(t.dirs);
    mem_free(t.order);
    mem_free(t.on_edge);
    gaussians_free(&g);
}

/* The colour of a picture in a world direction, by bilinear interpolation; false outside of the picture. */
static bool look_up(const image *rgb, const gbt_camera *camera, const double dir[3], double out[3])
{
    double cam[3], pixel[2];
    for (int k = 0; k < 3; k++)
        cam[k] = camera->rotation[3 * k] * dir[0] + camera->rotation[3 * k + 1] * dir[1] +
                 camera->rotation[3 * k + 2] * dir[2];
    if (!gbt_camera_project(camera, cam, pixel))
        return false;
    const double x = pixel[0] - 0.5, y = pixel[1] - 0.5;
    const int column = (int)floor(x), row = (int)floor(y);
    if (column < 0 || row < 0 || column + 1 >= rgb->width || row + 1 >= rgb->height)
        return false;
    const float *p = rgb->pixels + 3 * ((size_t)row * (size_t)rgb->width + (size_t)column),
                *q = p + 3 * (size_t)rgb->width;
    for (int c = 0; c < 3; c++) {
        const double above = (double)p[c] + (x - column) * ((double)p[3 + c] - (double)p[c]),
                     below = (double)q[c] + (x - column) * ((double)q[3 + c] - (double)q[c]);
        out[c] = above + (y - row) * (below - above);
    }
    return true;
}

enum { LOOK_ACROSS = 41, LOOK_DOWN = 25, LOOK_COUNT = LOOK_ACROSS * LOOK_DOWN };

static void look_direction(int i, double dir[3]) /* within 16 and 10 degrees of the axis, so that every pose
                                                    sees it */
{
    dir[0] = tan(0.8 * (i % LOOK_ACROSS - LOOK_ACROSS / 2) * degree),
    dir[1] = tan(0.8 * (i / LOOK_ACROSS - LOOK_DOWN / 2) * degree), dir[2] = 1;
}

/* Find the directions without an edge of the exact picture within a pixel or so. Pixels that move across an
   edge change, but that is not popping. */
static size_t find_still(stability *s, const gaussians *g, double pixel, bool still[LOOK_COUNT])
{
    static const double here[3] = {0, 0, 0}, around[5][2] = {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    const trace_settings settings = trace_settings_default();
    ray_image rays = {0};
    size_t count = 0;
    draw_rays(s, &rays, 5, LOOK_COUNT);
    for (int i = 0; i < 5 * LOOK_COUNT && s->status == GBT_OK; i++) {
        double dir[3];
        look_direction(i / 5, dir);
        dir[0] += 1.5 * pixel * around[i % 5][0];
        dir[1] += 1.5 * pixel * around[i % 5][1];
        draw_ray(&rays, (size_t)i, here, dir);
    }
    double *exact = draw_exact(s, g, &settings, &rays, NULL);
    for (size_t i = 0; i < LOOK_COUNT && exact != NULL; i++) {
        double most = 0;
        for (size_t k = 0; k < 12; k++)
            most = fmax(most, fabs(exact[15 * i + 3 + k] - exact[15 * i + k % 3]));
        still[i] = most < 0.1;
        count += still[i];
    }
    mem_free(exact);
    ray_image_free(&rays);
    return count;
}

/* One renderer's colours in fixed directions while its camera turns. */
typedef struct fixed_directions {
    drawing d;
    double last[LOOK_COUNT][3], jump;
    bool has_last;
} fixed_directions;

static void look_around(fixed_directions *o, const gbt_camera *camera, const bool still[LOOK_COUNT],
                        double aside[3])
{
    for (int i = 0; i < LOOK_COUNT; i++) {
        double dir[3], now[3] = {0, 0, 0};
        look_direction(i, dir);
        look_up(&o->d.rgb, camera, dir, now);
        for (int c = 0; c < 3; c++) {
            if (o->has_last && still[i])
                o->jump = larger_or_nan(o->jump, fabs(now[c] - o->last[i][c]));
            o->last[i][c] = now[c];
        }
        if (i == LOOK_COUNT / 2 + 5) /* 4 degrees off the axis */
            memcpy(aside, now, sizeof now);
    }
    o->has_last = true;
}

/* Two small pictures in slightly different directions by each renderer: the tracer's above, the rasterizer's
   below. */
static void turning_picture(stability *s, const gaussians *g, drawing *d, const gbt_camera *camera,
                            double step)
{
    enum { WIDTH = 240, HEIGHT = 160, GAP = 4, SHEET = 2 * WIDTH + GAP };
    image sheet = {0};
    ray_image rays = {0};
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    stability_ok(s, image_alloc(&sheet, SHEET, 2 * HEIGHT + GAP, 3, s->err));
    for (size_t i = 0; i < (size_t)3 * SHEET * (2 * HEIGHT + GAP) && s->status == GBT_OK; i++)
        sheet.pixels[i] = 1;
    for (int i = 0; i < 4 && s->status == GBT_OK; i++) {
        gbt_camera large = gbt_camera_resized(camera, WIDTH, HEIGHT);
        draw_turned((i % 2 == 0 ? -step : step) * degree, 0, large.rotation);
        if (i < 2)
            draw_camera(s, d, g, &settings, &large, &rays);
        else
            draw_splatted(s, d, g, &splat, &large);
        for (size_t y = 0; y < HEIGHT && s->status == GBT_OK; y++)
            memcpy(sheet.pixels +
                       3 * (((size_t)(i / 2) * (HEIGHT + GAP) + y) * SHEET + (size_t)(i % 2) * (WIDTH + GAP)),
                   d->rgb.pixels + 3 * y * WIDTH, 3 * WIDTH * sizeof(float));
    }
    stability_picture(s, "a1", &sheet);
    image_free(&sheet);
    ray_image_free(&rays);
}

static void turn_slowly(stability *s)
{
    static const double here[3] = {0, 0, 0};
    const double step = stability_number(s, "step_deg"), range = stability_number(s, "range_deg"),
                 curve = stability_number(s, "curve_deg");
    const int half = (int)lround(0.5 * range / fmax(step, 1e-6));
    gbt_camera camera = draw_pinhole((int)stability_number(s, "width"), (int)stability_number(s, "height"),
                                     stability_number(s, "focal"), here);
    gaussians g = {0};
    ray_image rays = {0};
    fixed_directions *ours = mem_calloc(2, sizeof *ours, "directions", s->err), *theirs = ours + 1;
    stability_gaussians(s, &g);
    if (ours == NULL || !stability_ok(s, s->status)) {
        stability_ok(s, GBT_ERR_NO_MEMORY);
        gaussians_free(&g);
        mem_free(ours);
        return;
    }
    const trace_settings settings = trace_settings_default();
    const raster_settings splat = raster_settings_default();
    bool still[LOOK_COUNT];
    const size_t still_count = find_still(s, &g, 1 / stability_number(s, "focal"), still);
    stability_chart *chart = stability_new_chart(
        s, "Turning the camera",
        "Red in one fixed direction. Only the camera turns; it should stay the same.", "yaw, degrees", "red");
    for (int i = -half; i <= half && s->status == GBT_OK; i++) {
        double aside[3] = {0};
        draw_turned(i * step * degree, 0, camera.rotation);
        draw_camera(s, &ours->d, &g, &settings, &camera, &rays);
        draw_splatted(s, &theirs->d, &g, &splat, &camera);
        for (int r = 0; r < 2 && s->status == GBT_OK; r++) {
            look_around(ours + r, &camera, still, aside);
            if (fabs(i * step) <= curve * 1.000001)
                stability_point(chart, r, i * step, aside[0]);
        }
    }
    stability_check(s, "A1c", ours->jump, theirs->jump,
                    "%zu of %d directions; the others look at the edge itself. By t* the order of two "
                    "crossing Gaussians still changes along a curve in the scene: it stays where it is when "
                    "the camera turns, and moves when the camera moves.",
                    still_count, (int)LOOK_COUNT);
    turning_picture(s, &g, &ours->d, &camera, step);
    drawing_free(&ours->d);
    drawing_free(&theirs->d);
    ray_image_free(&rays);
    gaussians_free(&g);
    mem_free(ours);
}

gbt_status stability_a1(stability *s)
{
    same_rays(s);
    turn_slowly(s);
    return s->status;
}
