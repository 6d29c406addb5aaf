/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_path_file.h -- a camera path from a file: ours, or the one that nerfstudio's viewer saves. */
#ifndef GBT_RENDER_CAMERA_PATH_FILE_H
#define GBT_RENDER_CAMERA_PATH_FILE_H

#include "render/camera_path.h"

/**
 * Read a camera path. Both formats, field by field: docs/formats.md.
 *
 * @param origin [in]  the scene's local origin: subtracted, in double, from what the file says in the data
 *                     set's own coordinates
 * @param frames [in]  0: one frame per camera of the file, or what the file says in "frames"; else so many,
 *                     smoothly through its cameras
 * @param out    [out] free with camera_path_free() after success or failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT ("FILE: cameras[3].up: what was wrong"), GBT_ERR_NO_MEMORY
 */
gbt_status camera_path_file_read(const char *path, const double origin[3], size_t frames, camera_path *out,
                                 gbt_error *err);

#endif
