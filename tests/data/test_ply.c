/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_ply.c -- PLY: headers, every format and type, malformed cases, and what ply_write()
   writes. */
#include "data_support.h"

#include "data/ply.h"

typedef struct ply_case {
    const char *name, *text;
    gbt_status status;
    const char *says;
    size_t kept, dropped;
} ply_case;

#define BAD GBT_ERR_FORMAT
#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define ASCII "ply\nformat ascii 1.0\n"

static ply_case ply_cases[] = {
    {"good", ASCII "element vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6\n", GBT_OK, NULL, 2, 0},
    {"56 empty", "", BAD, "x.ply:1: not a PLY file", 0, 0},
    {"56 no magic", "plz\n", BAD, "x.ply:1: not a PLY file", 0, 0},
    {"56 magic without an end", "ply", BAD, "x.ply:1: not a PLY file", 0, 0},
    {"57 no end_header", ASCII "element vertex 2\n" XYZ, BAD, "x.ply:7: header does not end", 0, 0},
    {"57 end_header cut", ASCII "element vertex 2\n" XYZ "end_header", BAD, "header does not end", 0, 0},
    {"58 unknown format", "ply\nformat binary_middle_endian 1.0\nend_header\n", BAD,
     "x.ply:2: unknown format: binary_middle_endian", 0, 0},
    {"58 version 2.0", "ply\nformat ascii 2.0\nend_header\n", BAD,
     "x.ply:2: unknown version (wanted 1.0, got 2.0)", 0, 0},
    {"58 no version", "ply\nformat ascii\nend_header\n", BAD, "x.ply:2: line ends before the version", 0, 0},
    {"58 no format", "ply\nelement vertex 0\n" XYZ "end_header\n", BAD, "no format line", 0, 0},
    {"58 two formats", ASCII "format ascii 1.0\nend_header\n", BAD, "x.ply:3: second format line", 0, 0},
    {"59 count negative", ASCII "element vertex -1\n" XYZ "end_header\n", BAD,
     "x.ply:3: bad count of element vertex: -1", 0, 0},
    {"59 count 2^31", ASCII "element vertex 2147483648\n" XYZ "end_header\n1 2 3\n", BAD,
     "2147483648 rows of element vertex cannot be", 0, 0},
    {"59 count 2^63", ASCII "element vertex 9223372036854775808\n" XYZ "end_header\n1 2 3\n", BAD,
     "cannot be in the 6 bytes", 0, 0},
    {"59 count 2^64", ASCII "element vertex 18446744073709551616\n" XYZ "end_header\n", BAD,
     "bad count of element vertex", 0, 0},
    {"59 count 2^63, binary",
     "ply\nformat binary_little_endian 1.0\nelement vertex 9223372036854775808\n" XYZ "end_header\nabc", BAD,
     "cannot be in the 3 bytes", 0, 0},
    {"60 count 0", ASCII "element vertex 0\n" XYZ "end_header\n", GBT_OK, NULL, 0, 0},
    {"61 one vertex too many", ASCII "element vertex 3\n" XYZ "end_header\n1 2 3\n4 5 6\n", BAD,
     "3 rows of element vertex cannot be", 0, 0},
    {"61 one vertex too many, long rows",
     ASCII "element vertex 3\n" XYZ "end_header\n1.0 2.0 3.0\n4.0 5.0 6.0\n", BAD,
     "x.ply:9: file ends before the last row", 0, 0},
    {"61 binary row cut",
     "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" XYZ "end_header\n12345678901", BAD,
     "1 rows of element vertex cannot be", 0, 0},
    {"62 list in vertex",
     ASCII "element vertex 2\nproperty list uchar int n\n" XYZ "end_header\n2 7 8 1 2 3\n0 4 5 6\n", GBT_OK,
     NULL, 2, 0},
    {"63 list longer than its row",
     ASCII "element vertex 2\nproperty list uchar int n\n" XYZ "end_header\n255 7 8 1 2 3\n0 4 5 6\n", BAD,
     "x.ply:9: row has too few values", 0, 0},
    {"63 list past the end",
     "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int n\nelement vertex 1\n" XYZ
     "end_header\n\xff"
     "23456789012345",
     BAD, "file ends inside a row of element face", 0, 0},
    {"63 list of -1", ASCII "element vertex 1\nproperty list char int n\n" XYZ "end_header\n-1 1 2 3\n", BAD,
     "list of -1 items", 0, 0},
    {"63 list of -1, binary",
     "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list char int n\n" XYZ
     "end_header\n\xff"
     "23456789012345",
     BAD, "list of -1 items", 0, 0},
    {"63 list of nan", ASCII "element vertex 1\nproperty list uchar int n\n" XYZ "end_header\nnan 1 2 3\n",
     BAD, "list of nan items", 0, 0},
    {"63 list counted in floats",
     ASCII "element vertex 1\nproperty list float int n\n" XYZ "end_header\n0 1 2 3\n", BAD,
     "cannot be counted in floats", 0, 0},
    {"64 duplicate property", ASCII "element vertex 1\n" XYZ "property float x\nend_header\n1 2 3 4\n", BAD,
     "x.ply:7: duplicate property: x", 0, 0},
    {"64 duplicate element", ASCII "element vertex 1\n" XYZ "element vertex 1\nend_header\n1 2 3\n", BAD,
     "x.ply:7: duplicate element: vertex", 0, 0},
    {"65 no x", ASCII "element vertex 1\nproperty float y\nproperty float z\nend_header\n1 2\n", BAD,
     "element vertex has no property x", 0, 0},
    {"65 x is a list",
     ASCII
     "element vertex 1\nproperty list uchar float x\nproperty float y\nproperty float z\nend_header\n0 1 2\n",
     BAD, "no property x", 0, 0},
    {"65 no vertex", ASCII "element point 1\n" XYZ "end_header\n1 2 3\n", BAD, "no element vertex", 0, 0},
    {"67 unknown type", ASCII "element vertex 1\nproperty half x\nend_header\n1\n", BAD,
     "x.ply:4: unknown property type: half", 0, 0},
    {"68 unknown element before",
     ASCII "element camera 2\nproperty float f\nproperty list uchar int n\nelement vertex 1\n" XYZ
           "end_header\n1 2 8 9\n2 0\n1 2 3\n",
     GBT_OK, NULL, 1, 0},
    {"68 unknown element behind",
     ASCII "element vertex 1\n" XYZ "element face 1\nproperty list uchar int n\nend_header\n1 2 3\n3 0 0 0\n",
     GBT_OK, NULL, 1, 0},
    {"68 unknown header line", ASCII "elephant vertex 1\nend_header\n", BAD,
     "x.ply:3: unknown header line: elephant", 0, 0},
    {"68 property without element", ASCII "property float x\nend_header\n", BAD,
     "x.ply:3: property before any element", 0, 0},
    {"68 element without properties", ASCII "element x 5\nelement vertex 1\n" XYZ "end_header\n1 2 3\n", BAD,
     "element x has rows but no properties", 0, 0},
    {"69 too few values", ASCII "element vertex 2\n" XYZ "end_header\n1 2\n34 5 67\n", BAD,
     "x.ply:8: row has too few values", 0, 0},
    {"69 too many values", ASCII "element vertex 2\n" XYZ "end_header\n1 2 3 4\n4 5 6\n", BAD,
     "x.ply:8: row has too many values, from 4", 0, 0},
    {"69 not a number", ASCII "element vertex 1\n" XYZ "end_header\n1 2 three\n", BAD,
     "x.ply:8: value is not a number: three", 0, 0},
    {"69 decimal comma", ASCII "element vertex 1\n" XYZ "end_header\n1,5 2 3\n", BAD,
     "value is not a number: 1,5", 0, 0},
    {"69 1e999", ASCII "element vertex 1\n" XYZ "end_header\n1e999 2 3\n", BAD,
     "value is out of range: 1e999", 0, 0},
    {"69 blank lines between rows", ASCII "element vertex 2\n" XYZ "end_header\n\n1 2 3\n\n \n4 5 6", GBT_OK,
     NULL, 2, 0},
    {"69 CRLF",
     "ply\r\nformat ascii 1.0\r\ncomment hi\r\nelement vertex 1\r\nproperty float x\r\nproperty float "
     "y\r\nproperty float z\r\nend_header\r\n1 2 3\r\n",
     GBT_OK, NULL, 1, 0},
    {"70 NaN and Inf", ASCII "element vertex 4\n" XYZ "end_header\nnan 2 3\n1 -inf 3\n1 2 1e20\n4 5 6\n",
     GBT_OK, NULL, 1, 3},
};

static gbt_status read_text(const char *text, size_t size, raw_scene *raw, gbt_error *err)
{
    unsigned char *copy = exact_copy(text, size);
    const source_file file = {"x.ply", copy, size};
    const gbt_status status = ply_read_points(&file, raw, err);
    free(copy);
    return status;
}

static void malformed(void **state)
{
    const ply_case *c = *state;
    raw_scene raw = {0};
    gbt_error err = {0};
    const gbt_status status = read_text(c->text, strlen(c->text), &raw, &err);
    check_message(status, &err);
    if (status != c->status || (c->says != NULL && strstr(err.text, c->says) == NULL))
        fail_msg("status %d, message: %s", (int)status, err.text);
    if (status == GBT_OK) {
        assert_true(raw_is_sound(&raw));
        assert_int_equal(raw.point_count, c->kept);
        assert_int_equal(raw.points_dropped, c->dropped);
        assert_false(raw.has_color);
    }
    raw_free(&raw);
}

static void header_limit(void **state)
{
    (void)state;
    for (int extra = 0; extra < 2; extra++) {
        sink s = {0};
        sink_put_text(&s, ASCII "element vertex 1\n" XYZ "comment ");
        while (s.size < PLY_MAX_HEADER_BYTES - 12 + (size_t)extra)
            sink_put_text(&s, "x");
        sink_put_text(&s, "\nend_header\n1 2 3\n");
        raw_scene raw = {0};
        gbt_error err = {0};
        assert_int_equal(read_text((const char *)s.bytes, s.size, &raw, &err),
                         extra == 0 ? GBT_OK : GBT_ERR_FORMAT);
        raw_free(&raw);
        sink_free(&s);
    }
}

/* The same three vertices in every type of coordinate, both byte orders, with colours of three types, unknown
   properties in between. */
static void types_and_orders(void **state)
{
    (void)state;
    static const char *const names[] = {"char", "uint8",  "short",   "uint16",
                                        "int",  "uint32", "float32", "double"};
    static const size_t bytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    static const char *const color_names[] = {"uchar", "ushort", "float", "char", "short"};
    for (size_t type = 0; type < 8; type++)
        for (size_t color = 0; color < 5; color++)
            for (int big = 0; big < 2; big++) {
                sink s = {0};
                char header[512];
                snprintf(header, sizeof header,
                         "ply\nformat binary_%s_endian 1.0\nelement vertex 3\nproperty %s z\nproperty uchar "
                         "skipped\nproperty %s blue\nproperty %s red\n"
                         "property %s x\nproperty list ushort double skipped_list\nproperty %s y\nproperty "
                         "%s green\nend_header\n",
                         big ? "big" : "little", names[type], color_names[color], color_names[color],
                         names[type], names[type], color_names[color]);
                sink_put_text(&s, header);
                for (int i = 0; i < 3; i++) {
                    const int order[8] = {2, -1, 5, 3,
                                          0, -2, 1, 4}; /* z, skipped, blue, red, x, list, y, green */
                    for (int k = 0; k < 8; k++) {
                        const int value = 10 * i + order[k];
                        uint64_t bits = (uint64_t)value;
                        size_t width = bytes[type];
                        if (order[k] == -1)
                            width = 1;
                        if (order[k] == -2) {
                            const unsigned char count[2] = {big ? 0 : (unsigned char)i,
                                                            big ? (unsigned char)i : 0};
                            sink_put(&s, count, 2);
                            for (int j = 0; j < i; j++)
                                sink_put(&s, "12345678", 8);
                            continue;
                        }
                        if (order[k] >= 3) { /* a colour: value / 5 of the range */
                            const float level = (float)(order[k] - 3 + i) / 5;
                            width = (const size_t[]){1, 2, 4, 1, 2}[color];
                            bits = (uint64_t)lround((double)level *
                                                    (const int[]){255, 65535, 0, 127, 32767}[color]);
                            if (color == 2)
                                memcpy(&bits, &level, 4);
                        } else if (order[k] >= 0 && type == 6) {
                            const float as_float = (float)value;
                            bits = 0;
                            memcpy(&bits, &as_float, 4);
                        } else if (order[k] >= 0 && type == 7) {
                            const double as_double = value;
                            memcpy(&bits, &as_double, 8);
                        }
                        if (big)
                            bits = __builtin_bswap64(bits) >> (64 - 8 * width);
                        sink_put_uint(&s, bits, width);
                    }
                }
                raw_scene raw = {0};
                gbt_error err = {0};
                if (read_text((const char *)s.bytes, s.size, &raw, &err) != GBT_OK)
                    fail_msg("%s %s %d: %s", names[type], color_names[color], big, err.text);
                assert_int_equal(raw.point_count, 3);
                assert_true(raw.has_color);
                for (size_t i = 0; i < 3; i++)
                    for (size_t k = 0; k < 3; k++) {
                        assert_true(raw.position[3 * i + k] == (double)(10 * i + k));
                        assert_true(fabsf(raw.color[3 * i + k] - (float)(i + k) / 5) <
                                    (color == 3 ? 0.5f / 127 : 2e-5f));
                    }
                raw_free(&raw);
                sink_free(&s);
            }
}

static void negative_integers(void **state)
{
    (void)state;
    static const char text[] = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty char "
                               "x\nproperty short y\nproperty int z\nend_header\n"
                               "\xff\xfe\xff\xfd\xff\xff\xff";
    raw_scene raw = {0};
    assert_ok(read_text(text, sizeof text - 1, &raw, &assert_ok_err_));
    assert_true(raw.position[0] == -1 && raw.position[1] == -2 && raw.position[2] == -3);
    raw_free(&raw);
}

/* Values outside [0, 1] and NaN in a colour do no harm. */
static void colors_are_bounded(void **state)
{
    (void)state;
    static const char text[] =
        ASCII "element vertex 1\n" XYZ
              "property float red\nproperty float green\nproperty float blue\nend_header\n1 2 3 200 -4 nan\n";
    raw_scene raw = {0};
    assert_ok(read_text(text, strlen(text), &raw, &assert_ok_err_));
    assert_true(raw.color[0] == 1 && raw.color[1] == 0 && raw.color[2] == 0);
    raw_free(&raw);
}

static void written_cloud(void **state)
{
    (void)state;
    const float position[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9},
                color[9] = {0, 0.5f, 1, -1, 2, NAN, 0.25f, 0.001f, 0.999f};
    const float radius[6] = {0.5f, 99, 1.5f, 99, 2.5f, 99}, level[3] = {1, 2, 3};
    const ply_extra extras[2] = {{"radius", radius, 2}, {"level", level, 1}};
    const uint32_t faces[6] = {0, 1, 2, 2, 1, 0};
    const ply_cloud cloud = {.vertex_count = 3,
                             .position = position,
                             .origin = {5e8, 0, -0.3},
                             .extra_count = 2,
                             .extras = extras,
                             .color = color,
                             .face_count = 2,
                             .faces = faces,
                             .comment = "made by a test"};
    const char *path = in_folder("cloud.ply");
    assert_ok(ply_write(path, &cloud, &assert_ok_err_));
    unsigned char *bytes;
    source_file file = {.name = path};
    assert_ok(file_read(path, &bytes, &file.size, &assert_ok_err_));
    file.bytes = bytes;
    static const char header[] =
        "ply\nformat binary_little_endian 1.0\ncomment made by a test\nelement vertex 3\n"
        "property double x\nproperty double y\nproperty double z\nproperty float radius\nproperty float "
        "level\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    assert_int_equal(file.size, strlen(header) + 3 * 35 + 2 * 13);
    assert_memory_equal(bytes, header, strlen(header));
    raw_scene raw = {0};
    assert_ok(ply_read_points(&file, &raw, &assert_ok_err_));
    static const double levels[9] = {0, 128, 255, 0, 255, 0, 64, 0, 255};
    for (size_t i = 0; i < 9; i++) {
        assert_true(raw.position[i] == (double)position[i] + cloud.origin[i % 3]);
        assert_true(raw.color[i] == (float)(levels[i] / 255));
    }
    assert_int_equal(bytes[file.size - 13], 3);
    assert_int_equal(bytes[file.size - 12], 2);
    float stored;
    memcpy(&stored, bytes + strlen(header) + 35 + 24, 4);
    assert_true(stored == 1.5f);
    raw_free(&raw);
    mem_free(bytes);
}

static void empty_cloud(void **state)
{
    (void)state;
    const ply_cloud cloud = {0};
    const char *path = in_folder("cloud.ply");
    assert_ok(ply_write(path, &cloud, &assert_ok_err_));
    unsigned char *bytes;
    source_file file = {.name = path};
    assert_ok(file_read(path, &bytes, &file.size, &assert_ok_err_));
    file.bytes = bytes;
    raw_scene raw = {0};
    assert_ok(ply_read_points(&file, &raw, &assert_ok_err_));
    assert_int_equal(raw.point_count, 0);
    raw_free(&raw);
    mem_free(bytes);
}

static void writer_refuses(void **state)
{
    (void)state;
    const float values[3] = {0};
    const uint32_t faces[3] = {0, 0, 1};
    const ply_extra bad_name = {"two words", values, 1}, no_name = {"", values, 1};
    const ply_cloud clouds[] = {
        {.vertex_count = 1, .position = values, .face_count = 1, .faces = faces},
        {.vertex_count = 1, .position = values, .extra_count = 1, .extras = &bad_name},
        {.vertex_count = 1, .position = values, .extra_count = 1, .extras = &no_name},
        {.vertex_count = 1, .position = values, .comment = "two\nlines"},
    };
    for (size_t i = 0; i < sizeof clouds / sizeof clouds[0]; i++) {
        gbt_error err = {0};
        const char *path = in_folder("cloud.ply");
        assert_int_equal(ply_write(path, &clouds[i], &err), GBT_ERR_ARGUMENT);
        check_message(GBT_ERR_ARGUMENT, &err);
        assert_false(file_exists(path));
    }
}

int main(void)
{
    enum { CASE_COUNT = sizeof ply_cases / sizeof ply_cases[0] };
    static struct CMUnitTest tests[CASE_COUNT];
    for (size_t i = 0; i < CASE_COUNT; i++)
        tests[i] = (struct CMUnitTest){
            .name = ply_cases[i].name, .test_func = malformed, .initial_state = &ply_cases[i]};
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test(header_limit),
        cmocka_unit_test(types_and_orders),
        cmocka_unit_test(negative_integers),
        cmocka_unit_test(colors_are_bounded),
        cmocka_unit_test_setup_teardown(written_cloud, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(empty_cloud, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(writer_refuses, folder_make, folder_remove),
    };
    const int failures = cmocka_run_group_tests_name("ply, tables", tests, NULL, NULL);
    return failures + cmocka_run_group_tests_name("ply", fixed, NULL, NULL);
}
