/* train/frame.c -- one view of an anchor model: rays, visible anchors, decode, tree, trace; and back. */
#include "train/frame.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { ANCHOR_BLOCK = 4096 };

static double lap(double *since)
{
    const double now = clock_wall(), passed = now - *since;
    *since = now;
    return passed;
}

/* ---- visible anchors ------------------------------------------------------------------------------------------------------------------ */

/* The camera's rays lie inside a cone around `axis` and, when they all look forward, inside four planes through the centre. */
typedef struct view_bounds {
    float center[3];
    float axis[3], cos_angle, sin_angle;
    bool has_planes;
    float plane[4][3]; /* unit normals pointing out: visible ball -> n.(x - c) <= radius */
} view_bounds;

static void find_bounds(const ray_image *rays, const gbt_camera *camera, view_bounds *out)
{
    double axis[3] = {0, 0, 0};
    const size_t count = (size_t)rays->width * (size_t)rays->height;
    for (size_t i = 0; i < count; i += 7)
        for (int k = 0; k < 3; k++)
            axis[k] += (double)rays->dir[3 * i + (size_t)k];
    dvec_normalize(axis);
    double cos_min = 1, low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9}, depth_min = 1;
    for (size_t i = 0; i < count; i++) {
        /* For lenses the widest rays are on the border of the image or of the field of view: look at the border and at every 5th pixel. */
        const size_t x = i % (size_t)rays->width, y = i / (size_t)rays->width;
        const bool border = x == 0 || y == 0 || x + 1 == (size_t)rays->width || y + 1 == (size_t)rays->height;
        if (!border && i % 5 != 0)
            continue;
        const float *d = rays->dir + 3 * i;
        if (d[0] == 0 && d[1] == 0 && d[2] == 0)
            continue;
        const double dir[3] = {(double)d[0], (double)d[1], (double)d[2]};
        double cam[3];
        dmat_apply(camera->rotation, dir, cam);
        cos_min = fmin(cos_min, dvec_dot(dir, axis));
        depth_min = fmin(depth_min, cam[2]);
        if (cam[2] > 0.05)
            for (int k = 0; k < 2; k++)
                low[k] = fmin(low[k], cam[k] / cam[2]), high[k] = fmax(high[k], cam[k] / cam[2]);
    }
    for (int k = 0; k < 3; k++)
        out->center[k] = (float)camera->center[k], out->axis[k] = (float)axis[k];
    cos_min = fmax(cos_min - 2e-3, -1); /* pixels between the ones looked at */
    out->cos_angle = (float)cos_min;
    out->sin_angle = (float)sqrt(fmax(0, 1 - cos_min * cos_min));
    out->has_planes = depth_min > 0.05;
    for (int k = 0; k < 2 && out->has_planes; k++)
        for (int sign = 0; sign < 2; sign++) {
            const double slope = sign == 0 ? high[k] * (1 + 1e-3) + 1e-3 : low[k] * (1 + 1e-3) - 1e-3;
            double n[3] = {0, 0, 0}, world[3];
            n[k] = sign == 0 ? 1 : -1;
            n[2] = sign == 0 ? -slope : slope;
            dvec_normalize(n);
            dmat_apply_transposed(camera->rotation, n, world);
            for (int j = 0; j < 3; j++)
                out->plane[2 * k + sign][j] = (float)world[j];
        }
}

/* Radius of a ball around the anchor that holds the proxies of all its Gaussians: `sigmas` std-devs around each. */
static float anchor_reach(const anchors *a, size_t i, float sigmas)
{
    const float *l = a->scale_log + 6 * i;
    const float ex = expf(fminf(l[0], 30.0f)), ey = expf(fminf(l[1], 30.0f)), ez = expf(fminf(l[2], 30.0f));
    const float *o = a->offset + 3 * (size_t)a->offset_count * i;
    float far_square = 0;
    for (int k = 0; k < a->offset_count; k++, o += 3) {
        const float x = o[0] * ex, y = o[1] * ey, z = o[2] * ez;
        far_square = fmaxf(far_square, x * x + y * y + z * z);
    }
    return sqrtf(far_square) + sigmas * expf(fminf(fmaxf(l[3], fmaxf(l[4], l[5])), 30.0f));
}

static bool is_visible(const view_bounds *b, const float position[3], float reach)
{
    const float d[3] = {position[0] - b->center[0], position[1] - b->center[1], position[2] - b->center[2]};
    const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (square <= reach * reach)
        return true;
    if (b->has_planes) {
        for (int i = 0; i < 4; i++)
            if (b->plane[i][0] * d[0] + b->plane[i][1] * d[1] + b->plane[i][2] * d[2] > reach)
                return false;
        return b->axis[0] * d[0] + b->axis[1] * d[1] + b->axis[2] * d[2] > -reach;
    }
    /* Cone of half angle A, ball seen under half angle B: they meet when the angle between axis and centre is at most A + B. */
    const float length = sqrtf(square), along = (b->axis[0] * d[0] + b->axis[1] * d[1] + b->axis[2] * d[2]) / length;
    const float sin_ball = reach / length, cos_ball = sqrtf(1 - sin_ball * sin_ball);
    const float cos_sum = b->cos_angle * cos_ball - b->sin_angle * sin_ball;
    return b->sin_angle * cos_ball + b->cos_angle * sin_ball < 0 || along >= cos_sum; /* A + B beyond 180 degrees sees everything */
}

typedef struct visible_job {
    const anchors *a;
    const view_bounds *bounds;
    float sigmas;
    uint32_t *out;       /* [count]; block b writes from its own begin */
    uint32_t *out_count; /* per block */
} visible_job;

static void visible_block(size_t block, size_t begin, size_t end, void *context)
{
    const visible_job *job = context;
    uint32_t kept = 0;
    for (size_t i = begin; i < end; i++)
        if (is_visible(job->bounds, job->a->position + 3 * i, anchor_reach(job->a, i, job->sigmas)))
            job->out[begin + kept++] = (uint32_t)i;
    job->out_count[block] = kept;
}

static gbt_status find_visible(frame *f, const anchors *a, const view_bounds *bounds, float alpha_min, gbt_error *err)
{
    const size_t blocks = parallel_block_count(a->count, ANCHOR_BLOCK);
    GBT_TRY(mem_reserve((void **)&f->visible, &f->visible_capacity, 0, a->count + blocks + 1, sizeof *f->visible, "visible anchors", err));
    /* An opaque Gaussian falls to alpha_min at sqrt(2 ln(1 / alpha_min)) std-devs. */
    const float sigmas = 1.001f * sqrtf(2 * logf(1 / alpha_min));
    visible_job job = {a, bounds, sigmas, f->visible, f->visible + a->count};
    parallel_blocks(a->count, ANCHOR_BLOCK, visible_block, &job);
    f->visible_count = 0;
    for (size_t b = 0; b < blocks; b++) {
        memmove(f->visible + f->visible_count, f->visible + b * ANCHOR_BLOCK, job.out_count[b] * sizeof *f->visible);
        f->visible_count += job.out_count[b];
    }
    return GBT_OK;
}

/* ---- render and back --------------------------------------------------------------------------------------------------------------------- */

gbt_status frame_render(frame *f, const anchors *a, const decoder *d, const gbt_camera *camera, const trace_settings *settings, bool keep_tape,
                        gbt_error *err)
{
    double clock = clock_wall();
    f->camera = *camera;
    gbt_camera_half_fov_tan(camera, f->half_fov_tan);
    GBT_TRY(ray_image_from_camera(camera, &f->rays, err));
    f->times.rays = lap(&clock);
    view_bounds bounds;
    find_bounds(&f->rays, camera, &bounds);
    GBT_TRY(find_visible(f, a, &bounds, settings->alpha_min, err));
    f->times.visible = lap(&clock);
    /* A Gaussian below alpha_min is never blended and so has no gradient: it need not be made. */
    GBT_TRY(decode_forward(a, d, bounds.center, f->visible, f->visible_count, settings->alpha_min, &f->gaussians, &f->tape, err));
    f->times.decode = lap(&clock);
    const float reach = fmaxf(fabsf(bounds.center[0]), fmaxf(fabsf(bounds.center[1]), fabsf(bounds.center[2])));
    GBT_TRY(trace_build(&f->scene, &f->gaussians, settings, reach, err));
    f->times.build = lap(&clock);
    if (f->rgb.width != camera->width || f->rgb.height != camera->height) {
        image_free(&f->rgb);
        GBT_TRY(image_alloc(&f->rgb, camera->width, camera->height, 3, err));
    }
    memset(&f->counters, 0, sizeof f->counters);
    GBT_TRY(trace_forward(&f->scene, &f->rays, keep_tape, &f->rgb, NULL, &f->counters, err));
    f->times.trace = lap(&clock);
    return GBT_OK;
}

double frame_volume(const frame *f)
{
    const gaussians *g = &f->gaussians;
    double sum = 0;
    for (size_t i = 0; i < g->count; i++)
        sum += (double)g->scale_x[i] * (double)g->scale_y[i] * (double)g->scale_z[i];
    return g->count > 0 ? sum / (double)g->count : 0;
}

gbt_status frame_backward(frame *f, const anchors *a, const decoder *d, const image *d_image, float volume_weight, anchors *d_anchors,
                          float *d_params, gbt_error *err)
{
    double clock = clock_wall();
    GBT_TRY(trace_backward(&f->scene, &f->rays, d_image, &f->d_gaussians, NULL, NULL, err));
    f->times.adjoint = lap(&clock);
    gaussians *g = &f->gaussians, *dg = &f->d_gaussians;
    const float share = g->count > 0 ? volume_weight / (float)g->count : 0;
    for (size_t i = 0; i < g->count; i++) {
        dg->scale_x[i] += share * g->scale_y[i] * g->scale_z[i];
        dg->scale_y[i] += share * g->scale_x[i] * g->scale_z[i];
        dg->scale_z[i] += share * g->scale_x[i] * g->scale_y[i];
    }
    GBT_TRY(decode_backward(a, d, &f->tape, dg, d_anchors, d_params, err));
    f->times.decode_adjoint = lap(&clock);
    return GBT_OK;
}

void frame_free(frame *f)
{
    ray_image_free(&f->rays);
    mem_free(f->visible);
    gaussians_free(&f->gaussians);
    gaussians_free(&f->d_gaussians);
    decode_tape_free(&f->tape);
    trace_scene_free(&f->scene);
    image_free(&f->rgb);
    memset(f, 0, sizeof *f);
}
