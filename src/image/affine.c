/* SPDX-License-Identifier: Apache-2.0 */
/* image/affine.c -- colour matrices: apply, adjoint, clipping of the camera, least-squares fit. */
#include "image/affine.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/symmetric.h"

enum { INPUTS = 4, OUTPUTS = 3, BLOCKS_MAX = 64 };

void affine_identity(float m[AFFINE_NUMBERS])
{
    for (int i = 0; i < AFFINE_NUMBERS; i++)
        m[i] = i % (INPUTS + 1) == 0 ? 1.0f : 0.0f;
}

typedef struct affine_job {
    const float *m;
    const image *in;
    image *out;
    double sums[BLOCKS_MAX][AFFINE_NUMBERS];
} affine_job;

static size_t pixel_count(const image *im) { return (size_t)im->width * (size_t)im->height; }

/* At most BLOCKS_MAX blocks; the grain depends only on the image size. */
static size_t block_grain(size_t pixels)
{
    const size_t even = (pixels + BLOCKS_MAX - 1) / BLOCKS_MAX;
    return even < 4096 ? 4096 : even;
}

static void apply_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const affine_job *job = context;
    const float *m = job->m;
    for (size_t i = 3 * begin; i < 3 * end; i += 3) {
        const float r = job->in->pixels[i], g = job->in->pixels[i + 1], b = job->in->pixels[i + 2];
        for (size_t c = 0; c < OUTPUTS; c++)
            job->out->pixels[i + c] = m[4 * c] * r + m[4 * c + 1] * g + m[4 * c + 2] * b + m[4 * c + 3];
    }
}

void affine_apply(const float m[AFFINE_NUMBERS], const image *in, image *out)
{
    affine_job job = {.m = m, .in = in, .out = out};
    parallel_blocks(pixel_count(in), block_grain(pixel_count(in)), apply_block, &job);
}

static void backward_block(size_t block, size_t begin, size_t end, void *context)
{
    affine_job *job = context;
    const float *m = job->m;
    double *sum = job->sums[block];
    for (size_t i = 3 * begin; i < 3 * end; i += 3) {
        const float *in = job->in->pixels + i;
        float *d = job->out->pixels + i;
        const float up[OUTPUTS] = {d[0], d[1], d[2]};
        for (size_t c = 0; c < OUTPUTS; c++) {
            for (size_t k = 0; k < 3; k++)
                sum[4 * c + k] += (double)up[c] * (double)in[k];
            sum[4 * c + 3] += (double)up[c];
            d[c] = m[c] * up[0] + m[4 + c] * up[1] + m[8 + c] * up[2];
        }
    }
}

void affine_backward(const float m[AFFINE_NUMBERS], const image *in, image *d, double d_m[AFFINE_NUMBERS])
{
    affine_job job = {.m = m, .in = in, .out = d};
    const size_t count = pixel_count(in), grain = block_grain(count);
    parallel_blocks(count, grain, backward_block, &job);
    for (int k = 0; k < AFFINE_NUMBERS; k++)
        d_m[k] = 0;
    for (size_t b = 0; b < parallel_block_count(count, grain); b++)
        for (int k = 0; k < AFFINE_NUMBERS; k++)
            d_m[k] += job.sums[b][k];
}

/* ---- clipping at the ends of a camera's range ---- */

typedef struct cut_job {
    const image *photo, *seen; /* seen: `shown` as input */
    image *out;                /* output: `shown` itself, or its gradient */
} cut_job;

static bool is_beyond(float photo, float shown)
{
    const float white = 0.99f, black = 0.01f;
    return (photo >= white && shown >= photo) || (photo <= black && shown <= photo);
}

static void cut_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const cut_job *job = context;
    const float *photo = job->photo->pixels, *shown = job->seen->pixels;
    for (size_t i = 3 * begin; i < 3 * end; i++)
        job->out->pixels[i] = is_beyond(photo[i], shown[i]) ? photo[i] : shown[i];
}

static void cut_backward_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const cut_job *job = context;
    const float *photo = job->photo->pixels, *shown = job->seen->pixels;
    float *d = job->out->pixels;
    for (size_t i = 3 * begin; i < 3 * end; i++)
        d[i] = is_beyond(photo[i], shown[i]) ? 0 : d[i];
}

void affine_cut(const image *photo, image *shown)
{
    cut_job job = {photo, shown, shown};
    parallel_blocks(pixel_count(shown), block_grain(pixel_count(shown)), cut_block, &job);
}

void affine_cut_backward(const image *photo, const image *shown, image *d)
{
    cut_job job = {photo, shown, d};
    parallel_blocks(pixel_count(shown), block_grain(pixel_count(shown)), cut_backward_block, &job);
}

/* ---- least squares ---- */

static double finite_or_0(float value) { return isfinite(value) ? (double)value : 0; }

void affine_fit(const image *from, const image *to, const unsigned char *valid, int begin, int end,
                float m[AFFINE_NUMBERS])
{
    const double ridge = 1e-6;
    double a[INPUTS * INPUTS] = {0}, b[OUTPUTS][INPUTS] = {{0}}, used = 0;
    for (int y = 0; y < from->height; y++)
        for (int x = begin; x < end; x++) {
            const size_t pixel = (size_t)y * (size_t)from->width + (size_t)x, at = 3 * pixel;
            if (valid != NULL && !valid[pixel])
                continue;
            used++;
            const float *p = from->pixels + at, *q = to->pixels + at;
            const double in[INPUTS] = {finite_or_0(p[0]), finite_or_0(p[1]), finite_or_0(p[2]), 1};
            for (int i = 0; i < INPUTS; i++) {
                for (int j = 0; j <= i; j++)
                    a[i * INPUTS + j] += in[i] * in[j];
                for (int r = 0; r < OUTPUTS; r++)
                    b[r][i] += in[i] * finite_or_0(q[r]);
            }
        }
    const double weight = ridge * fmax(1, used);
    for (int i = 0; i < INPUTS; i++) {
        a[i * (INPUTS + 1)] += weight;
        if (i < OUTPUTS)
            b[i][i] += weight;
    }
    symmetric_cholesky(a, a, INPUTS, 1e-300); /* the matrix is positive definite */
    for (int r = 0; r < OUTPUTS; r++) {
        symmetric_solve(a, b[r], INPUTS);
        for (int i = 0; i < INPUTS; i++)
            m[4 * r + i] = (float)b[r][i];
    }
}

/* ---- left and right ---- */

/* Copy the last `kept` bytes of each of `rows` rows. */
static void copy_right(const void *in, size_t row, size_t kept, int rows, void *out)
{
    for (size_t y = 0; y < (size_t)rows; y++)
        memcpy((char *)out + y * kept, (const char *)in + y * row + (row - kept), kept);
}

gbt_status affine_split(image *render, const image *photo, const unsigned char *valid, affine_half *out,
                        gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (render->channels != 3 || photo->channels != 3 || render->width != photo->width ||
        render->height != photo->height)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "exposure: images of %d x %d x %d and %d x %d x %d (wanted equal, 3 channels)",
                         render->width, render->height, render->channels, photo->width, photo->height,
                         photo->channels);
    const int left = render->width / 2, right = render->width - left;
    gbt_status status = image_alloc(&out->render, right, render->height, 3, err);
    if (status == GBT_OK)
        status = image_alloc(&out->photo, right, render->height, 3, err);
    if (status == GBT_OK && valid != NULL) {
        out->valid = mem_alloc((size_t)right * (size_t)render->height, 1, "valid pixels", err);
        status = out->valid == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    }
    if (status != GBT_OK) {
        affine_half_free(out);
        return status;
    }
    float m[AFFINE_NUMBERS];
    affine_fit(render, photo, valid, 0, left, m);
    affine_apply(m, render, render);
    const size_t pixel = 3 * sizeof(float), width = (size_t)render->width, kept = (size_t)right;
    copy_right(render->pixels, width * pixel, kept * pixel, render->height, out->render.pixels);
    copy_right(photo->pixels, width * pixel, kept * pixel, render->height, out->photo.pixels);
    if (valid != NULL)
        copy_right(valid, width, kept, render->height, out->valid);
    return GBT_OK;
}

void affine_half_free(affine_half *half)
{
    image_free(&half->render);
    image_free(&half->photo);
    mem_free(half->valid);
    memset(half, 0, sizeof *half);
}
