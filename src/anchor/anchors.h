/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/anchors.h -- the anchors of a neural Gaussian scene and the three small networks that decode them
   (Scaffold-GS).

   Raw parameters only: positions never move; offsets, features and log-scales learn. The same struct holds
   gradients and Adam moments. */
#ifndef GBT_ANCHOR_ANCHORS_H
#define GBT_ANCHOR_ANCHORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

enum { ANCHOR_FEATURE_DIM = 32, ANCHOR_HIDDEN_DIM = 32, ANCHOR_MAX_OFFSETS = 16 };

typedef struct anchors {
    size_t count, capacity;
    int offset_count; /* K, Gaussians per anchor, [1, ANCHOR_MAX_OFFSETS]; default 10 */
    float *position;  /* [count][3], scene-local units */
    float *feature;   /* [count][32] */
    float *offset;    /* [count][K][3], in units of exp(scale_log[0..2]) */
    float *scale_log; /* [count][6]: 0..2 scale the offsets, 3..5 bound the Gaussians' std-devs */
} anchors;

/** Keeps the first min(old, new) rows; new rows are zero; offset_count must be set first. On failure nothing
    changes. */
gbt_status anchors_resize(anchors *a, size_t count, gbt_error *err);
void anchors_free(anchors *a);

/* ---- networks ---- */

/** Inputs: feature(32), unit direction camera -> anchor (3), distance if has_distance (1). Hidden 32, ReLU.
    Heads: opacity K tanh, shape 7K, colour 3K sigmoid. */
typedef struct decoder {
    int offset_count;
    bool has_distance;
    float distance_scale; /* the distance input is |x - c| * distance_scale: 1 / median training distance; 1
                             in compat mode */
    float distance_min, distance_max; /* trained range (scaled): the input is cut to [min / 2, 2 max].
                                         decoder_init() gives 0, infinity */
    size_t param_count;               /* all weights and biases, one flat array */
    float *params; /* owned; layout: for opacity, shape, colour: W1 [32][in], b1 [32], W2 [out][32], b2 [out]
                    */
} decoder;

/** Uniform(-1/sqrt(fan_in), +1/sqrt(fan_in)) for weights and biases, from counter-based random numbers. */
gbt_status decoder_init(decoder *d, int offset_count, bool has_distance, uint64_t seed, gbt_error *err);
void decoder_free(decoder *d);

/** Where each network's part starts in params, and how long it is: {opacity, shape, colour}. They have
    learning rates of their own. */
typedef struct decoder_part {
    size_t begin, end;
} decoder_part;
void decoder_parts(const decoder *d, decoder_part parts[3]);

#endif
