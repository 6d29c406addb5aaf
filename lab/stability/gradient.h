/* SPDX-License-Identifier: Apache-2.0 */
/* stability/gradient.h -- compare the tracer's gradient with finite differences in double, for the cases of
   the study "stability". */
#ifndef GBT_STABILITY_GRADIENT_H
#define GBT_STABILITY_GRADIENT_H

#include "stability/stability.h"
#include "trace/rays.h"
#include "trace/settings.h"

typedef struct gradient_error {
    double relative; /* L2 norm of the error / L2 norm of the differences; if those are all 0, L2 norm of the
                        gradient */
    size_t bad;      /* values that are not finite */
} gradient_error;

/**
 * Gradient of the sum of all pixel values with respect to all fields of all Gaussians.
 *
 * @param d_gaussians [out] the tracer's gradient; start from {0}
 */
gradient_error draw_gradient_error(stability *s, const gaussians *g, const trace_settings *settings,
                                   const ray_image *rays, gaussians *d_gaussians);

#endif
