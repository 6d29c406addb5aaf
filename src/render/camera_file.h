/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_file.h -- read a camera file: JSON that describes one camera to render from. */
#ifndef GBT_RENDER_CAMERA_FILE_H
#define GBT_RENDER_CAMERA_FILE_H

#include "data/json_fields.h"
#include "trace/rays.h"

typedef struct camera_file {
    ray_shot shot;  /* scene-local; shot.given points to `rays`, so do not copy this struct */
    ray_image rays; /* owned; empty unless the file names rays */
} camera_file;

/**
 * Read a camera file. Fields, units and defaults: docs/cameras.md. Every field is checked, and an unknown
 * field is an error.
 *
 * @param origin [in]  the scene's local origin; subtracted, in double, from the file's world coordinates
 * @param out    [out] free with camera_file_free() after success or failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT ("FILE: field: what was wrong"), GBT_ERR_NO_MEMORY
 */
gbt_status camera_file_read(const char *path, const double origin[3], camera_file *out, gbt_error *err);

/** The same from a string. It may not name an image of rays, so a ray_shot is all the output. `name` stands
    for the file in error messages. */
gbt_status camera_text_read(const char *text, const char *name, const double origin[3], ray_shot *out,
                            gbt_error *err);

void camera_file_free(camera_file *file); /* zeroes the struct */

/** The same for a JSON object inside a larger file. `out` must be zeroed; otherwise as camera_file_read(). */
gbt_status camera_file_take(const json_fields *fields, const double origin[3], camera_file *out);

enum { CAMERA_FILE_SIZE_MAX = 65500 }; /* pixels, width or height */

#endif
