/* SPDX-License-Identifier: Apache-2.0 */
/* data/cameras_json.h -- cameras.json of a 3DGS result folder: pinholes to look from, without photos. */
#ifndef GBT_DATA_CAMERAS_JSON_H
#define GBT_DATA_CAMERAS_JSON_H

#include "data/scene.h"

/**
 * Read the cameras as the views of a scene without photos (`path` is NULL), all marked as held out: none of
 * them is to be trained on.
 *
 * The principal point is the middle, as the file knows no other; the origin is 0. Rotations are camera to
 * world, COLMAP's axes.
 * @param out [out] free with scene_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status cameras_json_load(const char *path, scene *out, gbt_error *err);

#endif
