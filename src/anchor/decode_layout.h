/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_layout.h -- memory layout of anchor chunks and packed networks, shared by the files of the
   decoder.

   An anchor's place is its index in `visible`. Places are divided into chunks of DECODE_CHUNK, whose scratch
   fits the second-level cache; a block of parallel work is DECODE_GRAIN places. A row is the scratch of one
   anchor of a chunk: there is one per place, or only one per anchor that has Gaussians. DECODE_CHUNK and
   DECODE_GRAIN are multiples of the register tile, so full chunks need no padding. */
#ifndef GBT_ANCHOR_DECODE_LAYOUT_H
#define GBT_ANCHOR_DECODE_LAYOUT_H

#include "anchor/activations.h"
#include "anchor/decode.h"
#include "anchor/dense.h"

enum {
    DECODE_CHUNK = 120,
    DECODE_GRAIN = 240,
    DECODE_TILE = 10,
    VIEW_COUNT = 4, /* direction, distance; the distance is 0 when it is not an input */
    INPUT_COUNT = ANCHOR_FEATURE_DIM + VIEW_COUNT,
    INPUT_ONE = INPUT_COUNT, /* index of a column of ones, which makes the bias gradient one more weight
                                gradient */
    INPUT_STRIDE = 40,       /* a multiple of the register tile: inputs are also rows of a matrix product */
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

/** Means are clamped to +- this, so that a huge offset cannot become infinite. */
#define DECODE_MEAN_LIMIT 1e18f

/* Every std-dev is at least this fraction of the Gaussian's largest: float32 cannot evaluate thinner needles
   and sheets accurately. */
#define DECODE_SCALE_RATIO 1e-4f

typedef struct decode_layout {
    size_t offset_count, input_count;              /* input_count is the decoder's own: 35 or 36 */
    size_t out_count[DECODER_NETWORKS];            /* K, 7K, 3K */
    size_t out_stride[DECODER_NETWORKS];           /* the same, rounded up to DENSE_COLUMNS */
    size_t out_first[DECODER_NETWORKS], out_width; /* offsets and total width of the networks' outputs side by
                                                      side, rounded up in the same way */
    size_t param_first[DECODER_NETWORKS];          /* start of each network in decoder.params: W1, b1, W2,
                                                      b2 */
} decode_layout;

decode_layout decode_layout_of(const decoder *d);

/** Number of rows, rounded up to whole register tiles. */
static inline size_t decode_tiled(size_t rows)
{
    return (rows + DECODE_TILE - 1) / DECODE_TILE * DECODE_TILE;
}

/** Packed network weights; all arrays point into one block. */
typedef struct decode_weights {
    float *input_hidden;                 /* [INPUT_COUNT][HIDDEN_STRIDE] */
    float *hidden_bias;                  /* [HIDDEN_STRIDE] */
    float *hidden_input;                 /* [HIDDEN_STRIDE][ANCHOR_FEATURE_DIM] */
    float *hidden_out[DECODER_NETWORKS]; /* [ANCHOR_HIDDEN_DIM][out_stride] */
    float *out_bias[DECODER_NETWORKS];   /* [out_stride] */
    float *out_hidden[DECODER_NETWORKS]; /* [out_count][ANCHOR_HIDDEN_DIM] */
} decode_weights;

/**
 * Viewing directions of some anchors: unit direction from the camera, and distance (or 0).
 *
 * @param which [in]  [rows] anchors; rows <= DECODE_CHUNK
 * @param view  [out] [rows][VIEW_COUNT]
 */
void decode_views(const anchors *a, const decoder *d, const float camera[3], const uint32_t *which,
                  size_t rows, float *view);

/**
 * Network inputs of some anchors: feature, view, and 1.
 *
 * @param which, view [in]  as in decode_views()
 * @param input       [out] [rows, rounded up to DECODE_TILE with rows of zeros][INPUT_STRIDE]
 */
void decode_inputs(const anchors *a, const uint32_t *which, const float *view, size_t rows, float *input);

/** Hidden layers of networks [first, end): hidden [tiled][(end - first) * ANCHOR_HIDDEN_DIM], after ReLU. */
void decode_hidden(const dense_kernels *kernels, const decode_weights *weights, const float *input,
                   size_t tiled, int first, int end, float *hidden);

/** Pack the network weights into tape->weights (grown as needed). */
gbt_status decode_pack_weights(const decoder *d, const decode_layout *layout, decode_tape *tape,
                               decode_weights *out, gbt_error *err);

/** Inputs and outputs of decode_activations_backward() for one chunk. */
typedef struct decode_slopes {
    const anchors *a;
    const decode_tape *tape;
    const decode_layout *layout;
    const gaussians *d_gaussians;
    size_t begin;                          /* the chunk's first entry in tape->place */
    const uint32_t *anchor, *target;       /* [rows]: index of each anchor, and its row in d_offset */
    const float *extent;                   /* [rows][6]: exp of the log-scales */
    float *d_out, *d_scale_log, *d_offset; /* [rows][out_width], [rows][6], [...][K][3] or NULL: d_scale_log
                                              and d_offset are added to; d_out is written only where there is
                                              a Gaussian */
} decode_slopes;

/** Adjoint of the activations of Gaussians [g, end), which all belong to the chunk. */
void decode_activations_backward(const decode_slopes *s, size_t g, size_t end);

/** Gradient of a log-scale: 0 where the forward pass clamped it. */
static inline float decode_cut_gradient(float scale_log, float gradient)
{
    return scale_log >= -ACTIVATION_LIMIT && scale_log <= ACTIVATION_LIMIT ? gradient : 0.0f;
}

#endif
