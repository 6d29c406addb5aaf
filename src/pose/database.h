/* SPDX-License-Identifier: Apache-2.0 */
/* pose/database.h -- reads cameras, features and matches of photos from COLMAP's database. */
#ifndef GBT_POSE_DATABASE_H
#define GBT_POSE_DATABASE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

typedef struct database database;

/** GBT_ERR_FORMAT when the file is not a COLMAP database. Close with database_close() (NULL is fine). */
gbt_status database_open(const char *path, database **out, gbt_error *err);
void database_close(database *d);

typedef struct database_photo {
    uint32_t id, camera; /* as in COLMAP */
    int64_t features;
} database_photo;

/** Look up a photo by name. If there is none, the id is 0, which COLMAP never uses. */
gbt_status database_find(database *d, const char *name, database_photo *out, gbt_error *err);

/** Count the photos that have a GPS position. */
gbt_status database_positions(database *d, size_t *count, gbt_error *err);

/** Call `pair` for all pairs of photos that have matches consistent with one geometry, with both ids and the
    number of these matches, >= 1. */
gbt_status database_pairs(database *d, void (*pair)(uint32_t a, uint32_t b, int64_t matches, void *context),
                          void *context, gbt_error *err);

#endif
