/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_steps.h -- how coarsely each number of a model may be stored: what a picture loses by it, and the
   steps that follow.

   A change of a parameter by e changes the pictures by J e; what counts is s = J^T J, the mean squared change
   of a pixel per squared unit. At a given loss the fewest bits are spent when every parameter loses the same:
   its step is proportional to 1 / sqrt(s). s comes from adjoint passes of random signs (Hutchinson 1990), for
   which E[(J^T n)(J^T n)^T] = J^T J. */
#ifndef GBT_IO_MODEL_STEPS_H
#define GBT_IO_MODEL_STEPS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"
#include "io/model.h"

/** What learns of the anchors, in the order of its parts of a coded file and of its columns: X(PART, name of
   the part, anchor_field, and the limits of its steps: the least is a unit / divisor, the most in units; the
   unit is the largest value if of_largest, else 1). */
#define CODE_FIELD_LIST(X)                                                                                   \
    X(SCALES, "scales", ANCHOR_SCALE_LOG, 1024, 0.25, false)                                                 \
    X(OFFSETS, "offsets", ANCHOR_OFFSET, 4096, 0.25, false)                                                  \
    X(FEATURES, "features", ANCHOR_FEATURE, 65536, 1, true)

/** Most floats that one anchor has in a field. */
enum { MODEL_WIDTH_MAX = ANCHOR_MAX_OFFSETS * 3 };

/**
 * Between _start() and _end() sums over pictures, then: mean squared change of a pixel per squared change of
 * the parameter of one anchor.
 */
typedef struct model_sensitivity {
    size_t count;  /* anchors */
    double values; /* pixels x 3 of all pictures, of a moment: 1 after _end() */
    double position, field[ANCHOR_FIELDS][MODEL_WIDTH_MAX]; /* mean over anchors; fields that learn */
    double feature[ANCHOR_FEATURE_DIM][ANCHOR_FEATURE_DIM]; /* mean over anchors of the matrix J^T J: in place
                                                               of their field */
    double *anchor; /* [count]: mean over the parameters of each anchor; NULL: not told apart */
} model_sensitivity;

/** Start from {0}; free with model_sensitivity_free(). */
gbt_status model_sensitivity_start(model_sensitivity *s, size_t count, gbt_error *err);

/**
 * Add one picture.
 *
 * @param gradient [in] rows of dL/d(what learns) where dL/dpixel is +1 or -1 at random, and
 *                      independent
 * @param values   [in] pixels x channels
 * Cost: about 1000 multiply-adds per anchor that has a gradient.
 */
void model_sensitivity_add(model_sensitivity *s, const anchors *a, const anchors *gradient, double values);

/**
 * Sums to means. Directions of the features that hardly count are made to count a little: what is far beyond
 * their linear range is not known.
 */
void model_sensitivity_end(model_sensitivity *s);

/**
 * An estimate from the model alone, for when there are no views: its Gaussians seen from places around
 * anchors, each weighted with the area it could cover. Anchors are not told apart. _start() and _end() are
 * done here.
 *
 * Cost: 16 decodes of all anchors with their adjoint.
 */
gbt_status model_sensitivity_guess(const model *m, model_sensitivity *s, gbt_error *err);

void model_sensitivity_free(model_sensitivity *s);

/**
 * Turn the features of a model into the basis in which the fewest bits code them, and its networks with them:
 * f becomes T (f - mean f), W1 becomes W1 T^-1. The model decodes to the same Gaussians but for rounding. `s`
 * is turned too.
 *
 * T^-T S T^-1 is a multiple of 1 (noise counts the same in every direction) and T C T^T is diagonal, falling
 * (C: covariance of the features).
 */
gbt_status model_turn_features(model *m, model_sensitivity *s, gbt_error *err);

/** Steps of quantisation; each > 0 and finite. */
typedef struct model_steps {
    double position;                             /* side of a cell, scene units */
    float field[ANCHOR_FIELDS][MODEL_WIDTH_MAX]; /* of fields that learn */
    size_t count;                                /* of doublings: anchors */
    uint8_t *doubling; /* [count]: the steps of an anchor (not its position) are 2^this as large, [0, 2];
                          NULL: all 0 */
} model_steps;

/** Whether the 2^20 cells between the farthest anchors can be as small as a quality wants: not where one
    anchor is very far from the others. */
bool model_positions_fit(const model *m, const model_sensitivity *s, double quality);

/**
 * The steps of a model at a quality; deterministic. Cells of positions are larger than wanted where
 * model_positions_fit() says no.
 *
 * @param quality [in] dB, (0, 200): -10 log10 of the mean squared change of pictures to aim at
 * @param out     [out] start from {0}; free with model_steps_free()
 */
gbt_status model_steps_at(const model *m, const model_sensitivity *s, double quality, model_steps *out,
                          gbt_error *err);

void model_steps_free(model_steps *steps);

#endif
