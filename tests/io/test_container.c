/* SPDX-License-Identifier: Apache-2.0 */
/* tests/io/test_container.c -- the container: what goes in comes out, and nothing damaged does. */
#include <sys/mount.h>

#include "folder.h"
#include "io/container.h"

static const float floats[6] = {1.5f, -2.0f, 0.0f, 1e-30f, 3e30f, -0.0f};
static const double doubles[2] = {1e300, -1.0 / 3.0};
static const uint64_t words[3] = {0, 1, UINT64_MAX};
static const int64_t signed_words[1] = {INT64_MIN};
static const uint32_t halves[5] = {1, 2, 3, 4, UINT32_MAX};

static void fill(container_writer *w)
{
    container_add(w, "floats", CONTAINER_F32, 2, (size_t[]){2, 3}, floats);
    container_add(w, "empty", CONTAINER_F32, 3, (size_t[]){0, 10, 3}, NULL);
    container_add(w, "doubles", CONTAINER_F64, 1, (size_t[]){2}, doubles);
    container_add(w, "words", CONTAINER_U64, 4, (size_t[]){1, 1, 3, 1}, words);
    container_add_small(w, "signed", CONTAINER_I64, 1, signed_words);
    container_add_small(w, "halves", CONTAINER_U32, 5, &(const uint32_t[5]){1, 2, 3, 4, UINT32_MAX});
    container_add_text(w, "text", "key = value\n");
    container_add_text(w, "a name of exactly sixty-three bytes, which is as long as it can", "");
}

static unsigned char *encode(size_t *byte_count)
{
    container_writer w = {0};
    fill(&w);
    unsigned char *bytes;
    assert_ok(container_encode(&w, &bytes, byte_count, NULL));
    container_writer_free(&w);
    return bytes;
}

static void check_contents(const container *c)
{
    const void *data;
    assert_int_equal(c->count, 8);
    size_t dims[4] = {2, CONTAINER_ANY};
    assert_ok(container_find(c, "floats", CONTAINER_F32, 2, dims, &data, NULL));
    assert_int_equal(dims[1], 3);
    assert_memory_equal(data, floats, sizeof floats);
    assert_int_equal((uintptr_t)data % 64, 0);
    dims[0] = CONTAINER_ANY;
    dims[1] = 10;
    dims[2] = 3;
    assert_ok(container_find(c, "empty", CONTAINER_F32, 3, dims, &data, NULL));
    assert_int_equal(dims[0], 0);
    double d[2];
    assert_ok(container_get(c, "doubles", CONTAINER_F64, 2, d, NULL));
    assert_memory_equal(d, doubles, sizeof d);
    dims[0] = dims[1] = dims[3] = 1;
    dims[2] = 3;
    assert_ok(container_find(c, "words", CONTAINER_U64, 4, dims, &data, NULL));
    assert_memory_equal(data, words, sizeof words);
    int64_t s;
    assert_ok(container_get(c, "signed", CONTAINER_I64, 1, &s, NULL));
    assert_true(s == INT64_MIN);
    uint32_t h[5];
    assert_ok(container_get(c, "halves", CONTAINER_U32, 5, h, NULL));
    assert_memory_equal(h, halves, sizeof h);
    char text[13];
    assert_ok(container_get_text(c, "text", text, sizeof text, NULL));
    assert_string_equal(text, "key = value\n");
    assert_ok(container_get_text(c, "a name of exactly sixty-three bytes, which is as long as it can", text,
                                 sizeof text, NULL));
    assert_string_equal(text, "");
    assert_null(container_section_named(c, "float"));
}

static void round_trip_in_memory(void **state)
{
    (void)state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count);
    container c;
    assert_ok(container_parse(bytes, byte_count, "memory", &c, NULL));
    check_contents(&c);
    container_free(&c);
    assert_null(c.sections);
    mem_free(bytes);
}

static void round_trip_on_disk(void **state)
{
    (void)state;
    container_writer w = {0};
    fill(&w);
    assert_ok(container_save(&w, in_folder("a.gbt"), NULL));
    container c;
    assert_ok(container_load(in_folder("a.gbt"), &c, NULL));
    check_contents(&c);
    container_free(&c);
    container_writer_free(&w);
    assert_int_equal(count_files(test_folder), 1); /* no temporary file left */
}

static void no_section_at_all(void **state)
{
    (void)state;
    container_writer w = {0};
    unsigned char *bytes;
    size_t byte_count;
    assert_ok(container_encode(&w, &bytes, &byte_count, NULL));
    assert_int_equal(byte_count, 64);
    container c;
    assert_ok(container_parse(bytes, byte_count, "memory", &c, NULL));
    assert_int_equal(c.count, 0);
    container_free(&c);
    mem_free(bytes);
}

static void every_flipped_bit_is_found(void **state)
{
    (void)state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count);
    static const unsigned char masks[] = {0x01, 0x10, 0x80, 0xff};
    for (size_t i = 0; i < byte_count; i++)
        for (size_t m = 0; m < sizeof masks; m++) {
            bytes[i] ^= masks[m];
            container c;
            gbt_error err = {0};
            const gbt_status status = container_parse(bytes, byte_count, "memory", &c, &err);
            if (status != GBT_ERR_FORMAT || c.sections != NULL || strncmp(err.text, "memory", 6) != 0)
                fail_msg("byte %zu ^ %02x: status %d, \"%s\"", i, masks[m], (int)status, err.text);
            bytes[i] ^= masks[m];
        }
    mem_free(bytes);
}

static void every_other_length_is_found(void **state)
{
    (void)state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count);
    for (size_t length = 0; length <= byte_count + 65; length++) {
        if (length == byte_count)
            continue;
        unsigned char *copy =
            mem_calloc(length, 1, "copy", NULL); /* exact size: a sanitizer sees every byte read too far */
        assert_non_null(copy);
        memcpy(copy, bytes, length < byte_count ? length : byte_count);
        container c;
        gbt_error err = {0};
        if (container_parse(copy, length, "memory", &c, &err) != GBT_ERR_FORMAT || err.text[0] == '\0')
            fail_msg("length %zu was accepted", length);
        mem_free(copy);
    }
    mem_free(bytes);
}

/* ---- files with good checksums and bad contents ---- */

static uint32_t crc_by_bits(const unsigned char *bytes, size_t count)
{
    uint32_t crc = ~0u;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1)));
    }
    return ~crc;
}

static void repair_checksums(unsigned char *bytes, size_t table_bytes)
{
    uint32_t crc = crc_by_bits(bytes + 64, table_bytes);
    memcpy(bytes + 24, &crc, 4);
    crc = crc_by_bits(bytes, 60);
    memcpy(bytes + 60, &crc, 4);
}

typedef struct forged_case {
    const char *name;
    size_t place; /* of the field in the file */
    int size;
    uint64_t value;
    const char *message;
} forged_case;

/* Row 0 is "floats", f32[2][3], at 64; row 1 "empty" at 192. Inside a row: name 0, type 64, dimensions 68,
   sizes 72, offset 104, bytes 112, crc 120. */
static forged_case forged_cases[] = {
    {"newer version", 8, 4, 2, "memory@8: written by another version of gbtrace (wanted format 1, got 2)"},
    {"version 0", 8, 4, 0, "wanted format 1, got 0"},
    {"more sections than bytes", 12, 4, 1000, "memory@12: 1000 sections cannot be in"},
    {"2^32 - 1 sections", 12, 4, UINT32_MAX, "memory@12: 4294967295 sections cannot be in"},
    {"file length one more", 16, 8, 0, "the file is too long (wanted 0 bytes, got"},
    {"file length huge", 16, 8, UINT64_MAX, "the file is cut short (wanted 18446744073709551615 bytes, got"},
    {"empty name", 64, 1, 0, "memory@64: section 0: its name is empty or too long"},
    {"name without end", 64 + 63, 1, 'x', "memory@64: section 0: its name is empty or too long"},
    {"type 0", 64 + 64, 4, 0, "section floats: unknown type 0"},
    {"type 7", 64 + 64, 4, 7, "section floats: unknown type 7"},
    {"type 2^32 - 1", 64 + 64, 4, UINT32_MAX, "section floats: unknown type 4294967295"},
    {"another type of the same size", 64 + 64, 4, CONTAINER_U32, NULL},
    {"no dimension", 64 + 68, 4, 0, "bad number of dimensions (wanted 1 to 4, got 0)"},
    {"5 dimensions", 64 + 68, 4, 5, "bad number of dimensions (wanted 1 to 4, got 5)"},
    {"shape larger than the bytes", 64 + 72, 8, 3, "section floats: its shape and its 24 bytes do not agree"},
    {"shape that overflows", 64 + 72, 8, UINT64_MAX / 2,
     "section floats: its shape and its 24 bytes do not agree"},
    {"product that wraps to the right number", 64 + 72, 8, (UINT64_C(1) << 62) + 2,
     "section floats: its shape and its 24 bytes do not agree"},
    {"offset one alignment on", 64 + 104, 8, 64 + 8 * 128 + 64,
     "section floats: 24 bytes at 1152 are not where they should be"},
    {"offset 0", 64 + 104, 8, 0, "section floats: 24 bytes at 0 are not where they should be"},
    {"offset 2^64 - 1", 64 + 104, 8, UINT64_MAX,
     "section floats: 24 bytes at 18446744073709551615 are not where they should be"},
    {"byte count 2^63", 64 + 112, 8, UINT64_C(1) << 63, "do not agree"},
    {"empty section with bytes", 192 + 112, 8, 4, "section empty: its shape and its 4 bytes do not agree"},
    {"empty section of 2^63 x 0", 192 + 80, 8, UINT64_C(1) << 63,
     "section empty: its shape and its 0 bytes do not agree"},
    {"section checksum", 64 + 120, 4, 1, "memory@1088: section floats is damaged (checksum)"},
};

static void forged(void **state)
{
    const forged_case *row = *state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count);
    memcpy(bytes + row->place, &row->value, (size_t)row->size);
    repair_checksums(bytes, 8 * 128);
    container c;
    gbt_error err = {0};
    const gbt_status status = container_parse(bytes, byte_count, "memory", &c, &err);
    if (row->message == NULL) {
        assert_int_equal(status, GBT_OK); /* the repaired checksums are right: so the others fail for their
                                             own reason */
        container_free(&c);
    } else {
        assert_int_equal(status, GBT_ERR_FORMAT);
        if (strstr(err.text, row->message) == NULL)
            fail_msg("\"%s\" is not \"%s\"", err.text, row->message);
    }
    mem_free(bytes);
}

/* One section that says to be longer than the file, then one that begins behind its end. */
static void sections_beyond_the_end(void **state)
{
    (void)state;
    for (int second = 0; second < 2; second++) {
        container_writer w = {0};
        container c;
        size_t byte_count;
        unsigned char *bytes;
        gbt_error err = {0};
        container_add(&w, "numbers", CONTAINER_F32, 1, (size_t[]){3}, floats);
        if (second)
            container_add(&w, "empty", CONTAINER_F32, 1, (size_t[]){0}, NULL);
        assert_ok(container_encode(&w, &bytes, &byte_count, NULL));
        container_writer_free(&w);
        if (second) { /* cut where the first ends: the second would begin at the next multiple of 64 */
            byte_count = 64 + 2 * 128 + 12;
            memcpy(bytes + 16, &(uint64_t){byte_count}, 8);
        } else {
            memcpy(bytes + 64 + 72, &(uint64_t){1000}, 8);
            memcpy(bytes + 64 + 112, &(uint64_t){4000}, 8);
        }
        repair_checksums(bytes, second ? 2 * 128 : 128);
        unsigned char *exact = mem_alloc(byte_count, 1, "test", NULL); /* so that a sanitizer sees its end */
        memcpy(exact, bytes, byte_count);
        assert_int_equal(container_parse(exact, byte_count, "memory", &c, &err), GBT_ERR_FORMAT);
        assert_non_null(
            strstr(err.text, second ? "section empty: 0 bytes at 384 are not where they should be"
                                    : "section numbers: 4000 bytes at 192 are not where they should be"));
        mem_free(exact);
        mem_free(bytes);
    }
}

static void two_sections_of_one_name(void **state)
{
    (void)state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count);
    memset(bytes + 192, 0, 64);
    memcpy(bytes + 192, "floats", 6);
    repair_checksums(bytes, 8 * 128);
    container c;
    gbt_error err = {0};
    assert_int_equal(container_parse(bytes, byte_count, "memory", &c, &err), GBT_ERR_FORMAT);
    assert_string_equal(err.text, "memory: section floats occurs twice");
    mem_free(bytes);
}

static void unaligned_bytes_are_refused(void **state)
{
    (void)state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count), *moved = mem_alloc(byte_count + 1, 1, "copy", NULL);
    assert_non_null(moved);
    memcpy(moved + 1, bytes, byte_count);
    container c;
    assert_int_equal(container_parse(moved + 1, byte_count, "memory", &c, NULL), GBT_ERR_ARGUMENT);
    mem_free(moved);
    mem_free(bytes);
}

/* ---- asking for what is not there ---- */

static void wrong_questions(void **state)
{
    (void)state;
    size_t byte_count;
    unsigned char *bytes = encode(&byte_count);
    container c;
    assert_ok(container_parse(bytes, byte_count, "f.gbt", &c, NULL));
    const struct {
        const char *name;
        container_dtype dtype;
        int dim_count;
        size_t dims[4];
        const char *message;
    } rows[] = {
        {"nothing",
         CONTAINER_F32,
         2,
         {CONTAINER_ANY, 3},
         "f.gbt: section nothing is missing (wanted f32[*][3])"},
        {"floats",
         CONTAINER_F64,
         2,
         {2, 3},
         "f.gbt: section floats has another shape (wanted f64[2][3], got f32[2][3])"},
        {"floats",
         CONTAINER_F32,
         1,
         {6},
         "f.gbt: section floats has another shape (wanted f32[6], got f32[2][3])"},
        {"floats",
         CONTAINER_F32,
         2,
         {2, 4},
         "f.gbt: section floats has another shape (wanted f32[2][4], got f32[2][3])"},
        {"floats",
         CONTAINER_F32,
         2,
         {3, CONTAINER_ANY},
         "f.gbt: section floats has another shape (wanted f32[3][*], got f32[2][3])"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        size_t dims[4];
        memcpy(dims, rows[i].dims, sizeof dims);
        const void *data = &c;
        gbt_error err = {0};
        assert_int_equal(
            container_find(&c, rows[i].name, rows[i].dtype, rows[i].dim_count, dims, &data, &err),
            GBT_ERR_FORMAT);
        assert_string_equal(err.text, rows[i].message);
        assert_null(data);
    }
    char text[12];
    gbt_error err = {0};
    assert_int_equal(container_get_text(&c, "text", text, sizeof text, &err), GBT_ERR_FORMAT);
    assert_string_equal(err.text,
                        "f.gbt: section text: the text is too long (wanted at most 11 bytes, got 12)");
    container_free(&c);
    mem_free(bytes);
}

static void zero_byte_in_a_text(void **state)
{
    (void)state;
    container_writer w = {0};
    container_add_small(&w, "text", CONTAINER_U8, 3, "a\0b");
    unsigned char *bytes;
    size_t byte_count;
    assert_ok(container_encode(&w, &bytes, &byte_count, NULL));
    container c;
    assert_ok(container_parse(bytes, byte_count, "f.gbt", &c, NULL));
    char text[8];
    gbt_error err = {0};
    assert_int_equal(container_get_text(&c, "text", text, sizeof text, &err), GBT_ERR_FORMAT);
    assert_string_equal(err.text, "f.gbt: section text: a zero byte in a text");
    container_free(&c);
    mem_free(bytes);
    container_writer_free(&w);
}

/* ---- misuse of the writer ---- */

static void add_no_name(container_writer *w)
{
    container_add(w, "", CONTAINER_F32, 1, (size_t[]){1}, floats);
}
static void add_long_name(container_writer *w)
{
    container_add(w, "a name of exactly sixty-four bytes, which is one more than fits.", CONTAINER_F32, 1,
                  (size_t[]){1}, floats);
}
static void add_no_dims(container_writer *w)
{
    container_add(w, "x", CONTAINER_F32, 0, (size_t[]){1}, floats);
}
static void add_five_dims(container_writer *w)
{
    container_add(w, "x", CONTAINER_F32, 5, (size_t[]){1, 1, 1, 1, 1}, floats);
}
static void add_bad_type(container_writer *w)
{
    container_add(w, "x", (container_dtype)9, 1, (size_t[]){1}, floats);
}
static void add_overflow(container_writer *w)
{
    container_add(w, "x", CONTAINER_F32, 2, (size_t[]){SIZE_MAX / 2, 2}, floats);
}
static void add_nothing(container_writer *w) { container_add(w, "x", CONTAINER_F32, 1, (size_t[]){1}, NULL); }
static void add_large_small(container_writer *w)
{
    container_add_small(w, "x", CONTAINER_U8, 65,
                        "0123456789012345678901234567890123456789012345678901234567890123456789");
}

static void add_twice(container_writer *w)
{
    container_add_text(w, "x", "1");
    container_add_text(w, "x", "2");
    container_add_text(w, "y", "3"); /* ignored: the first failure stays */
}

typedef struct misuse_case {
    const char *name;
    void (*add)(container_writer *w);
    const char *message;
} misuse_case;

static misuse_case misuse_cases[] = {
    {"no name", add_no_name, "section name \"\": wanted 1 to 63 bytes"},
    {"name too long", add_long_name, "wanted 1 to 63 bytes"},
    {"no dimension", add_no_dims, "section x: type 1 with 0 dimensions cannot be saved"},
    {"five dimensions", add_five_dims, "section x: type 1 with 5 dimensions cannot be saved"},
    {"unknown type", add_bad_type, "section x: type 9 with 1 dimensions cannot be saved"},
    {"overflow", add_overflow, "section x: its size overflows"},
    {"no data", add_nothing, "section x: no data"},
    {"65 small bytes", add_large_small, "section x: 65 bytes are not small (at most 64)"},
    {"same name twice", add_twice, "section x: added twice"},
};

static void misuse(void **state)
{
    const misuse_case *row = *state;
    container_writer w = {0};
    row->add(&w);
    gbt_error err = {0};
    assert_int_equal(container_save(&w, in_folder("misuse.gbt"), &err), GBT_ERR_ARGUMENT);
    if (strstr(err.text, row->message) == NULL)
        fail_msg("\"%s\" is not \"%s\"", err.text, row->message);
    assert_false(file_exists(in_folder("misuse.gbt")));
    container_writer_free(&w);
}

/* ---- when memory, disk or rights run out ---- */

static void no_memory(void **state)
{
    (void)state;
    bool worked = false;
    for (long n = 0; n < 64 && !worked; n++) {
        container_writer w = {0};
        container c = {0};
        gbt_error err = {0};
        mem_fail_after(n);
        fill(&w);
        gbt_status status = container_save(&w, in_folder("memory.gbt"), &err);
        if (status == GBT_OK)
            status = container_load(in_folder("memory.gbt"), &c, &err);
        mem_fail_after(-1);
        worked = status == GBT_OK;
        if (!worked) {
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_int_not_equal(err.text[0], '\0');
            assert_null(c.sections);
        } else
            assert_true(n >= 4); /* at least: sections, image, file, sections */
        container_free(&c);
        container_writer_free(&w);
    }
    assert_true(worked);
}

static void unwritable_places(void **state)
{
    (void)state;
    container_writer w = {0};
    fill(&w);
    const struct {
        const char *path;
        gbt_status status;
    } rows[] = {
        {"/proc/nothing/a.gbt", GBT_ERR_IO},
        {"/nonexistent folder/a.gbt", GBT_ERR_IO},
        {"/dev/null/a.gbt", GBT_ERR_IO},
        {"", GBT_ERR_IO},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        gbt_error err = {0};
        assert_int_equal(container_save(&w, rows[i].path, &err), rows[i].status);
        assert_int_not_equal(err.text[0], '\0');
    }
    container_writer_free(&w);
}

static void unreadable_files(void **state)
{
    (void)state;
    const char *fifo = in_folder("fifo");
    assert_int_equal(mkfifo(fifo, 0600), 0);
    const char *paths[] = {"/nonexistent", test_folder, fifo, "/dev/zero"};
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        container c;
        gbt_error err = {0};
        assert_int_equal(container_load(paths[i], &c, &err), GBT_ERR_IO);
        assert_non_null(strstr(err.text, paths[i]));
    }
}

static void full_disk_keeps_the_old_file(void **state)
{
    (void)state;
    char mount_point[512], path[600];
    snprintf(mount_point, sizeof mount_point, "%s_full", test_folder);
    assert_int_equal(mkdir(mount_point, 0700), 0);
    if (mount("tmpfs", mount_point, "tmpfs", 0, "size=64k") != 0) {
        rmdir(mount_point);
        print_message("skipped: no right to mount a small disk\n");
        skip();
    }
    snprintf(path, sizeof path, "%s/a.gbt", mount_point);
    container_writer w = {0};
    fill(&w);
    gbt_status first = container_save(&w, path, NULL);
    float *large = mem_calloc(64 * 1024, sizeof *large, "large", NULL);
    container_add(&w, "large", CONTAINER_F32, 1, (size_t[]){64 * 1024}, large);
    gbt_error err = {0};
    const gbt_status second = container_save(&w, path, &err);
    container c = {0};
    const gbt_status third = container_load(path, &c, NULL);
    const size_t count = c.count;
    const int files = count_files(mount_point);
    container_free(&c);
    container_writer_free(&w);
    mem_free(large);
    umount(mount_point);
    rmdir(mount_point);
    assert_int_equal(first, GBT_OK);
    assert_int_equal(second, GBT_ERR_IO);
    assert_non_null(strstr(err.text, "No space left"));
    assert_int_equal(third, GBT_OK);
    assert_int_equal(count, 8);
    assert_int_equal(files, 1);
}

int main(void)
{
    enum {
        FORGED = sizeof forged_cases / sizeof *forged_cases,
        MISUSE = sizeof misuse_cases / sizeof *misuse_cases
    };
    static char names[FORGED + MISUSE][80];
    struct CMUnitTest tests[13 + FORGED + MISUSE] = {
        cmocka_unit_test(round_trip_in_memory),
        cmocka_unit_test(round_trip_on_disk),
        cmocka_unit_test(no_section_at_all),
        cmocka_unit_test(every_flipped_bit_is_found),
        cmocka_unit_test(every_other_length_is_found),
        cmocka_unit_test(sections_beyond_the_end),
        cmocka_unit_test(two_sections_of_one_name),
        cmocka_unit_test(unaligned_bytes_are_refused),
        cmocka_unit_test(wrong_questions),
        cmocka_unit_test(zero_byte_in_a_text),
        cmocka_unit_test(no_memory),
        cmocka_unit_test(unwritable_places),
        cmocka_unit_test(unreadable_files),
        cmocka_unit_test(full_disk_keeps_the_old_file),
    };
    size_t count = 13;
    for (size_t i = 0; i < FORGED; i++, count++) {
        snprintf(names[i], sizeof names[i], "forged: %s", forged_cases[i].name);
        tests[count] =
            (struct CMUnitTest){.name = names[i], .test_func = forged, .initial_state = &forged_cases[i]};
    }
    for (size_t i = 0; i < MISUSE; i++, count++) {
        snprintf(names[FORGED + i], sizeof names[0], "misuse: %s", misuse_cases[i].name);
        tests[count] = (struct CMUnitTest){
            .name = names[FORGED + i], .test_func = misuse, .initial_state = &misuse_cases[i]};
    }
    return _cmocka_run_group_tests("container", tests, count, folder_make, folder_remove);
}
