/* SPDX-License-Identifier: Apache-2.0 */
/* pose/database.c -- queries COLMAP's database with SQLite. */
#include "pose/database.h"

#include <sqlite3.h>
#include <stdbool.h>

#include "base/fail.h"
#include "base/memory.h"

/* COLMAP's pair_id is the smaller image id times this plus the larger one. */
enum { PAIR_IDS = 2147483647 };

struct database {
    const char *path;
    sqlite3 *file;
    sqlite3_stmt *find;
};

static gbt_status failed(const database *d, gbt_error *err)
{
    const int code = sqlite3_errcode(d->file) & 0xff;  /* SQLITE_NOMEM if there is no `file` */
    if (code == SQLITE_ERROR || code == SQLITE_NOTADB) /* a failed read may also be SQLITE_CORRUPT */
        return base_fail(err, GBT_ERR_FORMAT, "%s: not a database of COLMAP: %s", d->path,
                         sqlite3_errmsg(d->file));
    return base_fail(err, code == SQLITE_NOMEM ? GBT_ERR_NO_MEMORY : GBT_ERR_IO, "%s: %s", d->path,
                     sqlite3_errmsg(d->file));
}

gbt_status database_open(const char *path, database **out, gbt_error *err)
{
    *out = NULL;
    database *d = mem_calloc(1, sizeof *d, "database", err);
    if (d == NULL)
        return GBT_ERR_NO_MEMORY;
    d->path = path;
    if (sqlite3_open_v2(path, &d->file, SQLITE_OPEN_READWRITE, NULL) != SQLITE_OK ||
        sqlite3_prepare_v2(d->file,
                           "SELECT images.image_id, images.camera_id, keypoints.rows FROM images LEFT JOIN "
                           "keypoints ON keypoints.image_id = images.image_id WHERE images.name = ?1",
                           -1, &d->find, NULL) != SQLITE_OK) {
        const gbt_status status = failed(d, err);
        database_close(d);
        return status;
    }
    *out = d;
    return GBT_OK;
}

void database_close(database *d)
{
    if (d == NULL)
        return;
    sqlite3_finalize(d->find);
    sqlite3_close(d->file);
    mem_free(d);
}

gbt_status database_find(database *d, const char *name, database_photo *out, gbt_error *err)
{
    *out = (database_photo){0};
    sqlite3_reset(d->find);
    if (sqlite3_bind_text(d->find, 1, name, -1, SQLITE_STATIC) != SQLITE_OK)
        return failed(d, err);
    const int code = sqlite3_step(d->find);
    if (code == SQLITE_ROW)
        *out = (database_photo){.id = (uint32_t)sqlite3_column_int64(d->find, 0),
                                .camera = (uint32_t)sqlite3_column_int64(d->find, 1),
                                .features = sqlite3_column_int64(d->find, 2)};
    return code == SQLITE_ROW || code == SQLITE_DONE ? GBT_OK : failed(d, err);
}

/* Add the result of a count. A missing table or column (it depends on COLMAP's version) counts as 0. */
static gbt_status add_count(database *d, const char *query, size_t *count, gbt_error *err)
{
    sqlite3_stmt *statement;
    const int prepared = sqlite3_prepare_v2(d->file, query, -1, &statement, NULL);
    if (prepared != SQLITE_OK)
        return prepared == SQLITE_ERROR ? GBT_OK : failed(d, err);
    const bool found = sqlite3_step(statement) == SQLITE_ROW;
    if (found)
        *count += (size_t)sqlite3_column_int64(statement, 0);
    const gbt_status status = found ? GBT_OK : failed(d, err);
    sqlite3_finalize(statement);
    return status;
}

/* COLMAP 3.12 moved the positions to a table of their own. A photo for which only the gravity direction is
   known also has a row, with three NaN; it is recognised by the sign and exponent of the first double. */
gbt_status database_positions(database *d, size_t *count, gbt_error *err)
{
    *count = 0;
    GBT_TRY(add_count(d, "SELECT count(*) FROM images WHERE prior_tx IS NOT NULL", count, err));
    return add_count(d,
                     "SELECT count(*) FROM pose_priors WHERE position IS NOT NULL AND NOT "
                     "(substr(hex(position), 15, 2) IN ('7F', 'FF') AND substr(hex(position), 13, 1) = 'F')",
                     count, err);
}

gbt_status database_pairs(database *d, void (*pair)(uint32_t a, uint32_t b, int64_t matches, void *context),
                          void *context, gbt_error *err)
{
    sqlite3_stmt *statement;
    if (sqlite3_prepare_v2(d->file, "SELECT pair_id, rows FROM two_view_geometries WHERE rows > 0", -1,
                           &statement, NULL) != SQLITE_OK)
        return failed(d, err);
    int code;
    while ((code = sqlite3_step(statement)) == SQLITE_ROW) {
        const int64_t id = sqlite3_column_int64(statement, 0);
        pair((uint32_t)(id / PAIR_IDS), (uint32_t)(id % PAIR_IDS), sqlite3_column_int64(statement, 1),
             context);
    }
    const gbt_status status = code == SQLITE_DONE ? GBT_OK : failed(d, err);
    sqlite3_finalize(statement);
    return status;
}
