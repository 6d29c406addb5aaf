/* SPDX-License-Identifier: Apache-2.0 */
/* reference/decode_ref.h -- the decoder and its adjoint in double precision, as plain loops: the reference in
   tests of decode.c. */
#ifndef GBT_REFERENCE_DECODE_REF_H
#define GBT_REFERENCE_DECODE_REF_H

#include "anchor/anchors.h"

/** Parameters or their gradient, in double; shapes as in `anchors` and `decoder`. Owned; free with
    decode_ref_free(). */
typedef struct decode_ref {
    size_t count, param_count;
    int offset_count;
    bool has_distance;
    double distance_scale, distance_min, distance_max;
    double *params;
    union { /* same layout as in `anchors` */
        struct {
#define X(name, id, label, width, per_offset, meaning) double *name;
            ANCHOR_FIELD_LIST(X)
#undef X
        };
        double *field[ANCHOR_FIELDS];
    };
} decode_ref;

/** A copy of the parameters. */
gbt_status decode_ref_load(decode_ref *out, const anchors *a, const decoder *d, gbt_error *err);

/** Zeros with the shapes of `like`, to accumulate a gradient. */
gbt_status decode_ref_zero(decode_ref *out, const decode_ref *like, gbt_error *err);
void decode_ref_free(decode_ref *r);

/** Number of fields of one decoded Gaussian, in the order of base/gaussians.h. */
enum { DECODE_REF_FIELDS = 14 };

/**
 * Decode all slots of the visible anchors: decode_forward() without its selection of slots.
 *
 * @param out [out] [visible_count * K][14]; opacity is alpha, which may be negative
 * Threads: any.
 */
void decode_ref_forward(const decode_ref *r, const double camera_center[3], const uint32_t *visible,
                        size_t visible_count, double *out);

/** The adjoint: add dL/dparameter to `grad`, given dL/dslot in `d_out` ([visible_count * K][14], 0 for slots
    that decode_forward() does not keep). */
void decode_ref_backward(const decode_ref *r, const double camera_center[3], const uint32_t *visible,
                         size_t visible_count, const double *d_out, decode_ref *grad);

#endif
