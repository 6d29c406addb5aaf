/* SPDX-License-Identifier: Apache-2.0 */
/* train/gradient_check.h -- may a gradient go into the optimizer? */
#ifndef GBT_TRAIN_GRADIENT_CHECK_H
#define GBT_TRAIN_GRADIENT_CHECK_H

#include "frame/frame.h"
#include "image/affine.h"
#include "train/learnables.h"

/** A larger gradient is treated like NaN: Adam squares it, and the square must stay finite. */
#define GRADIENT_LIMIT 1e18f

/**
 * Check every gradient of the last frame_backward_anchors() of `f`: the rows of the visible anchors, the
 * networks, and the photo's exposure.
 *
 * @param g        [in]  a row for each anchor or for each visible one, as in frame_backward_anchors()
 * @param exposure [in]  [12] gradient of the photo's colour matrix; NULL when there is none
 * @param where    [out] "feature of anchor 17, value 3", "shape network, value 200": the first bad one, in
 *                       the order feature, offset, scale, opacity, shape and colour network, exposure;
 *                       untouched when all are good
 * @return true when one of them is NaN or larger than GRADIENT_LIMIT
 * Threads: parallel inside. Cost: one read of these rows.
 */
bool gradient_is_bad(const learnables *g, const frame *f, const decoder *d,
                     const double exposure[AFFINE_NUMBERS], char *where, size_t size);

#endif
