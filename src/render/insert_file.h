/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert_file.h -- read an insert file: JSON that names meshes to put into a scene, and a lamp. */
#ifndef GBT_RENDER_INSERT_FILE_H
#define GBT_RENDER_INSERT_FILE_H

#include "render/insert.h"

/**
 * Read an insert file and the meshes that it names. Fields, units and defaults: docs/inserting.md. Every
 * field is checked, and an unknown field is an error.
 *
 * @param origin [in]  the scene's local origin; subtracted, in double, from the file's world coordinates
 * @param out    [out] finished; free with insert_scene_free() after success or failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT ("FILE: field: what was wrong"), GBT_ERR_NO_MEMORY,
 *         GBT_ERR_INTERNAL
 */
gbt_status insert_file_read(const char *path, const double origin[3], insert_scene *out, gbt_error *err);

#endif
