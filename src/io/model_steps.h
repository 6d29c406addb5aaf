/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_steps.h -- how coarsely each number of a model may be quantized: the sensitivity of pictures to
   it, and the resulting step.

   A change of the parameters by e changes the pictures by J e. The sensitivity of a parameter is its diagonal
   element s of J^T J: the mean squared change of a pixel per squared change of the parameter. For a given
   total loss the fewest bits are needed when every parameter contributes equally, so a step is proportional
   to 1 / sqrt(s). s is estimated with one adjoint pass per picture on random signs n (Hutchinson 1990):
   E[(J^T n)(J^T n)^T] = J^T J. */
#ifndef GBT_IO_MODEL_STEPS_H
#define GBT_IO_MODEL_STEPS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"
#include "io/model.h"

/** The learned fields of the anchors, in the order of their parts in a coded file and of their columns:
    X(PART, name of the part, anchor_field, divisor, most, of_largest). The smallest step is unit / divisor,
    the largest is most x unit; the unit is the field's largest value if of_largest, else 1. */
#define CODE_FIELD_LIST(X)                                                                                   \
    X(SCALES, "scales", ANCHOR_SCALE_LOG, 1024, 0.25, false)                                                 \
    X(OFFSETS, "offsets", ANCHOR_OFFSET, 4096, 0.25, false)                                                  \
    X(FEATURES, "features", ANCHOR_FEATURE, 65536, 1, true)

/** The largest number of floats that one anchor has in a field. */
enum { MODEL_WIDTH_MAX = ANCHOR_MAX_OFFSETS * 3 };

/**
 * Sensitivities. Between _start() and _end() these are sums over pictures; after _end(), the mean squared
 * change of a pixel per squared change of a parameter of one anchor.
 */
typedef struct model_sensitivity {
    size_t count;  /* anchors */
    double values; /* pixels x 3, summed over all pictures; 1 after _end() */
    double position, field[ANCHOR_FIELDS][MODEL_WIDTH_MAX]; /* mean over anchors; only learned fields */
    double feature[ANCHOR_FEATURE_DIM][ANCHOR_FEATURE_DIM]; /* mean over anchors of the matrix J^T J, used
                                                               instead of the field's diagonal */
    double *anchor; /* [count]: mean over the parameters of each anchor; NULL: not known separately */
} model_sensitivity;

/** Start from {0}; free with model_sensitivity_free(). */
gbt_status model_sensitivity_start(model_sensitivity *s, size_t count, gbt_error *err);

/**
 * Add one picture.
 *
 * @param gradient [in] dL/d(learned fields) of each anchor, where dL/dpixel are independent random signs, +1
 *                      or -1
 * @param values   [in] pixels x channels of the picture
 * Cost: about 1000 multiply-adds per anchor that has a gradient.
 */
void model_sensitivity_add(model_sensitivity *s, const anchors *a, const anchors *gradient, double values);

/**
 * Turn the sums into means. Directions of the features with nearly no sensitivity get a small one: the linear
 * model says nothing about the large changes that would otherwise be allowed there.
 */
void model_sensitivity_end(model_sensitivity *s);

/**
 * Estimate the sensitivities from the model alone, when there are no views: its Gaussians are seen from
 * places around anchors, each weighted with the area that it could cover. Single anchors are not
 * distinguished. Includes _start() and _end().
 *
 * Cost: 16 decodes of all anchors with their adjoint.
 */
gbt_status model_sensitivity_guess(const model *m, model_sensitivity *s, gbt_error *err);

void model_sensitivity_free(model_sensitivity *s);

/**
 * Transform the features of a model to the basis that needs the fewest bits, and its networks accordingly: f
 * becomes T (f - mean f), and W1 becomes W1 T^-1. The model decodes to the same Gaussians up to rounding. `s`
 * is transformed, too.
 *
 * T is chosen such that T^-T S T^-1 is a multiple of the identity (S: sensitivity; noise then has the same
 * effect in every direction) and T C T^T is diagonal with descending elements (C: covariance of the
 * features).
 */
gbt_status model_transform_features(model *m, model_sensitivity *s, gbt_error *err);

/** Quantization steps; each > 0 and finite. */
typedef struct model_steps {
    double position;                             /* side of a cell, scene units */
    float field[ANCHOR_FIELDS][MODEL_WIDTH_MAX]; /* of learned fields */
    size_t count;                                /* number of anchors in `doubling` */
    uint8_t *doubling; /* [count]: an anchor's steps (except for its position) are multiplied by 2^this, [0,
                          2]; NULL: all 0 */
} model_steps;

/** Whether cells as small as `quality` requires can span the model with 2^20 cells from the first anchor to
    the farthest; false if an anchor is very far from the others. */
bool model_positions_fit(const model *m, const model_sensitivity *s, double quality);

/**
 * The steps of a model at a quality; deterministic. Where model_positions_fit() is false, the cells of
 * positions are larger than the quality requires.
 *
 * @param quality [in] dB, (0, 200): -10 log10 of the intended mean squared change of the pictures
 * @param out     [out] start from {0}; free with model_steps_free()
 */
gbt_status model_steps_at(const model *m, const model_sensitivity *s, double quality, model_steps *out,
                          gbt_error *err);

void model_steps_free(model_steps *steps);

#endif
