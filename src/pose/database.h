/* SPDX-License-Identifier: Apache-2.0 */
/* pose/database.h -- what COLMAP's database says of photos: cameras, features, matches. */
#ifndef GBT_POSE_DATABASE_H
#define GBT_POSE_DATABASE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

typedef struct database database;

/** GBT_ERR_FORMAT for a file that is no database of COLMAP. Close with database_close() (NULL is fine). */
gbt_status database_open(const char *path, database **out, gbt_error *err);
void database_close(database *d);

typedef struct database_photo {
    uint32_t id, camera; /* COLMAP's */
    int64_t features;
} database_photo;

/** A photo that is not there has id 0, which COLMAP gives to none. */
gbt_status database_find(database *d, const char *name, database_photo *out, gbt_error *err);

/** How many photos have a position from GPS. */
gbt_status database_positions(database *d, size_t *count, gbt_error *err);

/** Pairs of photos whose matches fit one geometry: `pair` is called with both ids and their matches, >= 1. */
gbt_status database_pairs(database *d, void (*pair)(uint32_t a, uint32_t b, int64_t matches, void *context),
                          void *context, gbt_error *err);

#endif
