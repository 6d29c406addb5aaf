/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/anchors.h -- the anchors of a neural Gaussian scene and the three small networks that decode them
   (Scaffold-GS).

   Parameters are stored before activations. Positions are fixed; features, offsets and log-scales are
   trained. The same struct is used for gradients and Adam moments. */
#ifndef GBT_ANCHOR_ANCHORS_H
#define GBT_ANCHOR_ANCHORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "anchor/rows.h"
#include "gbtrace/status.h"

enum { ANCHOR_FEATURE_DIM = 32, ANCHOR_HIDDEN_DIM = 32, ANCHOR_MAX_OFFSETS = 16 };

/** Every array of the anchors, listed once: allocation, gradients, Adam moments and files are loops over this
    list. The position is fixed; the others are trained (rates: train/learnables.c).

    X(name, label, width, per_offset, meaning): label is the name in messages; a row has `width` floats, or
    with per_offset `width` floats for each of the K Gaussians. */
#define ANCHOR_FIELD_LIST(X)                                                                                 \
    X(position, POSITION, "position", 3, false, "scene-local units")                                         \
    X(feature, FEATURE, "feature", ANCHOR_FEATURE_DIM, false, "input of the networks")                       \
    X(offset, OFFSET, "offset", 3, true, "of each Gaussian, in units of exp(scale_log[0..2])")               \
    X(scale_log, SCALE_LOG, "scale", 6, false, "0..2 scale the offsets, 3..5 bound the std-devs")

typedef enum anchor_field {
#define X(name, id, label, width, per_offset, meaning) ANCHOR_##id,
    ANCHOR_FIELD_LIST(X)
#undef X
        ANCHOR_FIELDS,
    ANCHOR_FIRST_LEARNED = ANCHOR_FEATURE /* this field and all that follow are trained */
} anchor_field;

extern const row_field anchor_fields[ANCHOR_FIELDS];

typedef struct anchors {
    size_t count, capacity;
    int offset_count; /* K, Gaussians per anchor, [1, ANCHOR_MAX_OFFSETS] */
    union {           /* owned arrays [count][width] or [count][K][width]: by name, or by anchor_field */
        struct {
#define X(name, id, label, width, per_offset, meaning) float *name;
            ANCHOR_FIELD_LIST(X)
#undef X
        };
        float *field[ANCHOR_FIELDS];
    };
} anchors;

/** Number of floats per anchor in a field. */
static inline size_t anchors_width(const anchors *a, int field)
{
    return row_field_width(&anchor_fields[field], a->offset_count);
}

/** Resize: the first min(old, new) rows are kept, new rows are zero; offset_count must be set before. On
    failure nothing changes. */
gbt_status anchors_resize(anchors *a, size_t count, gbt_error *err);
void anchors_free(anchors *a);

/** Copy every row of every field; both must have the same shape. */
void anchors_copy(anchors *to, const anchors *from);

/** Set every trained field to 0: clears gradients before accumulation. */
void anchors_zero_learned(anchors *a);

/* ---- networks ---- */

/** The three networks. Inputs: feature (32), unit direction from camera to anchor (3), distance if
    has_distance (1). Hidden 32, ReLU. Networks: opacity K tanh, shape 7K, colour 3K sigmoid. */
typedef struct decoder {
    int offset_count;
    bool has_distance;
    float distance_scale; /* the distance input is |x - c| * distance_scale; 1 / median training distance, or
                             1 */
    float distance_min, distance_max; /* range of scaled distances in training: the input is clamped to [min /
                                         2, 2 max]. decoder_init() sets 0 and infinity */
    size_t param_count;               /* all weights and biases, one flat array */
    float *params; /* owned; layout: for opacity, shape, colour: W1 [32][in], b1 [32], W2 [out][32], b2 [out]
                    */
} decoder;

/** Uniform(-1/sqrt(fan_in), +1/sqrt(fan_in)) for weights and biases, from counter-based random numbers. */
gbt_status decoder_init(decoder *d, int offset_count, bool has_distance, uint64_t seed, gbt_error *err);
void decoder_free(decoder *d);

/** The networks, listed once, in the order of their parameters: X(id, label, outputs per Gaussian). Each has
    its own learning rate (train/learnables.c). */
#define DECODER_NETWORK_LIST(X)                                                                              \
    X(OPACITY, "opacity", 1)                                                                                 \
    X(SHAPE, "shape", 7)                                                                                     \
    X(COLOR, "colour", 3)

enum {
#define X(id, label, outputs) DECODER_##id,
    DECODER_NETWORK_LIST(X)
#undef X
        DECODER_NETWORKS
};

/** Outputs per Gaussian. */
enum {
#define X(id, label, outputs) DECODER_##id##_OUTPUTS = outputs,
    DECODER_NETWORK_LIST(X)
#undef X
};

/** A network and its range in decoder.params. */
typedef struct decoder_network {
    const char *label;
    size_t outputs; /* for each Gaussian */
    size_t begin, end;
} decoder_network;
void decoder_networks(const decoder *d, decoder_network networks[DECODER_NETWORKS]);

#endif
