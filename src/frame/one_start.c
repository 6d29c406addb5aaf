/* SPDX-License-Identifier: Apache-2.0 */
/* frame/one_start.c -- for each Gaussian, find the image line (row or column) that sees its mean, and shift
   it by the camera's motion at that time. */
#include "frame/one_start.h"

#include <math.h>

#include "base/camera_pose.h"
#include "base/memory.h"
#include "base/parallel.h"

enum {
    MOVE_BLOCK = 1024, /* Gaussians */
    STEPS = 3          /* iterations; each multiplies the error by the share of the image that a point moves
                          by during read-out */
};

typedef struct move_job {
    const gbt_camera *camera;
    const camera_lens *lens;
    const camera_pose *poses; /* [lines] */
    int lines;
    gaussians *g;
} move_job;

/* Image line that exposes a point, or the nearest edge; -1 when the camera does not see it. */
static int find_line(const move_job *job, const double point[3])
{
    const int axis = job->camera->shutter == GBT_CAMERA_SHUTTER_ROWS;
    int line = job->lines / 2;
    for (int step = 0; step < STEPS; step++) {
        double pixel[2];
        if (!camera_pose_pixel(&job->poses[line], job->lens, point, pixel))
            return -1;
        line = (int)fmin(fmax(pixel[axis], 0), job->lines - 1);
    }
    return line;
}

static void move_block(size_t block, size_t begin, size_t end, void *context)
{
    const move_job *job = context;
    const double *middle = job->camera->center;
    float *const mean[3] = {job->g->mean_x, job->g->mean_y, job->g->mean_z};
    (void)block;
    for (size_t i = begin; i < end; i++) {
        const double point[3] = {(double)mean[0][i], (double)mean[1][i], (double)mean[2][i]};
        const int line = find_line(job, point);
        for (int k = 0; k < 3 && line >= 0; k++)
            mean[k][i] = (float)(point[k] - (job->poses[line].center[k] - middle[k]));
    }
}

gbt_status one_start_move(const gbt_camera *camera, const camera_lens *lens, gaussians *g, gbt_error *err)
{
    move_job job = {.camera = camera, .lens = lens, .g = g};
    camera_pose *poses = camera_line_poses(camera, &job.lines, err);
    if (poses == NULL)
        return GBT_ERR_NO_MEMORY;
    job.poses = poses;
    parallel_blocks(g->count, MOVE_BLOCK, move_block, &job);
    mem_free(poses);
    return GBT_OK;
}
