/* SPDX-License-Identifier: Apache-2.0 */
/* train/finest_pixel.c -- the smallest pixel that any training camera has at each anchor. */
#include "train/finest_pixel.h"

#include <math.h>

#include "base/parallel.h"
#include "trace/footprint.h"
#include "train/camera_sees.h"

enum { ANCHOR_BLOCK = 1024 };

typedef struct finest_pixel_job {
    const anchors *a;
    const gbt_camera *cameras;
    size_t camera_count;
    float *out;
} finest_pixel_job;

static void finest_pixel_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const finest_pixel_job *job = context;
    for (size_t i = begin; i < end; i++)
        job->out[i] = INFINITY;
    for (size_t c = 0; c < job->camera_count; c++) {
        const footprint_view view = footprint_view_of(&job->cameras[c]);
        for (size_t i = begin; i < end; i += FOOTPRINT_LANES) {
            const size_t count = end - i < FOOTPRINT_LANES ? end - i : FOOTPRINT_LANES;
            double point[3][FOOTPRINT_LANES] = {{0}}, pixel[FOOTPRINT_LANES];
            for (size_t lane = 0; lane < count; lane++)
                for (size_t k = 0; k < 3; k++)
                    point[k][lane] = (double)job->a->position[3 * (i + lane) + k];
            footprint_pixels(&view, point, pixel);
            for (size_t lane = 0; lane < count; lane++) {
                const float size = (float)pixel[lane], *p = job->a->position + 3 * (i + lane);
                if (size < job->out[i + lane] && camera_sees(&job->cameras[c], p, NULL))
                    job->out[i + lane] = size;
            }
        }
    }
    for (size_t i = begin; i < end; i++)
        job->out[i] = isfinite(job->out[i]) ? job->out[i] : 0;
}

void finest_pixel_find(const anchors *a, const gbt_camera *cameras, size_t camera_count, float *out)
{
    finest_pixel_job job = {a, cameras, camera_count, out};
    parallel_blocks(a->count, ANCHOR_BLOCK, finest_pixel_block, &job);
}
