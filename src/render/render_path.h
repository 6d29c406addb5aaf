/* SPDX-License-Identifier: Apache-2.0 */
/* render/render_path.h -- choose the cameras of a film: an orbit around the scene, a path through the photos'
   cameras, or a path file. */
#ifndef GBT_RENDER_RENDER_PATH_H
#define GBT_RENDER_RENDER_PATH_H

#include "gbtrace/evaluate.h"
#include "render/camera_path.h"
#include "run/loaded_run.h"

/** Whether a path needs the cameras of the data set: "orbit" and "interpolate" do, files do not. */
bool render_path_wants_views(const char *path);

/**
 * The cameras of def->path ("orbit", "interpolate", or a file), with fps set.
 *
 * @param r   [in]  with views if the path needs them; held-out views are used only if there are no others
 * @param out [out] free with camera_path_free() after success or failure
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status render_path_make(const loaded_run *r, const gbt_render_def *def, camera_path *out, gbt_error *err);

#endif
