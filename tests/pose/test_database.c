/* SPDX-License-Identifier: Apache-2.0 */
/* tests/pose/test_database.c -- COLMAP's database, as SQLite makes it, whole and damaged. */
#include "pose/database.h"

#include <sqlite3.h>

#include "folder.h"

enum { PHOTOS = 2000, PAGE = 4096 };

static const char *path;

/* 2,000 photos, in many pages; the third and the fourth have a position. */
static int make_database(void **state)
{
    static const char *const tables =
        "CREATE TABLE images(image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER, prior_tx "
        "REAL);"
        "CREATE TABLE keypoints(image_id INTEGER PRIMARY KEY, rows INTEGER);"
        "CREATE TABLE two_view_geometries(pair_id INTEGER PRIMARY KEY, rows INTEGER);"
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 2000)"
        "INSERT INTO images SELECT i, 'photo' || i || '.png', i % 2 + 1, iif(i IN (3, 4), 1.5, NULL) FROM n;"
        "INSERT INTO keypoints SELECT image_id, image_id + 99 FROM images;"
        "INSERT INTO two_view_geometries SELECT image_id * 2147483647 + image_id + 1, 77 FROM images;";
    sqlite3 *file;
    if (folder_make(state) != 0)
        return -1;
    path = in_folder("database.db");
    if (sqlite3_open(path, &file) != SQLITE_OK)
        return -1;
    const int code = sqlite3_exec(file, tables, NULL, NULL, NULL);
    return sqlite3_close(file) == SQLITE_OK && code == SQLITE_OK ? 0 : -1;
}

static void add_pair(uint32_t a, uint32_t b, int64_t matches, void *context)
{
    assert_true(b == a + 1 && matches == 77);
    *(size_t *)context += 1;
}

static void photos_are_found(void **state)
{
    (void)state;
    database *d;
    database_photo found;
    size_t count = 0;
    gbt_error err = {0};
    assert_ok(database_open(path, &d, &err));
    assert_ok(database_find(d, "photo1500.png", &found, &err));
    assert_true(found.id == 1500 && found.camera == 1 && found.features == 1599);
    assert_ok(database_find(d, "another.png", &found, &err));
    assert_true(found.id == 0 && found.camera == 0 && found.features == 0);
    assert_ok(database_positions(d, &count, &err)); /* without a table pose_priors */
    assert_int_equal(count, 2);
    count = 0;
    assert_ok(database_pairs(d, add_pair, &count, &err));
    assert_int_equal(count, PHOTOS);
    database_close(d);
}

/* 1, NaN, -NaN, nothing. */
static void positions_are_numbers(void **state)
{
    (void)state;
    static const char *const priors =
        "CREATE TABLE pose_priors(pose_prior_id INTEGER PRIMARY KEY, position BLOB, gravity BLOB);"
        "INSERT INTO pose_priors(position) VALUES"
        "(X'000000000000F03F000000000000F03F000000000000F03F'),"
        "(X'000000000000F87F000000000000F87F000000000000F87F'),"
        "(X'000000000000F8FF000000000000F8FF000000000000F8FF'), (NULL);";
    sqlite3 *file;
    database *d;
    size_t count;
    assert_int_equal(sqlite3_open(path, &file), SQLITE_OK);
    assert_int_equal(sqlite3_exec(file, priors, NULL, NULL, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_close(file), SQLITE_OK);
    assert_ok(database_open(path, &d, NULL));
    assert_ok(database_positions(d, &count, NULL));
    assert_int_equal(count, 2 + 1); /* with those of `images` */
    database_close(d);
}

static void check_refused(gbt_status status, const gbt_error *err)
{
    assert_int_equal(status, GBT_ERR_IO);
    assert_ptr_equal(strstr(err->text, path), err->text);
    assert_non_null(strstr(err->text, ": database disk image is malformed"));
}

/* All pages but the first, which has the tables' names: what is asked for cannot be read, which is not the
   same as not being there. */
static void damage_is_no_absence(void **state)
{
    (void)state;
    unsigned char *bytes;
    size_t size, count;
    database *d;
    database_photo found;
    assert_ok(file_read(path, &bytes, &size, NULL));
    assert_true(size > 10 * PAGE);
    memset(bytes + PAGE, 0xff, size - PAGE);
    assert_ok(file_write_atomic(path, bytes, size, NULL));
    mem_free(bytes);
    gbt_error errors[3] = {0};
    assert_ok(database_open(path, &d, NULL));
    check_refused(database_find(d, "photo1500.png", &found, &errors[0]), &errors[0]);
    check_refused(database_positions(d, &count, &errors[1]), &errors[1]);
    check_refused(database_pairs(d, add_pair, &count, &errors[2]), &errors[2]);
    database_close(d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(photos_are_found), cmocka_unit_test(positions_are_numbers),
        cmocka_unit_test(damage_is_no_absence), /* spoils the file: the last */
    };
    return cmocka_run_group_tests(tests, make_database, folder_remove);
}
