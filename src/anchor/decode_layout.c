/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_layout.c -- pack the decoder's networks for the kernels. */
#include "anchor/decode_layout.h"

#include <string.h>

#include "base/memory.h"

decode_layout decode_layout_of(const decoder *d)
{
    decode_layout layout = {.offset_count = (size_t)d->offset_count,
                            .input_count = ANCHOR_FEATURE_DIM + 3 + (d->has_distance ? 1 : 0)};
    decoder_part parts[HEAD_COUNT];
    decoder_parts(d, parts);
    for (int head = 0; head < HEAD_COUNT; head++) {
        layout.out_count[head] = parts[head].outputs * layout.offset_count;
        layout.out_stride[head] =
            (layout.out_count[head] + DENSE_COLUMNS - 1) / DENSE_COLUMNS * DENSE_COLUMNS;
        layout.out_first[head] = layout.out_width;
        layout.out_width += layout.out_stride[head];
        layout.param_first[head] = parts[head].begin;
    }
    return layout;
}

gbt_status decode_pack_weights(const decoder *d, const decode_layout *layout, decode_tape *tape,
                               decode_weights *out, gbt_error *err)
{
    enum { HIDDEN = ANCHOR_HIDDEN_DIM };
    size_t size = (INPUT_COUNT + 1 + ANCHOR_FEATURE_DIM) * HIDDEN_STRIDE;
    for (int head = 0; head < HEAD_COUNT; head++)
        size += (2 * HIDDEN + 1) * layout->out_stride[head];
    void *block = tape->weights;
    const gbt_status status =
        mem_reserve(&block, &tape->weight_capacity, 0, size, sizeof(float), "decode weights", err);
    if (status != GBT_OK)
        return status;
    tape->weights = block;
    memset(block, 0, size * sizeof(float));

    float *next = tape->weights;
    out->input_hidden = next;
    next += INPUT_COUNT * HIDDEN_STRIDE;
    out->hidden_bias = next;
    next += HIDDEN_STRIDE;
    out->hidden_input = next;
    next += HIDDEN_STRIDE * ANCHOR_FEATURE_DIM;
    for (int head = 0; head < HEAD_COUNT; head++) {
        const size_t stride = layout->out_stride[head];
        out->hidden_out[head] = next;
        next += HIDDEN * stride;
        out->out_hidden[head] = next;
        next += HIDDEN * stride;
        out->out_bias[head] = next;
        next += stride;
    }

    for (int head = 0; head < HEAD_COUNT; head++) {
        const size_t in = layout->input_count, count = layout->out_count[head],
                     stride = layout->out_stride[head];
        const float *w1 = d->params + layout->param_first[head], *b1 = w1 + HIDDEN * in;
        const float *w2 = b1 + HIDDEN, *b2 = w2 + count * HIDDEN;
        for (size_t h = 0; h < HIDDEN; h++) {
            const size_t column = (size_t)head * HIDDEN + h;
            for (size_t i = 0; i < in; i++)
                out->input_hidden[i * HIDDEN_STRIDE + column] = w1[h * in + i];
            memcpy(out->hidden_input + column * ANCHOR_FEATURE_DIM, w1 + h * in,
                   ANCHOR_FEATURE_DIM * sizeof(float));
            out->hidden_bias[column] = b1[h];
        }
        for (size_t o = 0; o < count; o++) {
            for (size_t h = 0; h < HIDDEN; h++)
                out->hidden_out[head][h * stride + o] = w2[o * HIDDEN + h];
            out->out_bias[head][o] = b2[o];
        }
        memcpy(out->out_hidden[head], w2, count * HIDDEN * sizeof(float));
    }
    return GBT_OK;
}
