/* SPDX-License-Identifier: Apache-2.0 */
/* frame/one_start.h -- what a camera sees that moves while it is read out, by rays that start at one point:
   an approximation, for training. */
#ifndef GBT_FRAME_ONE_START_H
#define GBT_FRAME_ONE_START_H

#include "base/camera_lens.h"
#include "base/gaussians.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/**
 * Move each Gaussian as the camera moves, the other way: by what lies between the centre of the camera's own
 * pose and where the camera is when the mean of the Gaussian is taken. From the former, the mean is then
 * where it is from the latter. What the camera moves while the rest of the Gaussian is taken is left out.
 *
 * @param camera with a rolling shutter; Gaussians that it does not see stay
 * @param lens   its lens, prepared
 * @param g      [in,out] means; the derivative of a moved mean by the mean is taken to be 1
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Cost: about 60 ns per Gaussian.
 */
gbt_status one_start_move(const gbt_camera *camera, const camera_lens *lens, gaussians *g, gbt_error *err);

#endif
