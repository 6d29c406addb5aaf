/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_path_file.h -- read a camera path file: our own format, or the one that nerfstudio's viewer
   saves. */
#ifndef GBT_RENDER_CAMERA_PATH_FILE_H
#define GBT_RENDER_CAMERA_PATH_FILE_H

#include "render/camera_path.h"

/**
 * Read a camera path. Both formats, field by field: docs/formats.md.
 *
 * @param origin [in]  the scene's local origin; subtracted, in double, from the file's world coordinates
 * @param frames [in]  number of frames on a smooth path through the file's cameras. 0: the number in the
 *                     file's field "frames", or without it the cameras themselves, one per frame
 * @param out    [out] free with camera_path_free() after success or failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT ("FILE: cameras[3].up: what was wrong"), GBT_ERR_NO_MEMORY
 */
gbt_status camera_path_file_read(const char *path, const double origin[3], size_t frames, camera_path *out,
                                 gbt_error *err);

#endif
