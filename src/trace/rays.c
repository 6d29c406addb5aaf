/* trace/rays.c -- the rays through the pixel centres of a camera. */
#include "trace/rays.h"

#include <math.h>
#include <string.h>

#include "base/camera_lens.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { ROW_GRAIN = 8 };

typedef struct ray_job {
    const gbt_camera *camera;
    camera_lens lens;
    const double *column_u; /* [width] (x + 0.5 - cx) / fx; pinhole only */
    double *camera_dir;     /* other lenses only */
    float *dir;
} ray_job;

static void pinhole_row(const ray_job *job, int row, float *dir)
{
    const double *r = job->camera->rotation, v = (row + 0.5 - job->lens.cy) / job->lens.fy;
    const int width = job->camera->width;
    /* Transposed rotation times (u, v, 1): only u changes along a row. */
    const double base_x = v * r[3] + r[6], base_y = v * r[4] + r[7], base_z = v * r[5] + r[8], base_length2 = v * v + 1;
    for (int i = 0; i < width; i++) {
        const double u = job->column_u[i], scale = 1 / sqrt(u * u + base_length2);
        dir[3 * i] = (float)((u * r[0] + base_x) * scale);
        dir[3 * i + 1] = (float)((u * r[1] + base_y) * scale);
        dir[3 * i + 2] = (float)((u * r[2] + base_z) * scale);
    }
}

static void unproject_row(const ray_job *job, int row, double *camera_dir)
{
    for (int i = 0; i < job->camera->width; i++, camera_dir += 3)
        if (!camera_lens_unproject(&job->lens, i + 0.5, row + 0.5, camera_dir))
            memset(camera_dir, 0, 3 * sizeof *camera_dir);
}

static void turn_row(const ray_job *job, const double *camera_dir, float *dir)
{
    for (int i = 0; i < job->camera->width; i++, camera_dir += 3, dir += 3) {
        double d[3];
        dmat_apply_transposed(job->camera->rotation, camera_dir, d);
        dir[0] = (float)d[0], dir[1] = (float)d[1], dir[2] = (float)d[2];
    }
}

static void unproject_rows(size_t block, size_t begin, size_t end, void *context)
{
    const ray_job *job = context;
    (void)block;
    for (size_t row = begin; row < end; row++)
        unproject_row(job, (int)row, job->camera_dir + 3 * row * (size_t)job->camera->width);
}

static void make_rows(size_t block, size_t begin, size_t end, void *context)
{
    const ray_job *job = context;
    (void)block;
    for (size_t row = begin; row < end; row++) {
        const size_t at = 3 * row * (size_t)job->camera->width;
        if (job->camera_dir != NULL)
            turn_row(job, job->camera_dir + at, job->dir + at);
        else
            pinhole_row(job, (int)row, job->dir + at);
    }
}

static bool same_lens(const gbt_camera *a, const gbt_camera *b)
{
    return a->model == b->model && a->width == b->width && a->height == b->height && memcmp(a->params, b->params, sizeof a->params) == 0;
}

static bool pose_is_finite(const gbt_camera *camera)
{
    for (int i = 0; i < 9; i++)
        if (!isfinite(camera->rotation[i]))
            return false;
    for (int i = 0; i < 3; i++)
        if (!isfinite((float)camera->center[i]))
            return false;
    return true;
}

static gbt_status check_camera(const gbt_camera *camera, camera_lens *lens, gbt_error *err)
{
    if (camera->width < 1 || camera->height < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: size %d x %d (wanted both >= 1)", camera->width, camera->height);
    if (!camera_lens_prepare(camera, lens))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "camera: model %d has unusable parameters (wanted a known model, finite values, focal length > 0)",
                         (int)camera->model);
    if (!pose_is_finite(camera))
        return base_fail(err, GBT_ERR_ARGUMENT, "camera: the pose is not finite");
    return GBT_OK;
}

/* Arrays for width x height rays of one origin. */
static gbt_status reserve(ray_image *rays, int width, int height, gbt_error *err)
{
    if (rays->common_origin && rays->width == width && rays->height == height)
        return GBT_OK;
    ray_image_free(rays);
    rays->origin = mem_alloc(3, sizeof *rays->origin, "rays", err);
    rays->dir = rays->origin == NULL ? NULL : mem_alloc((size_t)width * (size_t)height, 3 * sizeof *rays->dir, "rays", err);
    if (rays->dir == NULL)
        return GBT_ERR_NO_MEMORY;
    rays->width = width, rays->height = height, rays->common_origin = true;
    return GBT_OK;
}

/* Directions in camera axes, unless they are there from the pose before. */
static gbt_status unproject_lens(const gbt_camera *camera, ray_job *job, ray_image *rays, gbt_error *err)
{
    if (rays->camera_dir == NULL || !same_lens(camera, &rays->camera)) {
        mem_free(rays->camera_dir);
        rays->camera_dir = mem_alloc(ray_image_count(rays), 3 * sizeof *rays->camera_dir, "rays", err);
        if (rays->camera_dir == NULL)
            return GBT_ERR_NO_MEMORY;
        rays->camera = *camera;
        job->camera_dir = rays->camera_dir;
        parallel_blocks((size_t)camera->height, ROW_GRAIN, unproject_rows, job);
    }
    job->camera_dir = rays->camera_dir;
    return GBT_OK;
}

gbt_status ray_image_from_camera(const gbt_camera *camera, ray_image *out, gbt_error *err)
{
    ray_job job = {.camera = camera};
    double *column_u = NULL;
    gbt_status status = check_camera(camera, &job.lens, err);
    if (status == GBT_OK)
        status = reserve(out, camera->width, camera->height, err);
    const bool pinhole = job.lens.kind == LENS_PERSPECTIVE && !job.lens.radial && !job.lens.extra;
    if (status == GBT_OK && !pinhole)
        status = unproject_lens(camera, &job, out, err);
    if (status == GBT_OK && pinhole) {
        column_u = mem_alloc((size_t)camera->width, sizeof *column_u, "rays", err);
        status = column_u == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
        for (int i = 0; i < camera->width && column_u != NULL; i++)
            column_u[i] = (i + 0.5 - job.lens.cx) / job.lens.fx;
    }
    if (status == GBT_OK) {
        for (int i = 0; i < 3; i++)
            out->origin[i] = (float)camera->center[i];
        job.column_u = column_u, job.dir = out->dir;
        parallel_blocks((size_t)camera->height, ROW_GRAIN, make_rows, &job);
    } else {
        ray_image_free(out);
    }
    mem_free(column_u);
    return status;
}

void ray_image_free(ray_image *rays)
{
    mem_free(rays->origin);
    mem_free(rays->dir);
    mem_free(rays->camera_dir);
    memset(rays, 0, sizeof *rays);
}
