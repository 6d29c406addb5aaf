/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms_write.h -- a transforms.json of cameras, with what a COLMAP model cannot say: that they
   move while they are read out. */
#ifndef GBT_DATA_TRANSFORMS_WRITE_H
#define GBT_DATA_TRANSFORMS_WRITE_H

#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/**
 * Write cameras, poses in world coordinates, as `docs/formats.md` says.
 *
 * @param names   [count] of the photos, in the folder images/ beside the file
 * @param cameras [count] of one model, PINHOLE, and one size and lens; all with the same shutter
 * @param points  name of a .ply of sparse points, below the file's folder
 * @return GBT_OK; GBT_ERR_ARGUMENT for other cameras; GBT_ERR_NO_MEMORY; as file_write_atomic()
 */
gbt_status transforms_write(const char *path, const char *const *names, const gbt_camera *cameras,
                            size_t count, const char *points, gbt_error *err);

#endif
