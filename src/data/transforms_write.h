/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_write.h -- writes a transforms.json, which unlike a COLMAP model can describe a rolling
   shutter. */
#ifndef GBT_DATA_TRANSFORMS_WRITE_H
#define GBT_DATA_TRANSFORMS_WRITE_H

#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/**
 * Write cameras with poses in world coordinates (docs/formats.md).
 *
 * @param names   [count] of the photos, which are in the folder images/ beside the file
 * @param cameras [count] all PINHOLE, with the same size, lens and shutter
 * @param points  name of a .ply of sparse points, relative to the file's folder
 * @return GBT_OK; GBT_ERR_ARGUMENT for other cameras; GBT_ERR_NO_MEMORY; as file_write_atomic()
 */
gbt_status transforms_write(const char *path, const char *const *names, const gbt_camera *cameras,
                            size_t count, const char *points, gbt_error *err);

#endif
