/* SPDX-License-Identifier: Apache-2.0 */
/* stability/gradient.h -- the tracer's gradient against differences in double, for the cases of the study
   "stability". */
#ifndef GBT_STABILITY_GRADIENT_H
#define GBT_STABILITY_GRADIENT_H

#include "stability/draw.h"

typedef struct gradient_error {
    double relative; /* L2 of the error over L2 of the differences; of the gradient itself where those are all
                        0 */
    size_t bad;      /* values that are not finite */
} gradient_error;

/**
 * Gradient of the sum of all values of the picture by all fields of all Gaussians.
 *
 * @param d_gaussians [out] the tracer's own; start from {0}
 */
gradient_error draw_gradient_error(stability *s, const gaussians *g, const trace_settings *settings,
                                   const ray_image *rays, gaussians *d_gaussians);

#endif
