/* SPDX-License-Identifier: Apache-2.0 */
/* trace/rays.c -- the rays through the pixel centres of a camera.

   pixel --[lens]--> start and direction in camera axes
         --[aperture]--> the same point in focus, from another point of the aperture
         --[pose of the row or column]--> start and direction in world axes

   Without an aperture whole rows go through the lens and the pose at once, which is faster. */
#include "trace/rays.h"

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

enum { ROW_GRAIN = 8 };

/* Directions in camera axes are kept for the next picture by the same lens: of several lenses up to about
   this many rays, 24 bytes each; of one lens always. */
static const size_t kept_rays = (size_t)1 << 23;

/* A part of the aperture's disc in polar coordinates: a range of the area within a radius, as a fraction of
   the disc's, and a range of the angle, as a fraction of a turn. */
typedef struct aperture_cell {
    double area_low, area_span, turn_low, turn_span;
} aperture_cell;

typedef struct ray_job {
    const ray_shot *shot;
    uint64_t sample;
    camera_lens lens;
    bool pinhole;
    const double *column_u;     /* [width] (x + 0.5 - cx) / fx; pinhole and orthographic only */
    double *lens_dir;           /* ray_lens.dir; other lenses only */
    const camera_pose *poses;   /* [1], or one for each row or column */
    gbt_camera_shutter shutter; /* GBT_CAMERA_SHUTTER_GLOBAL also for a camera that does not move */
    aperture_cell cell;
    float *origin; /* NULL: one for all */
    float *dir;
} ray_job;

FASTEST_CLONE static void pinhole_row(const ray_job *job, const double *r, int row, float *restrict dir)
{
    const double v = (row + 0.5 - job->lens.cy) / job->lens.fy;
    const int width = job->shot->camera.width;
    /* Transposed rotation times (u, v, 1): only u changes along a row. */
    const double base_x = v * r[3] + r[6], base_y = v * r[4] + r[7], base_z = v * r[5] + r[8],
                 base_length2 = v * v + 1;
    for (int i = 0; i < width; i++) {
        const double u = job->column_u[i], scale = 1 / sqrt(u * u + base_length2);
        dir[3 * i] = (float)((u * r[0] + base_x) * scale);
        dir[3 * i + 1] = (float)((u * r[1] + base_y) * scale);
        dir[3 * i + 2] = (float)((u * r[2] + base_z) * scale);
    }
}

static void orthographic_row(const ray_job *job, const camera_pose *at, int row, float *origin, float *dir)
{
    const double *r = at->rotation, v = (row + 0.5 - job->lens.cy) / job->lens.fy;
    const float forward[3] = {(float)r[6], (float)r[7], (float)r[8]};
    const double base[3] = {at->center[0] + v * r[3], at->center[1] + v * r[4], at->center[2] + v * r[5]};
    for (int i = 0; i < job->shot->camera.width; i++)
        for (int k = 0; k < 3; k++) {
            origin[3 * i + k] = (float)(base[k] + job->column_u[i] * r[k]);
            dir[3 * i + k] = forward[k];
        }
}

static void round3(const double from[3], float to[3])
{
    to[0] = (float)from[0];
    to[1] = (float)from[1];
    to[2] = (float)from[2];
}

/* From camera to world axes, for lenses whose directions are kept. */
static void turn_row(const ray_job *job, const double *rotation, const double *lens_dir, float *dir)
{
    for (int i = 0; i < job->shot->camera.width; i++, lens_dir += 3, dir += 3) {
        double d[3];
        dmat_apply_transposed(rotation, lens_dir, d);
        round3(d, dir);
    }
}

static void repeat_origin(const double center[3], int width, float *origin)
{
    float start[3];
    round3(center, start);
    for (int i = 0; i < width; i++, origin += 3)
        memcpy(origin, start, sizeof start);
}

/* Two directions at right angles to the unit vector d and to each other. */
static void span_disc(const double d[3], double across[3], double along[3])
{
    const double axis[3] = {fabs(d[0]) < 0.6, fabs(d[0]) >= 0.6, 0};
    dvec_cross(d, axis, across);
    dvec_normalize(across);
    dvec_cross(d, across, along);
}

/* Moves the start of a ray (camera axes) to a point on the aperture and turns it so that it still meets its
   point in focus. `dir` need not be a unit vector on entry. */
static void open_aperture(const ray_job *job, uint64_t pixel, double start[3], double dir[3])
{
    uint32_t words[4];
    rng_philox(job->shot->seed, job->sample, pixel, words);
    const double radius =
        job->shot->aperture_radius * sqrt(job->cell.area_low + job->cell.area_span * (words[0] * 0x1p-32));
    const double angle = 2 * PI * (job->cell.turn_low + job->cell.turn_span * (words[1] * 0x1p-32)),
                 a = radius * cos(angle), b = radius * sin(angle);
    const double focus = job->shot->focus_distance;
    double across[3] = {1, 0, 0}, along[3] = {0, 1, 0}, reach = focus;
    if (camera_lens_looks_forward(&job->lens))
        reach /= dir[2];
    else
        span_disc(dir, across, along);
    for (int k = 0; k < 3; k++) {
        const double shift = a * across[k] + b * along[k];
        dir[k] = dir[k] * reach - shift;
        start[k] += shift;
    }
    dvec_normalize(dir);
}

/* One ray at a time: for an aperture, or a pose for each column. */
static void any_row(const ray_job *job, int row, float *origin, float *dir)
{
    const ray_shot *shot = job->shot;
    const int width = shot->camera.width;
    const double v = (row + 0.5 - job->lens.cy) / job->lens.fy;
    const bool opens = shot->aperture_radius > 0;
    for (int i = 0; i < width; i++, dir += 3) {
        const size_t pixel = (size_t)row * (size_t)width + (size_t)i;
        const camera_pose *at = job->poses + (job->shutter == GBT_CAMERA_SHUTTER_ROWS      ? row
                                              : job->shutter == GBT_CAMERA_SHUTTER_COLUMNS ? i
                                                                                           : 0);
        double start[3] = {0, 0, 0}, d[3] = {0, 0, 1};
        if (job->lens.kind == LENS_ORTHOGRAPHIC) {
            start[0] = job->column_u[i];
            start[1] = v;
        } else if (job->pinhole) {
            d[0] = job->column_u[i];
            d[1] = v;
        } else
            memcpy(d, job->lens_dir + 3 * pixel, sizeof d);
        if (d[0] != 0 || d[1] != 0 || d[2] != 0) {
            if (opens)
                open_aperture(job, pixel, start, d);
            else
                dvec_normalize(d);
        }
        dmat_apply_transposed(at->rotation, start, start);
        dmat_apply_transposed(at->rotation, d, d);
        for (int k = 0; k < 3; k++) {
            if (origin != NULL)
                origin[3 * i + k] = (float)(at->center[k] + start[k]);
            dir[k] = (float)d[k];
        }
    }
}

static void unproject_rows(size_t block, size_t begin, size_t end, void *context)
{
    const ray_job *job = context;
    (void)block;
    const int width = job->shot->camera.width;
    for (size_t row = begin; row < end; row++)
        camera_lens_unproject_row(&job->lens, (double)row + 0.5, width,
                                  job->lens_dir + 3 * row * (size_t)width);
}

static void make_rows(size_t block, size_t begin, size_t end, void *context)
{
    const ray_job *job = context;
    const ray_shot *shot = job->shot;
    const int width = shot->camera.width;
    (void)block;
    for (size_t row = begin; row < end; row++) {
        const size_t at = 3 * row * (size_t)width;
        const camera_pose *stand = job->poses + (job->shutter == GBT_CAMERA_SHUTTER_ROWS ? row : 0);
        float *origin = job->origin == NULL ? NULL : job->origin + at, *dir = job->dir + at;
        if (shot->aperture_radius > 0 || job->shutter == GBT_CAMERA_SHUTTER_COLUMNS) {
            any_row(job, (int)row, origin, dir);
            continue;
        }
        if (job->lens.kind == LENS_ORTHOGRAPHIC) {
            orthographic_row(job, stand, (int)row, origin, dir);
            continue;
        }
        if (job->pinhole)
            pinhole_row(job, stand->rotation, (int)row, dir);
        else
            turn_row(job, stand->rotation, job->lens_dir + at, dir);
        if (origin != NULL)
            repeat_origin(stand->center, width, origin);
    }
}

static bool same_lens(const gbt_camera *a, const gbt_camera *b)
{
    return a->model == b->model && a->width == b->width && a->height == b->height &&
           memcmp(a->params, b->params, sizeof a->params) == 0;
}

static bool pose_is_finite(const gbt_camera *camera)
{
    for (int i = 0; i < 9; i++)
        if (!isfinite(camera->rotation[i]))
            return false;
    for (int i = 0; i < 3; i++)
        if (!isfinite((float)camera->center[i]))
            return false;
    for (int i = 0; i < 6; i++)
        if (!isfinite((float)camera->motion[i]))
            return false;
    return true;
}

/* An upper bound of the distance of the rays' origins from 0; not finite when any input is not. */
static double origin_bound(const ray_shot *shot, const camera_lens *lens)
{
    double corner[3], far = 0;
    for (int i = 0; i < 4; i++) {
        camera_lens_origin(lens, i % 2 * shot->camera.width, i / 2 * shot->camera.height, corner);
        far = fmax(far, dvec_length(corner));
    }
    return far + shot->aperture_radius + dvec_length(shot->camera.center) + dvec_length(shot->camera.motion);
}

static gbt_status check_shot(const ray_shot *shot, camera_lens *lens, gbt_error *err)
{
    const gbt_camera *camera = &shot->camera;
    if (camera->width < 1 || camera->height < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: size %d x %d (wanted both >= 1)", camera->width,
                         camera->height);
    if (!camera_lens_prepare(camera, lens))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "camera: model %d has unusable parameters (wanted a known model, finite values, "
                         "focal length > 0, shape parameters that the model allows)",
                         (int)camera->model);
    if ((unsigned)camera->shutter > GBT_CAMERA_SHUTTER_COLUMNS)
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: shutter %d (wanted 0 to %d)", (int)camera->shutter,
                         GBT_CAMERA_SHUTTER_COLUMNS);
    if (!pose_is_finite(camera))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "camera: the rotation, centre or motion has a value that is not finite");
    if (!dmat_is_rotation(camera->rotation, 1e-3))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "camera: the matrix is no rotation (wanted orthonormal within 1e-3, no reflection)");
    if (!(shot->aperture_radius >= 0 && isfinite(shot->aperture_radius)))
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: aperture radius %g (wanted >= 0)",
                         shot->aperture_radius);
    if (shot->aperture_radius > 0 && !(shot->focus_distance > 0 && isfinite(shot->focus_distance)))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "camera: focus distance %g (wanted > 0, as there is an aperture)",
                         shot->focus_distance);
    if (ray_shot_sample_count(shot) < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: %d samples (wanted >= 1)", shot->samples);
    if (!(origin_bound(shot, lens) < RAY_ORIGIN_LIMIT))
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: rays start more than %g from the origin",
                         RAY_ORIGIN_LIMIT);
    return GBT_OK;
}

gbt_status ray_shot_check(const ray_shot *shot, gbt_error *err)
{
    camera_lens lens;
    return shot->given != NULL ? GBT_OK : check_shot(shot, &lens, err);
}

/* Frees all arrays but those of the lenses. */
static void free_rays(ray_image *rays)
{
    float **const all[] = {&rays->origin, &rays->dir, &rays->far, &rays->near, &rays->T_front};
    for (int i = 0; i < 5; i++) {
        mem_free(*all[i]);
        *all[i] = NULL;
    }
}

gbt_status ray_image_reserve(ray_image *out, int width, int height, bool common_origin, gbt_error *err)
{
    if (out->dir != NULL && out->common_origin == common_origin && out->width == width &&
        out->height == height)
        return GBT_OK;
    free_rays(out);
    const size_t count = (size_t)width * (size_t)height;
    out->origin = mem_alloc(common_origin ? 1 : count, 3 * sizeof *out->origin, "rays", err);
    out->dir = out->origin == NULL ? NULL : mem_alloc(count, 3 * sizeof *out->dir, "rays", err);
    if (out->dir == NULL) {
        ray_image_free(out);
        return GBT_ERR_NO_MEMORY;
    }
    out->width = width;
    out->height = height;
    out->common_origin = common_origin;
    return GBT_OK;
}

static size_t lens_count(const ray_lens *lens)
{
    return (size_t)lens->camera.width * (size_t)lens->camera.height;
}

static void free_lens(ray_lens *lens)
{
    mem_free(lens->dir);
    lens->dir = NULL;
}

/* Directions in camera axes, unless they have been kept from an earlier pose of the same lens. */
static gbt_status unproject_lens(ray_job *job, ray_image *rays, gbt_error *err)
{
    const gbt_camera *camera = &job->shot->camera;
    for (int i = 0; i < RAY_LENSES; i++)
        if (rays->lenses[i].dir != NULL && same_lens(camera, &rays->lenses[i].camera)) {
            job->lens_dir = rays->lenses[i].dir;
            return GBT_OK;
        }
    const size_t count = ray_image_count(rays), fit = smaller_size(kept_rays / count, RAY_LENSES);
    const int places = fit > 1 ? (int)fit : 1;
    for (int i = places; i < RAY_LENSES; i++)
        free_lens(&rays->lenses[i]);
    const int place = rays->next_lens % places;
    ray_lens *lens = &rays->lenses[place];
    if (lens_count(lens) != count)
        free_lens(lens);
    if (lens->dir == NULL)
        lens->dir = mem_alloc(count, 3 * sizeof *lens->dir, "rays", err);
    if (lens->dir == NULL)
        return GBT_ERR_NO_MEMORY;
    rays->next_lens = (place + 1) % places;
    lens->camera = *camera;
    job->lens_dir = lens->dir;
    parallel_blocks((size_t)camera->height, ROW_GRAIN, unproject_rows, job);
    return GBT_OK;
}

static double *make_columns(const ray_job *job, gbt_error *err)
{
    const int width = job->shot->camera.width;
    double *u = mem_alloc((size_t)width, sizeof *u, "rays", err);
    for (int i = 0; i < width && u != NULL; i++)
        u[i] = (i + 0.5 - job->lens.cx) / job->lens.fx;
    return u;
}

/* Cuts the disc into m concentric rings, and these into `count` cells of the same area that are about as long
   as wide (m^2 pi = count): ring j ends with cell count ((j + 1) / m)^2. All pixels take a sample in the same
   cell, so that neighbouring rays stay close. */
static aperture_cell find_cell(int sample, int count)
{
    const int rings = (int)fmax(1, floor(sqrt(count / PI) + 0.5));
    int first = 0, end = 0;
    for (int j = 0; end <= sample; j++) {
        first = end;
        end = (int)floor(count * ((j + 1.0) / rings) * ((j + 1.0) / rings) + 0.5);
    }
    const double cells = end - first;
    return (aperture_cell){(double)first / count, cells / count, (sample - first) / cells, 1 / cells};
}

static gbt_status copy_given(const ray_image *given, ray_image *out, gbt_error *err)
{
    GBT_TRY(ray_image_reserve(out, given->width, given->height, given->common_origin, err));
    const size_t count = ray_image_count(given);
    memcpy(out->origin, given->origin, (given->common_origin ? 1 : count) * 3 * sizeof *out->origin);
    memcpy(out->dir, given->dir, count * 3 * sizeof *out->dir);
    memset(&out->lens, 0, sizeof out->lens);
    return GBT_OK;
}

static gbt_status make_rays(const ray_shot *shot, int sample, ray_image *out, gbt_error *err)
{
    ray_job job = {.shot = shot, .sample = (uint64_t)sample};
    if (!camera_is_still(&shot->camera))
        job.shutter = shot->camera.shutter;
    GBT_TRY(check_shot(shot, &job.lens, err));
    if (sample < 0 || sample >= ray_shot_sample_count(shot))
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: sample %d (wanted 0 to %d)", sample,
                         ray_shot_sample_count(shot) - 1);
    job.cell = find_cell(sample, ray_shot_sample_count(shot));
    const bool flat = job.lens.kind == LENS_ORTHOGRAPHIC;
    const bool common_origin = !flat && (job.shutter == GBT_CAMERA_SHUTTER_GLOBAL || shot->one_start) &&
                               !(shot->aperture_radius > 0);
    job.pinhole = job.lens.kind == LENS_PERSPECTIVE && !job.lens.radial && !job.lens.extra;
    GBT_TRY(ray_image_reserve(out, shot->camera.width, shot->camera.height, common_origin, err));
    out->lens = job.lens;
    if (!flat && !job.pinhole)
        GBT_TRY(unproject_lens(&job, out, err));
    int pose_count;
    camera_pose *poses = camera_line_poses(&shot->camera, &pose_count, err);
    double *column_u = poses == NULL ? NULL : make_columns(&job, err);
    if (column_u != NULL) {
        if (common_origin)
            round3(shot->camera.center, out->origin);
        job.poses = poses;
        job.column_u = column_u;
        job.origin = common_origin ? NULL : out->origin;
        job.dir = out->dir;
        parallel_blocks((size_t)shot->camera.height, ROW_GRAIN, make_rows, &job);
    }
    mem_free(poses);
    mem_free(column_u);
    return column_u == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
}

gbt_status ray_image_from_shot(const ray_shot *shot, int sample, ray_image *out, gbt_error *err)
{
    const gbt_status status =
        shot->given != NULL ? copy_given(shot->given, out, err) : make_rays(shot, sample, out, err);
    if (status != GBT_OK)
        ray_image_free(out);
    return status;
}

gbt_status ray_image_from_camera(const gbt_camera *camera, ray_image *out, gbt_error *err)
{
    const ray_shot shot = ray_shot_of(camera);
    return ray_image_from_shot(&shot, 0, out, err);
}

float ray_image_reach(const ray_image *rays)
{
    const size_t count = 3 * (rays->common_origin ? 1 : ray_image_count(rays));
    float reach = 0;
    for (size_t i = 0; i < count; i++)
        reach = fmaxf(reach, fabsf(rays->origin[i]));
    return reach;
}

void ray_image_free(ray_image *rays)
{
    free_rays(rays);
    for (int i = 0; i < RAY_LENSES; i++)
        free_lens(&rays->lenses[i]);
    memset(rays, 0, sizeof *rays);
}
