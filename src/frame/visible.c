/* SPDX-License-Identifier: Apache-2.0 */
/* frame/visible.c -- bounds on all rays of a view, and the parts that the rays may hit. */
#include "frame/visible.h"

#include <math.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/clones.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"

enum {
    PART_BLOCK = 1024,
    ROW_GRAIN = 16,
    LANES = 4,
    AXIS_STEP = 7 /* every AXIS_STEP-th ray is used for the mean direction */
};

/* Bounds of the rays to compute: `axes` rotates from world axes to those in which slopes are measured. */
typedef struct bounds_job {
    const ray_image *rays;
    double axes[9], center[3], axis[3];
    double normal[VIEW_PLANES][3];
    struct block_bounds *blocks;
} bounds_job;

typedef struct block_bounds {
    double cos_min, depth_min, low[2], high[2], origin_square, offset[VIEW_PLANES], direction[3]; /* summed */
} block_bounds;

static bool ray_at(const ray_image *rays, size_t i, const double center[3], double start[3], double dir[3])
{
    const float *o = ray_image_origin(rays, i), *d = rays->dir + 3 * i;
    for (int k = 0; k < 3; k++) {
        start[k] = (double)o[k] - center[k];
        dir[k] = (double)d[k];
    }
    return d[0] != 0 || d[1] != 0 || d[2] != 0;
}

/* Minimum and maximum; the second argument when the first is NaN. fmin() would be a function call per ray. */
static inline double least(double a, double b) { return a < b ? a : b; }

static inline double most(double a, double b) { return a > b ? a : b; }

typedef double lanes4 __attribute__((vector_size(32)));
typedef int64_t mask4 __attribute__((vector_size(32)));

/* Vectors of 256 bits: GCC splits wider ones into single values on processors that do not have them. */
#define PICK(mask, yes, no) ((lanes4)(((mask) & (mask4)(yes)) | (~(mask) & (mask4)(no))))
#define KEEP_LEAST(value, bound) bound = PICK((value) < (bound), value, bound)
#define KEEP_MOST(value, bound) bound = PICK((value) > (bound), value, bound)

/* Bounds of rays, in SIMD lanes. */
typedef struct lane_bounds {
    lanes4 cos_min, depth_min, low[2], high[2];
} lane_bounds;

/* Bounds of `count` directions, a multiple of LANES; zero directions are ignored. */
FASTEST_CLONE static void bound_lanes(const float *dir, size_t count, const double axes[9],
                                      const double axis[3], lane_bounds *bounds)
{
    lane_bounds b = *bounds;
    const lanes4 one = {1, 1, 1, 1}, wide = 1e9 * one;
    for (size_t i = 0; i < count; i += LANES) {
        lanes4 x, y, z;
        for (int l = 0; l < LANES; l++) {
            x[l] = (double)dir[3 * (i + (size_t)l)];
            y[l] = (double)dir[3 * (i + (size_t)l) + 1];
            z[l] = (double)dir[3 * (i + (size_t)l) + 2];
        }
        const lanes4 depth = axes[6] * x + axes[7] * y + axes[8] * z;
        const lanes4 along = axis[0] * x + axis[1] * y + axis[2] * z;
        const mask4 is_ray = x * x + y * y + z * z > 0, is_ahead = depth > 0.05;
        const lanes4 part = PICK(is_ahead, depth, one);
        const lanes4 u = (axes[0] * x + axes[1] * y + axes[2] * z) / part,
                     v = (axes[3] * x + axes[4] * y + axes[5] * z) / part;
        KEEP_LEAST(PICK(is_ray, along, one), b.cos_min);
        KEEP_LEAST(PICK(is_ray, depth, one), b.depth_min);
        KEEP_LEAST(PICK(is_ahead, u, wide), b.low[0]);
        KEEP_MOST(PICK(is_ahead, u, -wide), b.high[0]);
        KEEP_LEAST(PICK(is_ahead, v, wide), b.low[1]);
        KEEP_MOST(PICK(is_ahead, v, -wide), b.high[1]);
    }
    *bounds = b;
}

static void bound_directions(size_t block, size_t begin, size_t end, void *context)
{
    const bounds_job *job = context;
    const size_t width = (size_t)job->rays->width, count = (end - begin) * width,
                 whole = count / LANES * LANES;
    const float *dir = job->rays->dir + 3 * begin * width;
    block_bounds *out = &job->blocks[block];
    lane_bounds lanes;
    for (int l = 0; l < LANES; l++) {
        lanes.cos_min[l] = lanes.depth_min[l] = 1;
        lanes.low[0][l] = lanes.low[1][l] = 1e9;
        lanes.high[0][l] = lanes.high[1][l] = -1e9;
    }
    float rest[3 * LANES] = {0};
    memcpy(rest, dir + 3 * whole, 3 * (count - whole) * sizeof *rest);
    bound_lanes(dir, whole, job->axes, job->axis, &lanes);
    bound_lanes(rest, LANES, job->axes, job->axis, &lanes);
    for (int l = 0; l < LANES; l++) {
        out->cos_min = least(lanes.cos_min[l], out->cos_min);
        out->depth_min = least(lanes.depth_min[l], out->depth_min);
        for (int k = 0; k < 2; k++) {
            out->low[k] = least(lanes.low[k][l], out->low[k]);
            out->high[k] = most(lanes.high[k][l], out->high[k]);
        }
    }
    if (job->rays->common_origin)
        return;
    for (size_t i = begin * width; i < end * width; i++) {
        double start[3], d[3];
        if (ray_at(job->rays, i, job->center, start, d))
            out->origin_square = most(dvec_dot(start, start), out->origin_square);
    }
}

static void bound_offsets(size_t block, size_t begin, size_t end, void *context)
{
    const bounds_job *job = context;
    const size_t width = (size_t)job->rays->width;
    for (size_t i = begin * width; i < end * width; i++) {
        double start[3], dir[3];
        if (ray_at(job->rays, i, job->center, start, dir))
            for (int p = 0; p < VIEW_PLANES; p++)
                job->blocks[block].offset[p] =
                    most(dvec_dot(job->normal[p], start), job->blocks[block].offset[p]);
    }
}

static block_bounds no_bounds(void)
{
    block_bounds b = {.cos_min = 1, .depth_min = 1, .low = {1e9, 1e9}, .high = {-1e9, -1e9}};
    for (int p = 0; p < VIEW_PLANES; p++)
        b.offset[p] = -HUGE_VAL;
    return b;
}

static block_bounds join(const block_bounds *blocks, size_t count)
{
    block_bounds all = no_bounds();
    for (size_t i = 0; i < count; i++) {
        const block_bounds *b = &blocks[i];
        all.cos_min = fmin(all.cos_min, b->cos_min);
        all.depth_min = fmin(all.depth_min, b->depth_min);
        all.origin_square = fmax(all.origin_square, b->origin_square);
        for (int k = 0; k < 2; k++) {
            all.low[k] = fmin(all.low[k], b->low[k]);
            all.high[k] = fmax(all.high[k], b->high[k]);
        }
        for (int p = 0; p < VIEW_PLANES; p++)
            all.offset[p] = fmax(all.offset[p], b->offset[p]);
    }
    return all;
}

static void sum_directions(size_t block, size_t begin, size_t end, void *context)
{
    const bounds_job *job = context;
    const size_t width = (size_t)job->rays->width;
    double sum[3] = {0};
    for (size_t i = (begin * width + AXIS_STEP - 1) / AXIS_STEP * AXIS_STEP; i < end * width; i += AXIS_STEP)
        for (size_t k = 0; k < 3; k++)
            sum[k] += (double)job->rays->dir[3 * i + k];
    memcpy(job->blocks[block].direction, sum, sizeof sum);
}

/* The mean direction of every AXIS_STEP-th ray; 0 without rays. */
static void find_axis(bounds_job *job, size_t rows, size_t block_count)
{
    parallel_blocks(rows, ROW_GRAIN, sum_directions, job);
    for (size_t i = 0; i < block_count; i++)
        for (int k = 0; k < 3; k++)
            job->axis[k] += job->blocks[i].direction[k];
    dvec_normalize(job->axis);
}

/* Axes in which slopes are measured: the camera's, or, for given rays, axes with z along their mean
   direction. */
static void find_axes(const ray_shot *shot, const double axis[3], double axes[9])
{
    gbt_camera look = shot->camera;
    const double here[3] = {0, 0, 0}, up[3] = {fabs(axis[0]) < 0.6, fabs(axis[0]) >= 0.6, 0};
    if (shot->given != NULL)
        gbt_camera_look_at(here, axis, up, &look); /* fails for a zero axis; then the rays do not all look
                                                      forward in any axes */
    memcpy(axes, look.rotation, sizeof look.rotation);
}

/* The mean of the ray origins, rounded to float. */
static void find_center(const ray_image *rays, float center[3])
{
    const double none[3] = {0, 0, 0};
    double sum[3] = {0, 0, 0}, start[3], dir[3];
    size_t used = 0;
    if (rays->common_origin) {
        memcpy(center, rays->origin, 3 * sizeof *center);
        return;
    }
    for (size_t i = 0; i < ray_image_count(rays); i++) {
        if (!ray_at(rays, i, none, start, dir))
            continue;
        used++;
        for (int k = 0; k < 3; k++)
            sum[k] += start[k];
    }
    for (int k = 0; k < 3; k++)
        center[k] = used > 0 ? (float)(sum[k] / (double)used) : 0;
}

/* Unit normals of the planes in world axes: right, left, bottom and top slopes, and the plane behind. */
static void find_normals(bounds_job *job, const block_bounds *all, double spread)
{
    for (int k = 0; k < 2; k++)
        for (int sign = 0; sign < 2; sign++) {
            const double slope = sign == 0 ? (all->high[k] + spread) * (1 + 1e-3) + 1e-3
                                           : (all->low[k] - spread) * (1 + 1e-3) - 1e-3;
            double n[3] = {0, 0, 0};
            n[k] = sign == 0 ? 1 : -1;
            n[2] = sign == 0 ? -slope : slope;
            dvec_normalize(n);
            dmat_apply_transposed(job->axes, n, job->normal[2 * k + sign]);
        }
    for (int k = 0; k < 3; k++)
        job->normal[4][k] = -job->axis[k];
}

/* Can slopes be bounded for other points of the aperture? With a plane in focus, all rays of a pixel meet at
   the same depth, in the axes of the pose that exposed it. */
static bool slopes_are_known(const ray_shot *shot, const ray_image *rays, double aperture)
{
    return aperture <= 0 || (camera_is_still(&shot->camera) && camera_lens_looks_forward(&rays->lens));
}

gbt_status view_bounds_find(const ray_shot *shot, const ray_image *rays, view_bounds *out, gbt_error *err)
{
    bounds_job job = {.rays = rays};
    const double aperture = shot->given == NULL ? shot->aperture_radius : 0,
                 spread = aperture > 0 ? aperture / shot->focus_distance : 0,
                 around = aperture + (shot->one_start ? 0.5 * dvec_length(shot->camera.motion) : 0);
    const size_t rows = (size_t)rays->height, count = parallel_block_count(rows, ROW_GRAIN);
    job.blocks = mem_alloc(count, sizeof *job.blocks, "view bounds", err);
    if (job.blocks == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        job.blocks[i] = no_bounds();
    find_axis(&job, rows, count);
    find_axes(shot, job.axis, job.axes);
    find_center(rays, out->center);
    for (int k = 0; k < 3; k++) {
        job.center[k] = (double)out->center[k];
        out->axis[k] = (float)job.axis[k];
    }
    parallel_blocks(rows, ROW_GRAIN, bound_directions, &job);
    block_bounds all = join(job.blocks, count);
    const double widest = fmin(1, fmax(-1, all.cos_min)), sine = sqrt(1 - widest * widest);
    const double cos_spread = sqrt(fmax(0, 1 - spread * spread));
    const bool all_around =
        spread >= 1 || sine * cos_spread + widest * spread < 0; /* the cone exceeds 180 degrees */
    const double cos_wide = all_around ? -1 : widest * cos_spread - sine * spread,
                 cos_min = fmax(cos_wide - 2e-3, -1);
    out->cos_angle = (float)cos_min;
    out->sin_angle = (float)sqrt(fmax(0, 1 - cos_min * cos_min));
    out->plane_count =
        all.depth_min > 0.05 && slopes_are_known(shot, rays, aperture) ? cos_wide > 0 ? 5 : 4 : 0;
    find_normals(&job, &all, spread);
    if (!rays->common_origin) {
        parallel_blocks(rows, ROW_GRAIN, bound_offsets, &job);
        all = join(job.blocks, count);
    }
    mem_free(job.blocks);
    /* Origins were rounded to float. */
    const double rounding = 1e-6 * (dvec_length(job.center) + sqrt(all.origin_square) + around);
    const bool one_origin = rays->common_origin && around <= 0;
    out->origin_radius = one_origin ? 0 : (float)(sqrt(all.origin_square) + around + rounding);
    for (int p = 0; p < VIEW_PLANES; p++) {
        const double farthest = rays->common_origin ? 0 : fmax(all.offset[p], -1e18);
        out->offset[p] = one_origin ? 0 : (float)(farthest + around + rounding);
        for (int k = 0; k < 3; k++)
            out->plane[p][k] = (float)job.normal[p][k];
    }
    return GBT_OK;
}

/* Bounds of the Gaussians of one part: the largest distance of a mean from the centre, and the largest
   std-dev. */
typedef struct part_ball {
    const float *center;
    float farthest, scale;
} part_ball;

static part_ball anchor_ball(const anchors *a, size_t i)
{
    const float *l = a->scale_log + 6 * i;
    const float ex = expf(smaller(l[0], 30.0f)), ey = expf(smaller(l[1], 30.0f)),
                ez = expf(smaller(l[2], 30.0f));
    const float *o = a->offset + 3 * (size_t)a->offset_count * i;
    float far_square = 0;
    for (int k = 0; k < a->offset_count; k++, o += 3) {
        const float x = o[0] * ex, y = o[1] * ey, z = o[2] * ez;
        far_square = larger(x * x + y * y + z * z, far_square);
    }
    return (part_ball){a->position + 3 * i, sqrtf(far_square),
                       expf(smaller(larger(l[3], larger(l[4], l[5])), 30.0f))};
}

static part_ball plain_ball(const gaussian_cloud *cloud, size_t i)
{
    const float *l = cloud->scale_log + 3 * i;
    return (part_ball){cloud->mean + 3 * i, 0, expf(fmaxf(l[0], fmaxf(l[1], l[2])))};
}

/* Radius of a ball around the part that encloses the proxies of all its Gaussians. */
static float reach_of(const part_ball *part, const visible_reach *reach, float pixel_min, const float eye[3])
{
    if (reach->width <= 0)
        return part->farthest + reach->sigmas * part->scale;
    const float d[3] = {part->center[0] - eye[0], part->center[1] - eye[1], part->center[2] - eye[2]};
    const float pixel =
        reach->pixel *
        (reach->parallel ? 1 : sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) + part->farthest);
    return part->farthest + reach->sigmas * (part->scale + reach->width * fmaxf(pixel, pixel_min));
}

static bool is_visible(const view_bounds *b, const float position[3], float reach)
{
    const float d[3] = {position[0] - b->center[0], position[1] - b->center[1], position[2] - b->center[2]};
    for (int i = 0; i < b->plane_count; i++)
        if (!(b->plane[i][0] * d[0] + b->plane[i][1] * d[1] + b->plane[i][2] * d[2] <= b->offset[i] + reach))
            return false; /* also for NaN */
    if (b->plane_count > 0)
        return true;
    /* A ray whose origin is a distance r from the centre can hit the ball only if a ray from the centre hits
       the ball enlarged by r. */
    reach += b->origin_radius;
    const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (square <= reach * reach)
        return true;
    /* Cone of half angle A, ball with angular radius B: they intersect when the angle between the axis and
       the ball's centre is at most A + B. */
    const float length = sqrtf(square),
                along = (b->axis[0] * d[0] + b->axis[1] * d[1] + b->axis[2] * d[2]) / length;
    const float sin_ball = reach / length, cos_ball = sqrtf(1 - sin_ball * sin_ball);
    const float cos_sum = b->cos_angle * cos_ball - b->sin_angle * sin_ball;
    return b->sin_angle * cos_ball + b->cos_angle * sin_ball < 0 ||
           along >= cos_sum; /* with A + B beyond 180 degrees everything is visible */
}

typedef struct visible_job {
    frame_subject subject;
    const view_bounds *bounds;
    const visible_reach *reach;
    const screen_view *screen;
    const visible_dropout *dropout;
    uint32_t *out;       /* [count]; block b writes from its own first element on */
    uint32_t *out_count; /* per block */
} visible_job;

/* The reference's ellipsoid of an anchor: std-devs are the offset scales, axes are not rotated. */
static bool is_on_screen(const screen_view *s, const anchors *a, size_t i)
{
    static const float straight[4] = {1, 0, 0, 0};
    const float *l = a->scale_log + 6 * i, scale[3] = {expf(l[0]), expf(l[1]), expf(l[2])};
    return screen_touches(s, a->position + 3 * i, straight, scale);
}

static bool may_be_met(const visible_job *job, size_t i)
{
    const anchors *a = job->subject.anchors;
    if (job->screen != NULL)
        return is_on_screen(job->screen, a, i);
    /* Quick test: an anchor inside the planes is visible whatever its reach; this decides most anchors. */
    if (job->subject.cloud == NULL && job->bounds->plane_count > 0 &&
        is_visible(job->bounds, a->position + 3 * i, 0))
        return true;
    const part_ball part = job->subject.cloud != NULL ? plain_ball(job->subject.cloud, i) : anchor_ball(a, i);
    const float pixel_min = job->reach->pixel_min != NULL ? job->reach->pixel_min[i] : 0;
    return is_visible(job->bounds, part.center, reach_of(&part, job->reach, pixel_min, job->bounds->center));
}

static bool is_left_out(const visible_dropout *dropout, size_t i)
{
    return dropout != NULL && dropout->share > 0 &&
           rng_uniform(dropout->seed, dropout->draw, i) < dropout->share;
}

static void visible_block(size_t block, size_t begin, size_t end, void *context)
{
    const visible_job *job = context;
    uint32_t kept = 0;
    for (size_t i = begin; i < end; i++)
        if (may_be_met(job, i) && !is_left_out(job->dropout, i))
            job->out[begin + kept++] = (uint32_t)i;
    job->out_count[block] = kept;
}

gbt_status visible_find(frame_subject subject, const view_bounds *bounds, const visible_reach *reach,
                        const screen_view *screen, const visible_dropout *dropout, uint32_t **visible,
                        size_t *count, size_t *capacity, gbt_error *err)
{
    const size_t parts = frame_subject_count(subject), blocks = parallel_block_count(parts, PART_BLOCK);
    GBT_TRY(mem_reserve((void **)visible, capacity, 0, parts + blocks + 1, sizeof **visible, "visible parts",
                        err));
    uint32_t *list = *visible;
    visible_job job = {subject, bounds, reach, screen, dropout, list, list + parts};
    parallel_blocks(parts, PART_BLOCK, visible_block, &job);
    *count = 0;
    for (size_t b = 0; b < blocks; b++) {
        memmove(list + *count, list + b * PART_BLOCK, job.out_count[b] * sizeof *list);
        *count += job.out_count[b];
    }
    return GBT_OK;
}
