/* SPDX-License-Identifier: Apache-2.0 */
/* bake/backdrop.h -- the model's background as Gaussians, because files of plain Gaussians cannot store a
   background and viewers use black. */
#ifndef GBT_BAKE_BACKDROP_H
#define GBT_BAKE_BACKDROP_H

#include "base/sky.h"
#include "gbtrace/camera.h"
#include "data/gaussian_cloud.h"

enum { BACKDROP_COUNT = 1000 };

/**
 * Append a closed sphere of BACKDROP_COUNT opaque Gaussians, so far out that every camera sees it behind all
 * others.
 *
 * Its centre is the centre of the cameras. Its radius is twice the distance of the farthest Gaussian, and at
 * least four times that of the farthest camera. Seen from any camera, the transmittance of the sphere is
 * below 1/255 in every direction.
 *
 * @param cloud   [in,out] at least one Gaussian; owned arrays are replaced
 * @param cameras [in]     count >= 1, in the cloud's coordinates
 * @param color   [in]     [0, 1]
 * @param behind  [in]     light that depends on the direction, added to `color`; evaluated from the centre
 * @return GBT_OK; GBT_ERR_NO_MEMORY, which leaves the cloud unchanged
 */
gbt_status backdrop_add(gaussian_cloud *cloud, const gbt_camera *cameras, size_t count, const float color[3],
                        const sky *behind, gbt_error *err);

#endif
