/* SPDX-License-Identifier: Apache-2.0 */
/* train/loss.h -- the training loss: the image terms (L1, DSSIM) and the volume term of the Gaussians, with
   weights and gradients (Yang 2026, eq 35). All code that needs the loss of a run uses this file. Of the last
   term, how far apart the hits of a ray are, there is only a gradient: the rays' adjoint adds it
   (trace_settings.spread). */
#ifndef GBT_TRAIN_LOSS_H
#define GBT_TRAIN_LOSS_H

#include "anchor/anchors.h"
#include "base/gaussians.h"
#include "image/metrics.h"
#include "train/rules.h"

/**
 * The image terms: (1 - w) L1 + w (1 - SSIM), w = IMAGE_DSSIM_WEIGHT.
 *
 * @param shown, photo, valid, scratch, d_image, out [in,out] as image_loss()
 */
gbt_status loss_of_image(const image *shown, const image *photo, const unsigned char *valid,
                         loss_scratch *scratch, image *d_image, image_loss_result *out, gbt_error *err);

/** Contribution of one colour value to the image terms before the mean, for checks in double. */
double loss_of_value(double shown, double photo, double ssim);

/** Weight of the mean volume of Gaussians (the product of the three scales) in the loss: 0.01, with scales in
    sixths of the median distance between cameras and anchors, so that training does not depend on the unit of
    length. The reference uses the data's unit. */
double loss_volume_weight(const train_rules *rules, const decoder *d);

/** The volume term: mean volume of the Gaussians times `volume_weight`; 0 without Gaussians. */
double loss_of_gaussians(const gaussians *g, double volume_weight);

/** Adds the gradient of loss_of_gaussians() to `d`. */
void loss_add_gradient(const gaussians *g, double volume_weight, gaussians *d);

/** Contribution of one Gaussian to loss_of_gaussians() before the mean, for checks in double. `field`: in the
    order of GAUSSIANS_FIELDS. */
double loss_of_gaussian(const double field[GAUSSIANS_FIELD_COUNT], double volume_weight);

#endif
