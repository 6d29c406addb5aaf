/* SPDX-License-Identifier: Apache-2.0 */
/* image/loss.c -- L1 + DSSIM of a rendered image and its gradient, once per training step (Kerbl 2023, eq 7;
   SSIM: Wang 2004, eq 13).

   x, y --> [row pass] --> [column pass, SSIM map, partials] --> [row pass] --> [column pass] --> dL/dx
            \_________________ a few rows of one tile at a time, in cache _________________/

   With p the partial of the map by mu_x (total), q by var_x, r by cov, and G the window:
   dSSIM/dx = G*p + 2 x G*q + y G*r.

   The image is divided into tiles that do not depend on the number of threads. A tile computes the SSIM map
   for WINDOW_RADIUS more pixels than it owns on all sides, from moments of another WINDOW_RADIUS more, so
   that tiles are independent of each other. */
#include "image/metrics.h"

#include <math.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "image/loss_rows.h"
#include "image/window.h"

enum {
    CHANNELS = LOSS_CHANNELS,
    RADIUS = WINDOW_RADIUS,
    SEGMENT_MAX = 32, /* pixels; both ring buffers of rows then fit the second-level cache */
    TILE_WIDTH = LOSS_LANES * SEGMENT_MAX,    /* pixels */
    TILE_OWNED = TILE_WIDTH - 2 * RADIUS,     /* pixels whose gradient the tile computes */
    BAND_ROWS = 128,                          /* maximum number owned by a tile */
    BAND_LEAST = 40,                          /* with fewer, a tile would compute more halo rows than own
                                                 rows */
    TILES_WANTED = 4,                         /* for a small image */
    ROW_MAX = TILE_WIDTH * CHANNELS,          /* values */
    ROW_STRIDE = ROW_MAX + LOSS_STEP,         /* not a multiple of the page size, so that rows use different
                                                 cache sets */
    WIDE_STRIDE = ROW_MAX + 2 * LOSS_MARGIN,  /* a row with both margins */
    RING = 16,                                /* rows: LOSS_SPAN rounded up to whole groups */
    AHEAD = (RING - LOSS_GROUP) / LOSS_GROUP, /* number of groups that a pass runs ahead of the next one */
    COUNT_BLOCK = 1 << 16,                    /* pixels */
    SUMS = 3
};

/* Row buffers of the tile that a thread works on. */
typedef struct loss_buffers {
    atomic_flag taken;
    double moments[LOSS_MOMENTS][RING][ROW_STRIDE], partials[LOSS_PARTIALS][RING][ROW_STRIDE];
    double wide[LOSS_GROUP * LOSS_PARTIALS][WIDE_STRIDE];
    double sums[SUMS][ROW_STRIDE]; /* of the SSIM map, |x - y| and (x - y)^2, one per position in a row */
    double inside[ROW_STRIDE], nothing[ROW_STRIDE], counted[LOSS_GROUP][ROW_STRIDE];
    float x[LOSS_GROUP][ROW_STRIDE], y[LOSS_GROUP][ROW_STRIDE], d_x[LOSS_GROUP][ROW_STRIDE];
    float pixels_x[ROW_MAX + 2 * LOSS_STEP], pixels_y[ROW_MAX + 2 * LOSS_STEP];
} loss_buffers;

typedef struct loss_job {
    const loss_kernels *kernels;
    const float *x, *y;
    const unsigned char *valid;
    float *d_x;
    double l1_scale, ssim_scale;
    size_t width, height, across, tile_count, band_rows;
    double *sums; /* [SUMS][tile_count] */
    loss_buffers *buffer_sets;
    size_t set_count;
} loss_job;

typedef struct loss_tile {
    const loss_job *job;
    loss_buffers *buffers;
    ptrdiff_t first;      /* column of its first pixel; may be left of the image */
    size_t segment;       /* pixels per lane */
    size_t count;         /* values in a row */
    size_t begin, end;    /* rows that it owns */
    size_t owned, column; /* number of columns that it owns, from `column` on */
} loss_tile;

static size_t round_up(size_t count, size_t multiple) { return (count + multiple - 1) / multiple * multiple; }

static loss_tile tile_at(const loss_job *job, loss_buffers *buffers, size_t index)
{
    loss_tile t = {.job = job, .buffers = buffers};
    const size_t place = index % job->across; /* tiles of one row have nearly equal widths */
    t.column = place * job->width / job->across;
    t.owned = (place + 1) * job->width / job->across - t.column;
    t.first = (ptrdiff_t)t.column - RADIUS;
    t.segment = round_up(t.owned + 2 * RADIUS, LOSS_LANES * LOSS_GROUP) / LOSS_LANES;
    if (t.segment < LOSS_LANES)
        t.segment = LOSS_LANES;
    t.count = t.segment * LOSS_STEP;
    t.begin = index / job->across * job->band_rows;
    t.end = smaller_size(t.begin + job->band_rows, job->height);
    return t;
}

static bool is_row(const loss_tile *t, ptrdiff_t row) { return row >= 0 && row < (ptrdiff_t)t->job->height; }

/* ---- rows of pixels ---- */

/* Copy pixels [first, first + count) of a row; 0 for pixels outside the image and invalid ones. */
static void copy_pixels(const loss_job *job, const float *picture, size_t row, ptrdiff_t first, size_t count,
                        float *out)
{
    const ptrdiff_t width = (ptrdiff_t)job->width, end = first + (ptrdiff_t)count;
    const ptrdiff_t from = first > 0 ? first : 0, to = end < width ? end : width;
    const size_t before = (size_t)(from - first) * CHANNELS, here = (size_t)(to - from) * CHANNELS;
    memset(out, 0, before * sizeof *out);
    memcpy(out + before, picture + (row * job->width + (size_t)from) * CHANNELS, here * sizeof *out);
    memset(out + before + here, 0, (size_t)(end - to) * CHANNELS * sizeof *out);
    if (job->valid == NULL)
        return;
    const unsigned char *valid = job->valid + row * job->width;
    for (ptrdiff_t i = from; i < to; i++)
        if (!valid[i])
            memset(out + (i - first) * CHANNELS, 0, CHANNELS * sizeof *out);
}

/* Prefetch the pixels of a row that is needed soon: the rows of a tile are far apart in memory. */
static void fetch_pixels(const loss_tile *t, const float *picture, ptrdiff_t row)
{
    enum { LINE = 16 /* floats */ };
    if (!is_row(t, row))
        return;
    const float *p = picture + ((size_t)row * t->job->width + t->column) * CHANNELS;
    for (size_t i = 0; i < t->owned * CHANNELS; i += LINE)
        __builtin_prefetch(p + i);
}

/* ---- the passes ---- */

/* Compute one row of the moments and store it in their ring buffer. */
static void moment_row(const loss_tile *t, ptrdiff_t row, size_t place)
{
    loss_buffers *buffers = t->buffers;
    if (!is_row(t, row)) {
        for (int m = 0; m < LOSS_MOMENTS; m++)
            memset(buffers->moments[m][place], 0, t->count * sizeof(double));
        return;
    }
    const loss_kernels *kernels = t->job->kernels;
    const size_t pixels = t->count / CHANNELS + 2 * RADIUS;
    fetch_pixels(t, t->job->x, row + LOSS_GROUP);
    fetch_pixels(t, t->job->y, row + LOSS_GROUP);
    copy_pixels(t->job, t->job->x, (size_t)row, t->first - RADIUS, pixels, buffers->pixels_x);
    copy_pixels(t->job, t->job->y, (size_t)row, t->first - RADIUS, pixels, buffers->pixels_y);
    kernels->to_lanes(buffers->pixels_x + LOSS_EDGE, t->count, buffers->x[0]);
    kernels->to_lanes(buffers->pixels_y + LOSS_EDGE, t->count, buffers->y[0]);
    double edges[LOSS_MOMENTS][2][LOSS_EDGE], *products[LOSS_MOMENTS];
    for (int side = 0; side < 2; side++) {
        const size_t from = side == 0 ? 0 : LOSS_EDGE + t->count;
        double *const out[LOSS_MOMENTS] = {edges[0][side], edges[1][side], edges[2][side], edges[3][side]};
        kernels->products(buffers->pixels_x + from, buffers->pixels_y + from, LOSS_EDGE, out);
    }
    for (int m = 0; m < LOSS_MOMENTS; m++)
        products[m] = buffers->wide[m] + LOSS_MARGIN;
    kernels->products(buffers->x[0], buffers->y[0], t->count, products);
    for (int m = 0; m < LOSS_MOMENTS; m++)
        kernels->margins(products[m], t->count, edges[m][0], edges[m][1]);
    for (int m = 0; m < LOSS_MOMENTS; m++)
        kernels->row_pass(products[m], t->count, buffers->moments[m][place]);
}

/* Mask of the pixels of a row at which the SSIM map counts. */
static const double *counts_of(const loss_tile *t, ptrdiff_t row, double *out)
{
    const loss_job *job = t->job;
    if (!is_row(t, row))
        return t->buffers->nothing;
    if (job->valid == NULL)
        return t->buffers->inside;
    memcpy(out, t->buffers->inside, t->count * sizeof *out);
    const unsigned char *valid = job->valid + (size_t)row * job->width;
    for (size_t i = 0; i < LOSS_LANES * t->segment; i++) {
        const ptrdiff_t column = t->first + (ptrdiff_t)i;
        double *place = out + i % t->segment * LOSS_STEP + i / t->segment;
        if (column >= 0 && column < (ptrdiff_t)job->width && !valid[column])
            place[0] = place[LOSS_LANES] = place[2 * LOSS_LANES] = 0;
    }
    return out;
}

/* Compute a group of rows of the partials and store them in the ring buffer. */
static void map_rows(const loss_tile *t, ptrdiff_t first_row, size_t first_place)
{
    loss_buffers *buffers = t->buffers;
    const double *moments[LOSS_MOMENTS][LOSS_SPAN], *counts[LOSS_GROUP], none[LOSS_EDGE] = {0};
    double weight[LOSS_GROUP], *partials[LOSS_GROUP][LOSS_PARTIALS];
    for (size_t m = 0; m < LOSS_MOMENTS; m++)
        for (size_t k = 0; k < LOSS_SPAN; k++)
            moments[m][k] = buffers->moments[m][(first_place + k) % RING];
    for (size_t k = 0; k < LOSS_GROUP; k++) {
        const ptrdiff_t row = first_row + (ptrdiff_t)k;
        counts[k] = counts_of(t, row, buffers->counted[k]);
        weight[k] = row >= (ptrdiff_t)t->begin && row < (ptrdiff_t)t->end;
        for (size_t m = 0; m < LOSS_PARTIALS; m++)
            partials[k][m] = buffers->wide[k * LOSS_PARTIALS + m] + LOSS_MARGIN;
    }
    t->job->kernels->map((const double *const(*)[LOSS_SPAN])moments, counts, weight, t->count,
                         (double *const(*)[LOSS_PARTIALS])partials, buffers->sums[0]);
    for (size_t k = 0; k < LOSS_GROUP; k++)
        for (size_t m = 0; m < LOSS_PARTIALS; m++)
            t->job->kernels->margins(partials[k][m], t->count, none, none);
    for (size_t k = 0; k < LOSS_GROUP; k++)
        for (size_t m = 0; m < LOSS_PARTIALS; m++)
            t->job->kernels->row_pass(partials[k][m], t->count,
                                      buffers->partials[m][(first_place + k) % RING]);
}

/* Compute a group of rows of the gradient and store them in d_x. */
static void gradient_rows(const loss_tile *t, size_t first_row, size_t first_place)
{
    const loss_job *job = t->job;
    loss_buffers *buffers = t->buffers;
    const double *partials[LOSS_PARTIALS][LOSS_SPAN];
    const float *x[LOSS_GROUP], *y[LOSS_GROUP];
    float *d_x[LOSS_GROUP];
    double weight[LOSS_GROUP];
    for (size_t m = 0; m < LOSS_PARTIALS; m++)
        for (size_t k = 0; k < LOSS_SPAN; k++)
            partials[m][k] = buffers->partials[m][(first_place + k) % RING];
    for (size_t k = 0; k < LOSS_GROUP; k++) {
        x[k] = buffers->x[k];
        y[k] = buffers->y[k];
        d_x[k] = buffers->d_x[k];
        weight[k] = first_row + k < t->end;
        if (first_row + k >= t->end)
            continue;
        copy_pixels(job, job->x, first_row + k, t->first, t->count / CHANNELS, buffers->pixels_x);
        copy_pixels(job, job->y, first_row + k, t->first, t->count / CHANNELS, buffers->pixels_y);
        job->kernels->to_lanes(buffers->pixels_x, t->count, buffers->x[k]);
        job->kernels->to_lanes(buffers->pixels_y, t->count, buffers->y[k]);
    }
    job->kernels->gradient((const double *const(*)[LOSS_SPAN])partials, x, y, weight, t->count, job->l1_scale,
                           job->ssim_scale, d_x, buffers->sums[1], buffers->sums[2]);
    for (size_t k = 0; k < LOSS_GROUP && first_row + k < t->end; k++) {
        const size_t at = (first_row + k) * job->width + t->column;
        job->kernels->from_lanes(buffers->d_x[k], t->count, buffers->pixels_x);
        memcpy(job->d_x + at * CHANNELS, buffers->pixels_x + LOSS_EDGE,
               t->owned * CHANNELS * sizeof *job->d_x);
        for (size_t i = at; job->valid != NULL && i < at + t->owned; i++)
            if (!job->valid[i])
                memset(job->d_x + i * CHANNELS, 0, CHANNELS * sizeof *job->d_x);
    }
}

/* Set a row in lane layout to 0 at all pixels but [begin, end) of the tile. */
static void keep_pixels(const loss_tile *t, size_t begin, size_t end, double *row)
{
    for (size_t i = 0; i < LOSS_LANES * t->segment; i++) {
        double *place = row + i % t->segment * LOSS_STEP + i / t->segment;
        if (i < begin || i >= end)
            place[0] = place[LOSS_LANES] = place[2 * LOSS_LANES] = 0;
    }
}

static void run_tile(const loss_job *job, loss_buffers *buffers, size_t index)
{
    const loss_tile t = tile_at(job, buffers, index);
    for (size_t i = 0; i < t.count; i++)
        buffers->inside[i] = 1;
    const size_t left = t.first < 0 ? (size_t)-t.first : 0;
    keep_pixels(&t, left, (size_t)((ptrdiff_t)job->width - t.first), buffers->inside);
    memset(buffers->nothing, 0, sizeof buffers->nothing);
    memset(buffers->sums, 0, sizeof buffers->sums);
    memset(buffers->x, 0, sizeof buffers->x);
    memset(buffers->y, 0, sizeof buffers->y);

    /* Rows are processed in groups from top to bottom. Moments start 2 RADIUS rows above the first row of the
       gradient, partials RADIUS rows above it. */
    const size_t groups = round_up(t.end - t.begin, LOSS_GROUP) / LOSS_GROUP;
    for (size_t step = 0; step < groups + 2 * AHEAD; step++) {
        const size_t place = step * LOSS_GROUP;
        const ptrdiff_t top = (ptrdiff_t)(t.begin + place);
        for (size_t k = 0; k < LOSS_GROUP; k++)
            moment_row(&t, top + (ptrdiff_t)k - 2 * RADIUS, (place + k) % RING);
        if (step >= AHEAD)
            map_rows(&t, top - AHEAD * LOSS_GROUP - RADIUS, place - AHEAD * LOSS_GROUP);
        if (step >= 2 * AHEAD)
            gradient_rows(&t, t.begin + place - 2 * AHEAD * LOSS_GROUP, place - 2 * AHEAD * LOSS_GROUP);
    }
    for (size_t i = 0; i < SUMS; i++) {
        keep_pixels(&t, RADIUS, RADIUS + t.owned, buffers->sums[i]);
        job->sums[i * job->tile_count + index] = window_sum(buffers->sums[i], t.count);
    }
}

/* Take a free buffer; there are as many as threads. */
static size_t take_buffers(const loss_job *job)
{
    for (size_t i = 0;; i = (i + 1) % job->set_count)
        if (!atomic_flag_test_and_set(&job->buffer_sets[i].taken))
            return i;
}

static void run_one_tile(size_t tile, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    const loss_job *job = context;
    const size_t set = take_buffers(job);
    run_tile(job, &job->buffer_sets[set], tile);
    atomic_flag_clear(&job->buffer_sets[set].taken);
}

/* Number of rows of tiles: more for a small image, which would otherwise be a single tile. */
static size_t band_count(size_t height, size_t across)
{
    size_t bands = parallel_block_count(height, BAND_ROWS);
    while (across * bands < TILES_WANTED && height / (bands + 1) >= BAND_LEAST)
        bands++;
    return bands;
}

/* ---- the loss ---- */

static bool is_size_equal(const image *a, const image *b)
{
    return a->width == b->width && a->height == b->height && a->channels == b->channels;
}

typedef struct count_job {
    const unsigned char *valid;
    atomic_size_t count;
} count_job;

static void count_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    count_job *job = context;
    size_t count = 0;
    for (size_t i = begin; i < end; i++)
        count += job->valid[i] != 0;
    atomic_fetch_add(&job->count, count);
}

static size_t count_valid(const unsigned char *valid, size_t pixels)
{
    count_job job = {.valid = valid};
    atomic_init(&job.count, 0);
    parallel_blocks(pixels, COUNT_BLOCK, count_block, &job);
    return atomic_load(&job.count);
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
    loss_job job = {.kernels = loss_kernels_best(),
                    .x = x->pixels,
                    .y = y->pixels,
                    .valid = valid,
                    .d_x = d_x->pixels,
                    .width = (size_t)x->width,
                    .height = (size_t)x->height};
    job.across = parallel_block_count(job.width, TILE_OWNED);
    const size_t bands = band_count(job.height, job.across);
    job.tile_count = job.across * bands;
    job.band_rows = round_up(parallel_block_count(job.height, bands), LOSS_GROUP);
    job.set_count = smaller_size((size_t)parallel_threads(), job.tile_count);
    const size_t buffer_doubles = job.set_count * sizeof(loss_buffers) / sizeof(double);
    GBT_TRY(mem_reserve((void **)&scratch->buffer, &scratch->capacity, 0,
                        buffer_doubles + SUMS * job.tile_count, sizeof *scratch->buffer, "loss scratch",
                        err));
    job.buffer_sets = (loss_buffers *)scratch->buffer;
    job.sums = scratch->buffer + buffer_doubles;
    for (size_t i = 0; i < job.set_count; i++)
        atomic_flag_clear(&job.buffer_sets[i].taken);

    const size_t all = job.width * job.height, pixels = valid != NULL ? count_valid(valid, all) : all;
    if (pixels == 0) {
        memset(d_x->pixels, 0, all * CHANNELS * sizeof *d_x->pixels);
        out->ssim = 1;
        out->mse = (double)NAN;
        return GBT_OK;
    }
    const double values = (double)(CHANNELS * pixels);
    job.l1_scale = (1 - dssim_weight) / values;
    job.ssim_scale = -dssim_weight / values;
    parallel_blocks(job.tile_count, 1, run_one_tile, &job);
    out->ssim = window_sum(job.sums, job.tile_count) / values;
    out->l1 = window_sum(job.sums + job.tile_count, job.tile_count) / values;
    out->mse = window_sum(job.sums + 2 * job.tile_count, job.tile_count) / values;
    out->loss = (1 - dssim_weight) * out->l1 + dssim_weight * (1 - out->ssim);
    return GBT_OK;
}

void loss_scratch_free(loss_scratch *s)
{
    mem_free(s->buffer);
    memset(s, 0, sizeof *s);
}
