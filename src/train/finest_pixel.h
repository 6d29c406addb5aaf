/* SPDX-License-Identifier: Apache-2.0 */
/* train/finest_pixel.h -- how finely the training views sampled each anchor. */
#ifndef GBT_TRAIN_FINEST_PIXEL_H
#define GBT_TRAIN_FINEST_PIXEL_H

#include "anchor/anchors.h"
#include "gbtrace/camera.h"

/**
 * The size of the smallest pixel that any of the cameras has at each anchor: the photos hold no finer detail
 * of it.
 *
 * @param cameras [in]  [camera_count], at the size at which their photos were compared
 * @param out     [out] [a->count] scene-local units (trace/footprint.h); 0 for anchors that no camera sees
 * Threads: uses all; same bits for every thread count. Cost: less than 100 ns per anchor and camera.
 */
void finest_pixel_find(const anchors *a, const gbt_camera *cameras, size_t camera_count, float *out);

#endif
