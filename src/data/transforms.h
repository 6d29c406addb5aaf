/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms.h -- transforms.json (nerfstudio, instant-ngp, Blender) from bytes. */
#ifndef GBT_DATA_TRANSFORMS_H
#define GBT_DATA_TRANSFORMS_H

#include "data/bytes.h"
#include "data/raw.h"

/**
 * Read cameras and poses of a transforms.json; what is understood and what is ignored is in docs/formats.md.
 *
 * Poses in the file are camera to world with OpenGL axes (x right, y up, z back); ours are world to camera
 * with COLMAP's, so the y and z columns of the rotation are negated and the matrix is inverted. World axes
 * are not touched.
 *
 * @param folder [in]     where file_path starts; photos are looked up there, because frames without one are
 *                        left out (and counted)
 * @param may_be_empty [in] a list `frames` without entries adds nothing; else it is an error
 * @param out    [in,out] zeroed by the caller; free with raw_free(), also after a failure. Every view has a
 *                        path
 * @param points_name [out] ply_file_path, owned by the caller (mem_free()); NULL when the file names none
 * @return GBT_OK; GBT_ERR_FORMAT with the line or the frame; GBT_ERR_IO when no frame has a photo;
 *         GBT_ERR_NO_MEMORY
 */
gbt_status transforms_read(const source_file *file, const char *folder, bool may_be_empty, raw_scene *out,
                           char **points_name, gbt_error *err);

#endif
