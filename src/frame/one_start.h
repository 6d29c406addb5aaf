/* SPDX-License-Identifier: Apache-2.0 */
/* frame/one_start.h -- approximate a rolling shutter by rays with a common origin and moved Gaussians, for
   training. */
#ifndef GBT_FRAME_ONE_START_H
#define GBT_FRAME_ONE_START_H

#include "base/camera_lens.h"
#include "base/gaussians.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/**
 * Translate each Gaussian by the difference between the centre of the camera's own pose and the camera's
 * position at the time when the Gaussian's mean is exposed. Seen from that centre, the mean is then where the
 * moving camera saw it. The motion of the camera while the rest of the Gaussian is exposed is ignored.
 *
 * @param camera has a rolling shutter; Gaussians that it does not see stay
 * @param lens   its lens, prepared
 * @param g      [in,out] their means are changed; adjoints take the derivative of the moved mean by the mean
 *                        as the identity
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Cost: about 60 ns per Gaussian.
 */
gbt_status one_start_move(const gbt_camera *camera, const camera_lens *lens, gaussians *g, gbt_error *err);

#endif
