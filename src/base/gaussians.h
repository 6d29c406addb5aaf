/* SPDX-License-Identifier: Apache-2.0 */
/* base/gaussians.h -- the arrays of Gaussians that a decode writes and every renderer reads, and their
   gradients.

   One float array per field, 64-byte aligned, padded to GAUSSIANS_LANES with Gaussians of opacity 0, so that
   kernels process whole vectors and the padding contributes exactly nothing. The same struct with the same
   fields holds the gradient dL/dfield. */
#ifndef GBT_BASE_GAUSSIANS_H
#define GBT_BASE_GAUSSIANS_H

#include <stddef.h>

#include "gbtrace/status.h"

enum { GAUSSIANS_LANES = 16, GAUSSIANS_FIELD_COUNT = 14 };

#define GAUSSIANS_FIELDS(X) /* X(name, pad value, meaning) */                                                \
    X(mean_x, 0.0f, "centre, scene-local units")                                                             \
    X(mean_y, 0.0f, "")                                                                                      \
    X(mean_z, 0.0f, "")                                                                                      \
    X(scale_x, 1.0f, "std-dev along the local axes, > 0 (linear, not log)")                                  \
    X(scale_y, 1.0f, "")                                                                                     \
    X(scale_z, 1.0f, "")                                                                                     \
    X(quat_w, 1.0f, "unit quaternion, local to world; its gradient is tangent")                              \
    X(quat_x, 0.0f, "")                                                                                      \
    X(quat_y, 0.0f, "")                                                                                      \
    X(quat_z, 0.0f, "")                                                                                      \
    X(opacity, 0.0f, "[0, 1]")                                                                               \
    X(red, 0.0f, "colour, as it is blended")                                                                 \
    X(green, 0.0f, "")                                                                                       \
    X(blue, 0.0f, "")

typedef struct gaussians {
    size_t count;    /* in use */
    size_t capacity; /* allocated, a multiple of GAUSSIANS_LANES */
#define X(name, pad, meaning) float *name;
    GAUSSIANS_FIELDS(X)
#undef X
} gaussians;

/** Make room for `count` Gaussians and set count; contents of all fields are then undefined. Start from
    `gaussians g = {0};`. */
gbt_status gaussians_resize(gaussians *g, size_t count, gbt_error *err);

/** Write the pad values into [count, count rounded up to GAUSSIANS_LANES). Call after filling the fields. */
void gaussians_pad(gaussians *g);

/** All fields to 0, padding included: the state in which gradients start. */
void gaussians_zero(gaussians *g);

/** Set only the padding to 0. */
void gaussians_zero_padding(gaussians *g);

/** Copy all fields of [begin, end) of `g` to the same indices of `out`, which has room for them. */
void gaussians_copy_range(const gaussians *g, size_t begin, size_t end, gaussians *out);

/** `out` becomes a copy of `g`, padded. `out` as for gaussians_resize(); not `g`. */
gbt_status gaussians_copy(const gaussians *g, gaussians *out, gbt_error *err);

void gaussians_free(gaussians *g);

#endif
