/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_inputs.c -- inputs of the networks (feature, viewing direction, distance) and their hidden
   layers. */
#include <math.h>
#include <string.h>

#include "anchor/decode_layout.h"
#include "base/clones.h"

static double cut(double x, double low, double high)
{
    const double above = x > low ? x : low;
    return above < high ? above : high;
}

/* Directions and distances in double: exact differences for any finite input, no overflow of the squares, the
   same bits on every machine. */
FASTEST_CLONE void decode_views(const anchors *a, const decoder *d, const float camera[3],
                                const uint32_t *which, size_t rows, float *view)
{
    double offset[3][DECODE_CHUNK], distance[DECODE_CHUNK];
    for (size_t r = 0; r < rows; r++) {
        const float *position = a->position + (size_t)which[r] * 3;
        for (int c = 0; c < 3; c++)
            offset[c][r] = (double)position[c] - (double)camera[c];
    }
    for (size_t r = 0; r < rows; r++) {
        const double x = offset[0][r], y = offset[1][r], z = offset[2][r], far = sqrt(x * x + y * y + z * z);
        const int there = (far > 0) & (far < HUGE_VAL);
        offset[0][r] = there ? x / far : 0;
        offset[1][r] = there ? y / far : 0;
        offset[2][r] = there ? z / far : 1;
        distance[r] = far;
    }
    const double low = 0.5 * (double)d->distance_min, high = fmin(2.0 * (double)d->distance_max, 1e18);
    for (size_t r = 0; r < rows; r++) {
        for (int c = 0; c < 3; c++)
            view[r * VIEW_COUNT + c] = (float)offset[c][r];
        view[r * VIEW_COUNT + 3] =
            d->has_distance ? (float)cut(distance[r] * (double)d->distance_scale, low, high) : 0.0f;
    }
}

void decode_inputs(const anchors *a, const uint32_t *which, const float *view, size_t rows, float *input)
{
    for (size_t r = 0; r < rows; r++) {
        float *row = input + r * INPUT_STRIDE;
        memcpy(row, a->feature + (size_t)which[r] * ANCHOR_FEATURE_DIM, ANCHOR_FEATURE_DIM * sizeof *row);
        memcpy(row + ANCHOR_FEATURE_DIM, view + r * VIEW_COUNT, VIEW_COUNT * sizeof *row);
        row[INPUT_ONE] = 1.0f;
        for (int i = INPUT_ONE + 1; i < INPUT_STRIDE; i++)
            row[i] = 0.0f;
    }
    memset(input + rows * INPUT_STRIDE, 0, (decode_tiled(rows) - rows) * INPUT_STRIDE * sizeof *input);
}

void decode_hidden(const dense_kernels *kernels, const decode_weights *weights, const float *input,
                   size_t tiled, int first, int end, float *hidden)
{
    const int column = first * ANCHOR_HIDDEN_DIM, count = (end - first) * ANCHOR_HIDDEN_DIM;
    kernels->product(&(dense_product){.m = tiled,
                                      .n = (size_t)count,
                                      .k = INPUT_COUNT,
                                      .a = input,
                                      .a_row = INPUT_STRIDE,
                                      .a_step = 1,
                                      .b = weights->input_hidden + column,
                                      .b_row = HIDDEN_STRIDE,
                                      .bias = weights->hidden_bias + column,
                                      .relu = true,
                                      .c = hidden,
                                      .c_row = (size_t)count});
}
