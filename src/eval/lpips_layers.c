/* SPDX-License-Identifier: Apache-2.0 */
/* eval/lpips_layers.c -- convolution as matrix products, one per row of the image and row of the kernel.
   Because the channels of a pixel are adjacent in memory, a kernel row covers contiguous numbers, and those
   of the next output pixel begin `stride` pixels later. */
#include "eval/lpips_layers.h"

#include <math.h>
#include <string.h>

#include "anchor/dense.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

gbt_status feature_plane_make(int width, int height, int channels, int pad, feature_plane *out,
                              gbt_error *err)
{
    *out = (feature_plane){.width = width, .height = height, .channels = channels, .pad = pad};
    if (width < 1 || height < 1)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "LPIPS: the picture is too small for the network (a layer would have %d x %d pixels)",
            width < 0 ? 0 : width, height < 0 ? 0 : height);
    out->values = mem_calloc((size_t)(width + 2 * pad) * (size_t)(height + 2 * pad),
                             (size_t)channels * sizeof *out->values, "features", err);
    return out->values != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

void feature_plane_free(feature_plane *p)
{
    mem_free(p->values);
    *p = (feature_plane){0};
}

void convolution_free(convolution *c)
{
    mem_free(c->weights);
    mem_free(c->bias);
    *c = (convolution){0};
}

/* Number of positions of a window of `size` along a side, `stride` apart. */
static int steps_of(int side, int size, int stride) { return side < size ? 0 : (side - size) / stride + 1; }

typedef struct convolve_job {
    const convolution *c;
    const feature_plane *in, *out;
    const dense_kernels *kernels;
} convolve_job;

static void convolve_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const convolve_job *job = context;
    const convolution *c = job->c;
    const size_t in = (size_t)c->in, run = (size_t)c->kernel * in;
    for (size_t y = begin; y < end; y++)
        for (int k = 0; k < c->kernel; k++) {
            const dense_product product = {
                .m = (size_t)job->out->width,
                .n = (size_t)c->out,
                .k = run,
                .a = feature_plane_at(job->in, -c->pad, (int)y * c->stride + k - c->pad),
                .a_row = (size_t)c->stride * in,
                .a_step = 1,
                .b = c->weights + (size_t)k * run * (size_t)c->out,
                .b_row = (size_t)c->out,
                .bias = k == 0 ? c->bias : NULL, /* products of later kernel rows are added to the first */
                .relu = k == c->kernel - 1,
                .c = feature_plane_at(job->out, 0, (int)y),
                .c_row = (size_t)c->out};
            job->kernels->product(&product);
        }
}

gbt_status convolve(const convolution *c, const feature_plane *in, int pad, feature_plane *out,
                    gbt_error *err)
{
    GBT_TRY(feature_plane_make(steps_of(in->width + 2 * c->pad, c->kernel, c->stride),
                               steps_of(in->height + 2 * c->pad, c->kernel, c->stride), c->out, pad, out,
                               err));
    convolve_job job = {c, in, out, dense_best()};
    parallel_blocks((size_t)out->height, 1, convolve_rows, &job);
    return GBT_OK;
}

typedef struct pool_job {
    const feature_plane *in, *out;
    int size;
} pool_job;

static void pool_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const pool_job *job = context;
    const int channels = job->in->channels;
    for (int y = (int)begin; y < (int)end; y++)
        for (int x = 0; x < job->out->width; x++) {
            float *to = feature_plane_at(job->out, x, y);
            memcpy(to, feature_plane_at(job->in, 2 * x, 2 * y), (size_t)channels * sizeof *to);
            for (int k = 1; k < job->size * job->size; k++) {
                const float *from = feature_plane_at(job->in, 2 * x + k % job->size, 2 * y + k / job->size);
                for (int c = 0; c < channels; c++)
                    to[c] = fmaxf(to[c], from[c]);
            }
        }
}

gbt_status pool_max(const feature_plane *in, int size, int pad, feature_plane *out, gbt_error *err)
{
    GBT_TRY(feature_plane_make(steps_of(in->width, size, 2), steps_of(in->height, size, 2), in->channels, pad,
                               out, err));
    pool_job job = {in, out, size};
    parallel_blocks((size_t)out->height, 1, pool_rows, &job);
    return GBT_OK;
}
