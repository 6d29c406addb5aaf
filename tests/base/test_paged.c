/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/test_paged.c -- arrays in files, and files written piece by piece. */
#include "base/large_file.h"
#include "base/paged.h"
#include "folder.h"

enum { NUMBERS = 16 << 20 };

static void values_stay_when_pages_go(void **state)
{
    (void)state;
    assert_ok(paged_start("/tmp", 1, NULL)); /* always over the limit */
    uint32_t *a = mem_calloc(NUMBERS, sizeof *a, "test", NULL);
    assert_non_null(a);
    for (size_t i = 0; i < NUMBERS; i += 1021)
        assert_int_equal(a[i], 0);
    for (size_t i = 0; i < NUMBERS; i++)
        a[i] = (uint32_t)(i * 2654435761u);
    const size_t before = mem_resident_bytes();
    paged_check();
    assert_true(mem_resident_bytes() + (size_t)NUMBERS * 3 < before);
    void *longer = a;
    size_t capacity = NUMBERS;
    assert_ok(mem_reserve(&longer, &capacity, NUMBERS, NUMBERS + 1, sizeof *a, "test", NULL));
    a = longer;
    assert_true(mem_resident_bytes() < before); /* neither of them is whole in memory */
    for (size_t i = 0; i < NUMBERS; i += 7)
        if (a[i] != (uint32_t)(i * 2654435761u))
            fail_msg("value %zu has changed", i);
    paged_stop();
    paged_check(); /* nothing is let go of any more */
    const size_t held = mem_resident_bytes();
    assert_true(held > (size_t)NUMBERS * 3);
    mem_free(a);
    assert_true(mem_resident_bytes() + (size_t)NUMBERS * 3 < held); /* sanitizers keep memory of their own */
}

static void small_arrays_are_memory(void **state)
{
    (void)state;
    void *out = state;
    assert_ok(paged_map(PAGED_LEAST_BYTES, "test", &out, NULL)); /* not started */
    assert_null(out);
    assert_ok(paged_start("/tmp", 1, NULL));
    assert_ok(paged_map(PAGED_LEAST_BYTES - 1, "test", &out, NULL));
    assert_null(out);
    assert_ok(paged_map(PAGED_LEAST_BYTES, "test", &out, NULL));
    assert_non_null(out);
    assert_true(paged_unmap(out));
    assert_false(paged_unmap(out));
    assert_false(paged_unmap(NULL));
    gbt_error err = {0};
    assert_null(mem_alloc((size_t)1 << 50, 1, "far too much", &err)); /* than there is on any disk */
    assert_true(err.status == GBT_ERR_NO_MEMORY && strstr(err.text, "far too much") != NULL);
    paged_stop();
}

static void folders_that_are_not_there(void **state)
{
    (void)state;
    gbt_error err = {0};
    assert_int_equal(paged_start("/nowhere/at/all", 1, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "/nowhere/at/all"));
}

static void many_arrays(void **state)
{
    (void)state;
    enum { MANY = 600 };
    static unsigned char *a[MANY];
    assert_ok(paged_start("/tmp", 1, NULL));
    for (int i = 0; i < MANY; i++) {
        a[i] = mem_alloc(PAGED_LEAST_BYTES, 1, "test", NULL);
        assert_non_null(a[i]);
        memset(a[i], i & 255, PAGED_LEAST_BYTES);
    }
    const size_t before = mem_resident_bytes();
    paged_check();
    assert_true(mem_resident_bytes() + (MANY - 40) * PAGED_LEAST_BYTES < before); /* all of them are gone */
    for (int k = 0; k < MANY; k++) {
        const int i = k * 7 % MANY; /* in no order: 7 and 600 have no common divisor */
        assert_int_equal(a[i][PAGED_LEAST_BYTES - 1], i & 255);
        mem_free(a[i]);
    }
    assert_false(paged_unmap(a[0]));
    paged_stop();
}

static void a_file_by_pieces(void **state)
{
    (void)state;
    const char *path = in_folder("a"), *temporary = in_folder(".a.tmp");
    static large_file file;
    assert_ok(large_file_create(path, &file, NULL));
    assert_ok(large_file_put(&file, "ab", 2, NULL));
    assert_true(file_exists(temporary) && !file_exists(path));
    assert_ok(large_file_close(&file, false, NULL));
    assert_true(!file_exists(temporary) && !file_exists(path)); /* given up */
    assert_ok(large_file_create(path, &file, NULL));
    assert_ok(large_file_put(&file, "ab", 2, NULL));
    assert_ok(large_file_put(&file, "cde", 3, NULL));
    assert_ok(large_file_close(&file, true, NULL));
    assert_true(!file_exists(temporary) && file_exists(path));
    char text[4] = "";
    assert_ok(large_file_open(path, &file, NULL));
    assert_int_equal(file.size, 5);
    assert_ok(large_file_read(&file, 2, text, 3, NULL));
    assert_string_equal(text, "cde");
    gbt_error err = {0};
    assert_int_equal(large_file_read(&file, 3, text, 3, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "became shorter"));
    assert_ok(large_file_close(&file, false, NULL));
    assert_true(file_exists(path));                  /* it was only read */
    assert_ok(large_file_close(&file, false, NULL)); /* closed */
    unlink(path);
    assert_int_equal(large_file_open(path, &file, NULL), GBT_ERR_IO);
    assert_int_equal(large_file_open(test_folder, &file, NULL), GBT_ERR_IO);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_stay_when_pages_go),  cmocka_unit_test(small_arrays_are_memory),
        cmocka_unit_test(folders_that_are_not_there), cmocka_unit_test(many_arrays),
        cmocka_unit_test(a_file_by_pieces),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
