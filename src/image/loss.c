/* SPDX-License-Identifier: Apache-2.0 */
/* image/loss.c -- L1 + DSSIM of a rendered image and its gradient, once per training step (Kerbl 2023, eq 7;
   SSIM: Wang 2004, eq 13).

   x, y --> [column pass] --> [row pass, SSIM map, partials] --> [row pass] --> full-size partials
        --> [column pass] --> dL/dx
            \_______________ a row at a time, in cache _______________/

   With p the partial of the map by mu_x (total), q by var_x, r by cov, and G the window:
   dSSIM/dx = G*p + 2 x G*q + y G*r. */
#include "image/metrics.h"

#include <stdbool.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "image/window.h"

enum {
    ROWS_PER_BLOCK = 16,
    CHANNELS = 3,
    MARGIN = WINDOW_RADIUS * CHANNELS,
    BLOCK_ROWS = WINDOW_MOMENTS + WINDOW_PARTIALS + 2
};

typedef struct loss_job {
    const window_kernels *kernels;
    const float *x, *y;         /* zeroed where not valid */
    float *masked_x, *masked_y; /* what x and y point to when there is a mask */
    const float *source_x, *source_y;
    const unsigned char *valid;
    float *d_x;
    float *zeros;            /* one row */
    double *double_zeros;    /* one row */
    double *partials;        /* [WINDOW_PARTIALS][height][count], after the row pass */
    double *rows;            /* per block: BLOCK_ROWS padded rows */
    double *ssim, *l1, *mse; /* sums, one per row */
    double l1_scale, ssim_scale;
    size_t count, padded, width, height;
} loss_job;

static void zero_invalid(const unsigned char *valid, size_t width, double *row)
{
    for (size_t i = 0; i < width; i++)
        if (!valid[i])
            row[CHANNELS * i] = row[CHANNELS * i + 1] = row[CHANNELS * i + 2] = 0;
}

static void mask_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const loss_job *job = context;
    for (size_t i = begin * job->width; i < end * job->width; i++)
        for (size_t c = CHANNELS * i; c < CHANNELS * i + CHANNELS; c++) {
            job->masked_x[c] = job->valid[i] ? job->source_x[c] : 0.0f;
            job->masked_y[c] = job->valid[i] ? job->source_y[c] : 0.0f;
        }
}

static void map_rows(size_t block, size_t begin, size_t end, void *context)
{
    const loss_job *job = context;
    double *const rows = job->rows + block * BLOCK_ROWS * job->padded;
    memset(rows, 0, BLOCK_ROWS * job->padded * sizeof *rows); /* the margins stay zero */
    double *moments[WINDOW_MOMENTS], *partials[WINDOW_PARTIALS];
    for (size_t m = 0; m < WINDOW_MOMENTS; m++)
        moments[m] = rows + m * job->padded + MARGIN;
    for (size_t m = 0; m < WINDOW_PARTIALS; m++)
        partials[m] = rows + (WINDOW_MOMENTS + m) * job->padded + MARGIN;
    double *const map = rows + (WINDOW_MOMENTS + WINDOW_PARTIALS) * job->padded;
    for (size_t row = begin; row < end; row++) {
        const float *x[WINDOW_TAPS], *y[WINDOW_TAPS];
        window_rows(job->x, job->count, job->height, row, job->zeros, x);
        window_rows(job->y, job->count, job->height, row, job->zeros, y);
        job->kernels->moments(x, y, job->count, moments);
        job->kernels->map_partials((const double *const *)moments, job->count, CHANNELS, map, partials);
        if (job->valid != NULL) {
            const unsigned char *valid = job->valid + row * job->width;
            zero_invalid(valid, job->width, map);
            for (size_t m = 0; m < WINDOW_PARTIALS; m++)
                zero_invalid(valid, job->width, partials[m]);
        }
        job->ssim[row] = window_sum(map, job->count);
        double *filtered[WINDOW_PARTIALS];
        for (size_t m = 0; m < WINDOW_PARTIALS; m++)
            filtered[m] = job->partials + (m * job->height + row) * job->count;
        job->kernels->filter((const double *const *)partials, job->count, CHANNELS, filtered);
    }
}

static void gradient_rows(size_t block, size_t begin, size_t end, void *context)
{
    const loss_job *job = context;
    double *const absolute = job->rows + block * BLOCK_ROWS * job->padded, *const square =
                                                                               absolute + job->padded;
    for (size_t row = begin; row < end; row++) {
        const double *partials[WINDOW_PARTIALS][WINDOW_TAPS];
        for (size_t m = 0; m < WINDOW_PARTIALS; m++)
            for (size_t k = 0; k < WINDOW_TAPS; k++) {
                const size_t shifted = row + k;
                const bool is_inside = shifted >= WINDOW_RADIUS && shifted - WINDOW_RADIUS < job->height;
                partials[m][k] =
                    is_inside ? job->partials + (m * job->height + shifted - WINDOW_RADIUS) * job->count
                              : job->double_zeros;
            }
        float *d_x = job->d_x + row * job->count;
        job->kernels->gradient((const double *const(*)[WINDOW_TAPS])partials, job->x + row * job->count,
                               job->y + row * job->count, job->count, job->l1_scale, job->ssim_scale, d_x,
                               absolute, square);
        job->l1[row] = window_sum(absolute, job->count);
        job->mse[row] = window_sum(square, job->count);
        for (size_t i = 0; job->valid != NULL && i < job->width; i++)
            if (!job->valid[row * job->width + i])
                d_x[CHANNELS * i] = d_x[CHANNELS * i + 1] = d_x[CHANNELS * i + 2] = 0.0f;
    }
}

static bool is_size_equal(const image *a, const image *b)
{
    return a->width == b->width && a->height == b->height && a->channels == b->channels;
}

/* Divide the scratch; every part starts on a cache line. Without a buffer this counts what is needed. */
static size_t lay_out(loss_job *job, double *buffer)
{
    size_t used = 0;
    const size_t sizes[] = {
        job->count,                                                                   /* zeros, as float */
        job->count,                                                                   /* double_zeros */
        WINDOW_PARTIALS * job->height * job->count,                                   /* partials */
        parallel_block_count(job->height, ROWS_PER_BLOCK) * BLOCK_ROWS * job->padded, /* rows */
        job->height,
        job->height,
        job->height,                                                 /* ssim, l1, mse */
        job->valid != NULL ? (job->height * job->count + 1) / 2 : 0, /* masked_x, as float */
        job->valid != NULL ? (job->height * job->count + 1) / 2 : 0, /* masked_y, as float */
    };
    double *parts[sizeof sizes / sizeof *sizes] = {0};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        if (buffer != NULL)
            parts[i] = buffer + used;
        used += (sizes[i] + 7) / 8 * 8;
    }
    job->zeros = (float *)parts[0];
    job->double_zeros = parts[1];
    job->partials = parts[2];
    job->rows = parts[3];
    job->ssim = parts[4];
    job->l1 = parts[5];
    job->mse = parts[6];
    job->masked_x = (float *)parts[7];
    job->masked_y = (float *)parts[8];
    return used;
}

gbt_status image_loss(const image *x, const image *y, const unsigned char *valid, double dssim_weight,
                      loss_scratch *scratch, image *d_x, image_loss_result *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (x->channels != CHANNELS || !is_size_equal(x, y) || !is_size_equal(x, d_x))
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "loss: images of %d x %d x %d, %d x %d x %d and %d x %d x %d (wanted equal, 3 channels)",
            x->width, x->height, x->channels, y->width, y->height, y->channels, d_x->width, d_x->height,
            d_x->channels);
    if (!(dssim_weight >= 0 && dssim_weight <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "loss: DSSIM weight %g (wanted 0 to 1)", dssim_weight);
    loss_job job = {.kernels = window_kernels_best(),
                    .source_x = x->pixels,
                    .source_y = y->pixels,
                    .valid = valid,
                    .d_x = d_x->pixels,
                    .width = (size_t)x->width,
                    .height = (size_t)x->height,
                    .count = CHANNELS * (size_t)x->width,
                    .padded = (CHANNELS * (size_t)x->width + 2 * MARGIN + 7) / 8 * 8};
    const size_t wanted = lay_out(&job, NULL);
    GBT_TRY(mem_reserve((void **)&scratch->buffer, &scratch->capacity, 0, wanted, sizeof *scratch->buffer,
                        "loss scratch", err));
    lay_out(&job, scratch->buffer);
    memset(job.zeros, 0, job.count * sizeof *job.zeros);
    memset(job.double_zeros, 0, job.count * sizeof *job.double_zeros);

    size_t pixels = job.width * job.height;
    if (valid != NULL) {
        size_t valid_count = 0;
        for (size_t i = 0; i < pixels; i++)
            valid_count += valid[i] != 0;
        pixels = valid_count;
    }
    if (pixels == 0) {
        memset(d_x->pixels, 0, job.height * job.count * sizeof *d_x->pixels);
        out->ssim = 1;
        return GBT_OK;
    }
    job.x = x->pixels;
    job.y = y->pixels;
    if (valid != NULL) {
        parallel_blocks(job.height, ROWS_PER_BLOCK, mask_rows, &job);
        job.x = job.masked_x;
        job.y = job.masked_y;
    }
    const double values = (double)(CHANNELS * pixels);
    job.l1_scale = (1 - dssim_weight) / values;
    job.ssim_scale = -dssim_weight / values;
    parallel_blocks(job.height, ROWS_PER_BLOCK, map_rows, &job);
    parallel_blocks(job.height, ROWS_PER_BLOCK, gradient_rows, &job);
    out->l1 = window_sum(job.l1, job.height) / values;
    out->ssim = window_sum(job.ssim, job.height) / values;
    out->mse = window_sum(job.mse, job.height) / values;
    out->loss = (1 - dssim_weight) * out->l1 + dssim_weight * (1 - out->ssim);
    return GBT_OK;
}

void loss_scratch_free(loss_scratch *s)
{
    mem_free(s->buffer);
    memset(s, 0, sizeof *s);
}
