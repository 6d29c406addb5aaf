/* SPDX-License-Identifier: Apache-2.0 */
/* train/loss.h -- the training loss: terms of the picture (L1, DSSIM) and of the Gaussians themselves
   (volume), with their weights and gradients. Everybody who needs the loss of a run takes it from here. */
#ifndef GBT_TRAIN_LOSS_H
#define GBT_TRAIN_LOSS_H

#include "anchor/anchors.h"
#include "base/gaussians.h"
#include "image/metrics.h"
#include "train/rules.h"

/**
 * The picture's terms: (1 - w) L1 + w (1 - SSIM), w = IMAGE_DSSIM_WEIGHT.
 *
 * @param shown, photo, valid, scratch, d_image, out [in,out] as image_loss()
 */
gbt_status loss_of_image(const image *shown, const image *photo, const unsigned char *valid,
                         loss_scratch *scratch, image *d_image, image_loss_result *out, gbt_error *err);

/** One value's share of the picture's terms before the mean, for checks in double. */
double loss_of_value(double shown, double photo, double ssim);

/** What the mean volume of Gaussians (the product of the scales) counts in the loss: 0.01, with lengths in
   sixths of the median distance between cameras and anchors, so that a scene is trained alike whatever its
   unit of length; the reference takes that unit. */
double loss_volume_weight(const train_rules *rules, const decoder *d);

/** The Gaussians' terms: their mean volume times that weight; 0 without Gaussians. */
double loss_of_gaussians(const gaussians *g, double volume_weight);

/** Adds the gradient of loss_of_gaussians() to `d`. */
void loss_add_gradient(const gaussians *g, double volume_weight, gaussians *d);

/** One Gaussian's share of loss_of_gaussians() before the mean, for checks in double. `field`: in the order
   of GAUSSIANS_FIELDS. */
double loss_of_gaussian(const double field[GAUSSIANS_FIELD_COUNT], double volume_weight);

#endif
