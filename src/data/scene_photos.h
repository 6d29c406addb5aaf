/* SPDX-License-Identifier: Apache-2.0 */
/* data/scene_photos.h -- finds the photos and masks of a COLMAP model. */
#ifndef GBT_DATA_SCENE_PHOTOS_H
#define GBT_DATA_SCENE_PHOTOS_H

#include "data/raw.h"

/**
 * Find the photo of each view: `folder`/images/NAME, else `folder`/NAME. Views without one are removed from
 * `raw` and counted.
 *
 * If there is a folder `folder`/masks, the mask of a view is masks/NAME.png, else masks/NAME, else masks/NAME
 * with its ending replaced by .png.
 * @return GBT_OK; GBT_ERR_IO when no view has a photo; GBT_ERR_ARGUMENT (a path is too long),
 *         GBT_ERR_NO_MEMORY
 */
gbt_status scene_find_photos(const char *folder, raw_scene *raw, gbt_error *err);

#endif
