/* SPDX-License-Identifier: Apache-2.0 */
/* trace/ray_file.h -- rays that the user computed: an EXR with six channels. */
#ifndef GBT_TRACE_RAY_FILE_H
#define GBT_TRACE_RAY_FILE_H

#include "trace/rays.h"

/**
 * Read an image of rays: 32-bit float EXR, one pixel a ray.
 *
 * The six channels are found by their names when those begin with o (origin) or d (direction) and end in x, y
 * or z, in any case: ox, origin.x, D.Z. Otherwise there must be just six, none of them with such a name:
 * origin x, y, z, direction x, y, z in order. Directions are normalised in double; a zero direction is no
 * ray. Origins get `origin` subtracted in double: world to scene-local.
 *
 * @param out [in,out] start from {0}; empty on failure
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT (also for a value that is not finite, or an origin beyond 1e17),
 *         GBT_ERR_NO_MEMORY
 * Threads: any, with distinct `out`.
 */
gbt_status ray_image_read(const char *path, const double origin[3], ray_image *out, gbt_error *err);

#endif
