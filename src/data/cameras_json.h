/* SPDX-License-Identifier: Apache-2.0 */
/* data/cameras_json.h -- reads the cameras.json of a 3DGS result folder: pinhole cameras without photos. */
#ifndef GBT_DATA_CAMERAS_JSON_H
#define GBT_DATA_CAMERAS_JSON_H

#include "data/scene.h"

/**
 * Read the cameras as the views of a scene without photos (`path` is NULL), all marked as held out so that
 * none is trained on.
 *
 * The file has no principal point, so the image centre is used; the origin is 0. Its rotations are camera to
 * world, with COLMAP's camera axes.
 * @param out [out] free with scene_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status cameras_json_load(const char *path, scene *out, gbt_error *err);

#endif
