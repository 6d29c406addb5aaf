/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms.h -- reads transforms.json (nerfstudio, instant-ngp, Blender). */
#ifndef GBT_DATA_TRANSFORMS_H
#define GBT_DATA_TRANSFORMS_H

#include "data/bytes.h"
#include "data/raw.h"

/**
 * Read cameras and poses of a transforms.json; what is understood and what is ignored is in docs/formats.md.
 *
 * Poses in the file are camera to world with OpenGL axes (x right, y up, z back); ours are world to camera
 * with COLMAP's axes (x right, y down, z forward), so the y and z columns of the rotation are negated and the
 * matrix is inverted. World axes are unchanged.
 *
 * @param folder [in]     folder that file_path is relative to; photos are looked up there, and frames without
 *                        one are left out and counted
 * @param may_be_empty [in] true: an empty list `frames` adds nothing; false: it is an error
 * @param out    [in,out] zeroed by the caller; free with raw_free(), also after a failure. Every view has a
 *                        path
 * @param points_name [out] ply_file_path, owned by the caller (mem_free()); NULL when the file names none
 * @return GBT_OK; GBT_ERR_FORMAT with the line or the frame; GBT_ERR_IO when no frame has a photo;
 *         GBT_ERR_NO_MEMORY
 */
gbt_status transforms_read(const source_file *file, const char *folder, bool may_be_empty, raw_scene *out,
                           char **points_name, gbt_error *err);

#endif
