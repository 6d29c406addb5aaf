/* SPDX-License-Identifier: Apache-2.0 */
/* bake/backdrop.h -- the model's background as Gaussians: files of plain Gaussians have no background, and
   viewers draw them on black. */
#ifndef GBT_BAKE_BACKDROP_H
#define GBT_BAKE_BACKDROP_H

#include "base/sky.h"
#include "gbtrace/camera.h"
#include "data/gaussian_cloud.h"

enum { BACKDROP_COUNT = 1000 };

/**
 * Append a closed sphere of BACKDROP_COUNT opaque Gaussians, so far out that every camera sees
 * it behind all others.
 *
 * Its middle is that of the cameras. Its radius is twice the distance of the farthest Gaussian, and at least
 * four times that of the farthest camera. From each camera less than 1/255 of what lies behind shines
 * through, in every direction.
 *
 * @param cloud   [in,out] at least one Gaussian; owned arrays are replaced
 * @param cameras [in]     count >= 1, in the cloud's coordinates
 * @param color   [in]     [0, 1]
 * @param behind  [in]     what is added to it by direction, as seen from the middle
 * @return GBT_OK or GBT_ERR_NO_MEMORY, and then the cloud is as it was
 */
gbt_status backdrop_add(gaussian_cloud *cloud, const gbt_camera *cameras, size_t count, const float color[3],
                        const sky *behind, gbt_error *err);

#endif
