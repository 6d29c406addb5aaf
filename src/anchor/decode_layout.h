/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_layout.h -- how the files of the decoder lay out anchors and packed networks in memory, and
   what they share.

   An anchor's place is its index in `visible`. Places are cut into chunks of DECODE_CHUNK, whose scratch
   stays in the second-level cache; a parallel block is DECODE_GRAIN places. A row is an anchor's in the
   scratch of its chunk: for each place of the chunk one, or for those alone that have Gaussians. Both sizes
   are multiples of the register tile, so chunks that are full of rows need no padding. */
#ifndef GBT_ANCHOR_DECODE_LAYOUT_H
#define GBT_ANCHOR_DECODE_LAYOUT_H

#include "anchor/activations.h"
#include "anchor/decode.h"
#include "anchor/dense.h"
#include "base/compare.h"

enum {
    DECODE_CHUNK = 120,
    DECODE_GRAIN = 240,
    DECODE_TILE = 10,
    VIEW_COUNT = 4, /* direction, distance; the distance is 0 when the networks do not have it */
    INPUT_COUNT = ANCHOR_FEATURE_DIM + VIEW_COUNT,
    INPUT_ONE = INPUT_COUNT, /* a column of ones: it turns the bias gradient into one more weight gradient */
    INPUT_STRIDE = 40,       /* a multiple of the register tile: inputs are rows of a product, too */
    HIDDEN_STRIDE = DECODER_NETWORKS * ANCHOR_HIDDEN_DIM,
    ALPHA_STRIDE = ANCHOR_MAX_OFFSETS,
    SHAPE_STRIDE_MAX = DECODER_SHAPE_OUTPUTS * ANCHOR_MAX_OFFSETS,
    COLOR_STRIDE_MAX = DECODER_COLOR_OUTPUTS * ANCHOR_MAX_OFFSETS,
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
    size_t offset_count, input_count;              /* input_count is the decoder's own: 35 or 36 */
    size_t out_count[DECODER_NETWORKS];            /* K, 7K, 3K */
    size_t out_stride[DECODER_NETWORKS];           /* the same, rounded up to DENSE_COLUMNS */
    size_t out_first[DECODER_NETWORKS], out_width; /* the networks' outputs side by side, so rounded up */
    size_t param_first[DECODER_NETWORKS];          /* of the network in decoder.params: W1, b1, W2, b2 */
} decode_layout;

decode_layout decode_layout_of(const decoder *d);

/** Rows rounded up to whole register tiles. */
static inline size_t decode_tiled(size_t rows)
{
    return (rows + DECODE_TILE - 1) / DECODE_TILE * DECODE_TILE;
}

/** The networks as the kernels read them; every array points into one block. */
typedef struct decode_weights {
    float *input_hidden;                 /* [INPUT_COUNT][HIDDEN_STRIDE] */
    float *hidden_bias;                  /* [HIDDEN_STRIDE] */
    float *hidden_input;                 /* [HIDDEN_STRIDE][ANCHOR_FEATURE_DIM] */
    float *hidden_out[DECODER_NETWORKS]; /* [ANCHOR_HIDDEN_DIM][out_stride] */
    float *out_bias[DECODER_NETWORKS];   /* [out_stride] */
    float *out_hidden[DECODER_NETWORKS]; /* [out_count][ANCHOR_HIDDEN_DIM] */
} decode_weights;

/**
 * Where some anchors are seen from: unit direction from the camera, and distance or 0.
 *
 * @param which [in]  [rows] anchors; rows <= DECODE_CHUNK
 * @param view  [out] [rows][VIEW_COUNT]
 */
void decode_views(const anchors *a, const decoder *d, const float camera[3], const uint32_t *which,
                  size_t rows, float *view);

/**
 * What the networks see of some anchors: feature, view, and 1.
 *
 * @param which, view [in]  as decode_views() has them
 * @param input       [out] [rows, rounded up to DECODE_TILE with rows of zeros][INPUT_STRIDE]
 */
void decode_inputs(const anchors *a, const uint32_t *which, const float *view, size_t rows, float *input);

/** Hidden layers of the networks [first, end): hidden [tiled][(end - first) * ANCHOR_HIDDEN_DIM], after ReLU.
 */
void decode_hidden(const dense_kernels *kernels, const decode_weights *weights, const float *input,
                   size_t tiled, int first, int end, float *hidden);

/** Pack the networks into tape->weights (grown as needed). */
gbt_status decode_pack_weights(const decoder *d, const decode_layout *layout, decode_tape *tape,
                               decode_weights *out, gbt_error *err);

/** A chunk of the adjoint: what decode_activations_backward() needs, and where it writes to. */
typedef struct decode_slopes {
    const anchors *a;
    const decode_tape *tape;
    const decode_layout *layout;
    const gaussians *d_gaussians;
    size_t begin;                          /* the chunk's first entry in tape->place */
    const uint32_t *anchor, *target;       /* [rows]: the anchors, and their rows in d_offset */
    const float *extent;                   /* [rows][6]: exp of the log-scales */
    float *d_out, *d_scale_log, *d_offset; /* [rows][out_width], [rows][6], [...][K][3] or NULL: added to, but
                                              for d_out, whose places without a Gaussian are left alone */
} decode_slopes;

/** Through the activations of Gaussians [g, end), all of the chunk. */
void decode_activations_backward(const decode_slopes *s, size_t g, size_t end);

/** The gradient of a log-scale that the adjoint found, or 0 where the forward pass cut it. */
static inline float decode_cut_gradient(float scale_log, float gradient)
{
    return scale_log >= -ACTIVATION_LIMIT && scale_log <= ACTIVATION_LIMIT ? gradient : 0.0f;
}

#endif
