/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_layout.c -- pack the network weights into the layout of the kernels. */
#include "anchor/decode_layout.h"

#include <string.h>

#include "base/memory.h"

decode_layout decode_layout_of(const decoder *d)
{
    decode_layout layout = {.offset_count = (size_t)d->offset_count,
                            .input_count = ANCHOR_FEATURE_DIM + 3 + (d->has_distance ? 1 : 0)};
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(d, networks);
    for (int network = 0; network < DECODER_NETWORKS; network++) {
        layout.out_count[network] = networks[network].outputs * layout.offset_count;
        layout.out_stride[network] =
            (layout.out_count[network] + DENSE_COLUMNS - 1) / DENSE_COLUMNS * DENSE_COLUMNS;
        layout.out_first[network] = layout.out_width;
        layout.out_width += layout.out_stride[network];
        layout.param_first[network] = networks[network].begin;
    }
    return layout;
}

gbt_status decode_pack_weights(const decoder *d, const decode_layout *layout, decode_tape *tape,
                               decode_weights *out, gbt_error *err)
{
    enum { HIDDEN = ANCHOR_HIDDEN_DIM };
    size_t size = (INPUT_COUNT + 1 + ANCHOR_FEATURE_DIM) * HIDDEN_STRIDE;
    for (int network = 0; network < DECODER_NETWORKS; network++)
        size += (2 * HIDDEN + 1) * layout->out_stride[network];
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
    for (int network = 0; network < DECODER_NETWORKS; network++) {
        const size_t stride = layout->out_stride[network];
        out->hidden_out[network] = next;
        next += HIDDEN * stride;
        out->out_hidden[network] = next;
        next += HIDDEN * stride;
        out->out_bias[network] = next;
        next += stride;
    }

    for (int network = 0; network < DECODER_NETWORKS; network++) {
        const size_t in = layout->input_count, count = layout->out_count[network],
                     stride = layout->out_stride[network];
        const float *w1 = d->params + layout->param_first[network], *b1 = w1 + HIDDEN * in;
        const float *w2 = b1 + HIDDEN, *b2 = w2 + count * HIDDEN;
        for (size_t h = 0; h < HIDDEN; h++) {
            const size_t column = (size_t)network * HIDDEN + h;
            for (size_t i = 0; i < in; i++)
                out->input_hidden[i * HIDDEN_STRIDE + column] = w1[h * in + i];
            memcpy(out->hidden_input + column * ANCHOR_FEATURE_DIM, w1 + h * in,
                   ANCHOR_FEATURE_DIM * sizeof(float));
            out->hidden_bias[column] = b1[h];
        }
        for (size_t o = 0; o < count; o++) {
            for (size_t h = 0; h < HIDDEN; h++)
                out->hidden_out[network][h * stride + o] = w2[o * HIDDEN + h];
            out->out_bias[network][o] = b2[o];
        }
        memcpy(out->out_hidden[network], w2, count * HIDDEN * sizeof(float));
    }
    return GBT_OK;
}
