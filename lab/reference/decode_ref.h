/* SPDX-License-Identifier: Apache-2.0 */
/* reference/decode_ref.h -- the decoder and its adjoint once more, in double and plain loops: what decode.c
   is tested against. */
#ifndef GBT_REFERENCE_DECODE_REF_H
#define GBT_REFERENCE_DECODE_REF_H

#include "anchor/anchors.h"

/** Parameters, or their gradient, in double; shapes as in anchors and decoder. Owned; free with
    decode_ref_free(). */
typedef struct decode_ref {
    size_t count, param_count;
    int offset_count;
    bool has_distance;
    double distance_scale, distance_min, distance_max;
    double *params;
    union { /* as in anchors */
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

/** All zeros with the shapes of `like`: where a gradient starts. */
gbt_status decode_ref_zero(decode_ref *out, const decode_ref *like, gbt_error *err);
void decode_ref_free(decode_ref *r);

/** Fields of one Gaussian, in the order of base/gaussians.h. */
enum { DECODE_REF_FIELDS = 14 };

/**
 * Decode every slot of the visible anchors: decode_forward() without the selection.
 *
 * @param out [out] [visible_count * K][14]; opacity is alpha, also where it is negative
 * Threads: any.
 */
void decode_ref_forward(const decode_ref *r, const double camera_center[3], const uint32_t *visible,
                        size_t visible_count, double *out);

/** Adjoint: adds dL/dparameter to `grad` for dL/dslot `d_out` ([visible_count * K][14], 0 for slots that were
    not kept). */
void decode_ref_backward(const decode_ref *r, const double camera_center[3], const uint32_t *visible,
                         size_t visible_count, const double *d_out, decode_ref *grad);

#endif
