/* SPDX-License-Identifier: Apache-2.0 */
/* image/ssim.c -- mean SSIM of two images (Wang 2004, eq 13, with the borders of Scaffold-GS and 3DGS). */
#include "image/metrics.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "image/window.h"

enum { ROWS_PER_BLOCK = 16 };

typedef struct ssim_job {
    const window_kernels *kernels;
    const image *x, *y;
    const float *zeros;   /* one row */
    double *rows;         /* per block: WINDOW_MOMENTS padded rows, one row of the map */
    double *sums;         /* one per row */
    size_t count, padded; /* values in a row, doubles in a padded row */
    size_t skip;          /* values left out at both ends of a row of the map */
} ssim_job;

static void ssim_rows(size_t block, size_t begin, size_t end, void *context)
{
    const ssim_job *job = context;
    const size_t step = (size_t)job->x->channels, margin = WINDOW_RADIUS * step;
    double *const rows = job->rows + block * (WINDOW_MOMENTS + 1) * job->padded, *const map =
                                                                                     rows + WINDOW_MOMENTS *
                                                                                                job->padded;
    memset(rows, 0, WINDOW_MOMENTS * job->padded * sizeof *rows);
    double *moments[WINDOW_MOMENTS];
    for (size_t m = 0; m < WINDOW_MOMENTS; m++)
        moments[m] = rows + m * job->padded + margin;
    for (size_t row = begin; row < end; row++) {
        const float *x[WINDOW_TAPS], *y[WINDOW_TAPS];
        window_rows(job->x->pixels, job->count, (size_t)job->x->height, row, job->zeros, x);
        window_rows(job->y->pixels, job->count, (size_t)job->x->height, row, job->zeros, y);
        job->kernels->moments(x, y, job->count, moments);
        job->kernels->map((const double *const *)moments, job->count, step, map);
        job->sums[row] = window_sum(map + job->skip, job->count - 2 * job->skip);
    }
}

/* Mean over the pixels that are at least `border` pixels from all four sides. */
static gbt_status mean_ssim(const image *a, const image *b, size_t border, double *ssim, gbt_error *err)
{
    *ssim = (double)NAN;
    if (a->width != b->width || a->height != b->height || a->channels != b->channels ||
        2 * border >= (size_t)a->width || 2 * border >= (size_t)a->height)
        return GBT_OK;
    const size_t count = (size_t)a->width * (size_t)a->channels, height = (size_t)a->height;
    const size_t padded = count + 2 * WINDOW_RADIUS * (size_t)a->channels;
    const size_t row_doubles = parallel_block_count(height, ROWS_PER_BLOCK) * (WINDOW_MOMENTS + 1) * padded;
    double *rows = mem_alloc(row_doubles + height, sizeof *rows, "SSIM rows", err);
    float *zeros = rows != NULL ? mem_calloc(count, sizeof *zeros, "SSIM rows", err) : NULL;
    if (zeros != NULL) {
        ssim_job job = {window_kernels_best(),       a, b, zeros, rows, rows + row_doubles, count, padded,
                        border * (size_t)a->channels};
        parallel_blocks(height, ROWS_PER_BLOCK, ssim_rows, &job);
        *ssim = window_sum(job.sums + border, height - 2 * border) /
                ((double)(count - 2 * job.skip) * (double)(height - 2 * border));
    }
    const gbt_status status = zeros != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    mem_free(rows);
    mem_free(zeros);
    return status;
}

gbt_status metric_ssim(const image *a, const image *b, double *ssim, gbt_error *err)
{
    return mean_ssim(a, b, 0, ssim, err);
}

gbt_status metric_ssim_interior(const image *a, const image *b, double *ssim, gbt_error *err)
{
    return mean_ssim(a, b, WINDOW_RADIUS, ssim, err);
}
