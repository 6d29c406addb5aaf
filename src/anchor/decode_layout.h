/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_layout.h -- how decode.c and decode_backward.c lay out rows, heads and packed networks in
   memory.

   One row per visible anchor. The visible anchors are cut into chunks of DECODE_CHUNK rows, whose scratch
   stays in the second-level cache; a parallel block is DECODE_GRAIN rows. Both are multiples of the register
   tile, so only the very last chunk has rows to pad. */
#ifndef GBT_ANCHOR_DECODE_LAYOUT_H
#define GBT_ANCHOR_DECODE_LAYOUT_H

#include "anchor/activations.h"
#include "anchor/decode.h"
#include "anchor/dense.h"

enum {
    DECODE_CHUNK = 120,
    DECODE_GRAIN = 240,
    DECODE_TILE = 10,
    INPUT_COUNT = ANCHOR_FEATURE_DIM + 4, /* feature, direction, distance; the distance is 0 when the networks
                                             do not have it */
    INPUT_ONE = INPUT_COUNT, /* a column of ones: it turns the bias gradient into one more weight gradient */
    INPUT_STRIDE = 48,
    HEAD_COUNT = DECODER_PARTS, /* opacity, shape, colour */
    HIDDEN_STRIDE = HEAD_COUNT * ANCHOR_HIDDEN_DIM,
    ALPHA_STRIDE = ANCHOR_MAX_OFFSETS,
    SHAPE_OUTPUTS = 7,
    COLOR_OUTPUTS = 3,
    SHAPE_STRIDE_MAX = SHAPE_OUTPUTS * ANCHOR_MAX_OFFSETS,
    COLOR_STRIDE_MAX = COLOR_OUTPUTS * ANCHOR_MAX_OFFSETS,
    CHUNK_SLOTS = DECODE_CHUNK * ANCHOR_MAX_OFFSETS
};

/** Activations of the kept Gaussians in decode_tape.output. */
enum {
    KEPT_ALPHA,
    KEPT_SIGMOID, /* 3: scale = exp(scale_log[3..5]) * this */
    KEPT_QUAT = KEPT_SIGMOID + 3,
    KEPT_INVERSE_LENGTH = KEPT_QUAT + 4,
    KEPT_COLOR,
    KEPT_FIELDS = KEPT_COLOR + 3
};

/** Means beyond this are cut, so that a wild offset cannot become an infinity. */
#define DECODE_MEAN_LIMIT 1e18f

/* A std-dev is at least this part of the Gaussian's largest: thinner needles and sheets are beyond what
   float32 can evaluate. */
#define DECODE_SCALE_RATIO 1e-4f

typedef struct decode_layout {
    size_t offset_count, input_count; /* input_count is the decoder's own: 35 or 36 */
    size_t out_count[HEAD_COUNT];     /* K, 7K, 3K */
    size_t out_stride[HEAD_COUNT];    /* the same, rounded up to DENSE_COLUMNS */
    size_t param_first[HEAD_COUNT];   /* of the head's part in decoder.params: W1, b1, W2, b2 */
} decode_layout;

decode_layout decode_layout_of(const decoder *d);

/** The networks as the kernels read them; every array points into one block. */
typedef struct decode_weights {
    float *input_hidden;           /* [INPUT_COUNT][HIDDEN_STRIDE] */
    float *hidden_bias;            /* [HIDDEN_STRIDE] */
    float *hidden_input;           /* [HIDDEN_STRIDE][ANCHOR_FEATURE_DIM] */
    float *hidden_out[HEAD_COUNT]; /* [ANCHOR_HIDDEN_DIM][out_stride] */
    float *out_bias[HEAD_COUNT];   /* [out_stride] */
    float *out_hidden[HEAD_COUNT]; /* [out_count][ANCHOR_HIDDEN_DIM] */
} decode_weights;

/** Pack the networks into tape->weights (grown as needed). */
gbt_status decode_pack_weights(const decoder *d, const decode_layout *layout, decode_tape *tape,
                               decode_weights *out, gbt_error *err);

/** The gradient of a log-scale that the adjoint found, or 0 where the forward pass cut it. */
static inline float decode_cut_gradient(float scale_log, float gradient)
{
    return scale_log >= -ACTIVATION_LIMIT && scale_log <= ACTIVATION_LIMIT ? gradient : 0.0f;
}

#endif
