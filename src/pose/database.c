/* SPDX-License-Identifier: Apache-2.0 */
/* pose/database.c -- queries, by SQLite. */
#include "pose/database.h"

#include <sqlite3.h>

#include "base/fail.h"
#include "base/memory.h"

/* COLMAP's number of a pair: the smaller id times this, and the larger one. */
enum { PAIR_IDS = 2147483647 };

struct database {
    const char *path;
    sqlite3 *file;
    sqlite3_stmt *find;
};

static gbt_status failed(const database *d, gbt_error *err)
{
    const int code = sqlite3_errcode(d->file) & 0xff; /* SQLITE_NOMEM when there is not even a `file` */
    if (code == SQLITE_NOMEM || code == SQLITE_IOERR)
        return base_fail(err, code == SQLITE_NOMEM ? GBT_ERR_NO_MEMORY : GBT_ERR_IO, "%s: %s", d->path,
                         sqlite3_errmsg(d->file));
    return base_fail(err, GBT_ERR_FORMAT, "%s: not a database of COLMAP: %s", d->path,
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

bool database_find(database *d, const char *name, database_photo *out)
{
    sqlite3_reset(d->find);
    sqlite3_bind_text(d->find, 1, name, -1, SQLITE_STATIC);
    if (sqlite3_step(d->find) != SQLITE_ROW)
        return false;
    *out = (database_photo){.id = (uint32_t)sqlite3_column_int64(d->find, 0),
                            .camera = (uint32_t)sqlite3_column_int64(d->find, 1),
                            .features = sqlite3_column_int64(d->find, 2)};
    return true;
}

static size_t count_of(database *d, const char *query)
{
    sqlite3_stmt *statement;
    size_t count = 0;
    if (sqlite3_prepare_v2(d->file, query, -1, &statement, NULL) == SQLITE_OK &&
        sqlite3_step(statement) == SQLITE_ROW)
        count = (size_t)sqlite3_column_int64(statement, 0);
    sqlite3_finalize(statement);
    return count;
}

/* COLMAP 3.12 moved positions to a table of their own; a query of what is not there counts nothing. */
size_t database_positions(database *d)
{
    return count_of(d, "SELECT count(*) FROM images WHERE prior_tx IS NOT NULL") +
           count_of(d, "SELECT count(*) FROM pose_priors");
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
