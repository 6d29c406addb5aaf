/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_mesh_file.c -- OBJ and PLY meshes: what is read, and one clear line about what is wrong. */
#include "data/mesh_file.h"
#include "data_support.h"

#define V3 "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define V4 V3 "v 1 1 0\n"
#define PLY_HEAD                                                                                             \
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
#define PLY_FACES(n) "element face " #n "\nproperty list uchar int vertex_indices\nend_header\n"
#define PLY_V4 "0 0 0\n1 0 0\n0 1 0\n1 1 0\n"

static struct good_case {
    const char *name, *text;
    size_t vertex_count, triangle_count;
    uint32_t triangles[12];
} good_cases[] = {
    {"a triangle", V3 "f 1 2 3\n", 3, 1, {0, 1, 2}},
    {"no newline at the end, Windows lines", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3", 3, 1, {0, 1, 2}},
    {"polygons are fans", V4 "f 1 2 4 3\n", 4, 2, {0, 1, 3, 0, 3, 2}},
    {"texture and normal numbers",
     V3 "vt 0 0\nvn 0 0 1\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 3/1/1 2/1/1 1/1/1\n",
     3,
     3,
     {0, 1, 2, 0, 1, 2, 2, 1, 0}},
    {"negative numbers count back from here",
     V3 "f -3 -2 -1\nv 1 1 0\nf -3 -2 -1\n",
     4,
     2,
     {0, 1, 2, 1, 2, 3}},
    {"what is passed over",
     "# a\n\n  \t\nmtllib a.mtl\no b\n" V3 "g c d\nusemtl e\ns off\nl 1 2\np 1\n#f 9 9 9\n\tf  1\t2 3  \n",
     3,
     1,
     {0, 1, 2}},
    {"a weight or a colour behind the position",
     "v 0 0 0 1\nv 1 0 0 .5 .5 .5\nv 0 1e0 -0 x\nf 1 2 3\n",
     3,
     1,
     {0, 1, 2}},
    {"a byte order mark", "\xef\xbb\xbf" V3 "f 1 2 3\n", 3, 1, {0, 1, 2}},
    {"lines that continue",
     "v 0 \\\n0 0 1\\\nx\nv 1 0 0\nv 0 1\\\r\n0\nvt 0 \\\n0\nf 1\\\n\\\n2 \\\r\n3\nf \\\n3 2 1\\",
     3,
     2,
     {0, 1, 2, 2, 1, 0}},
    {"a comment does not continue", "# C:\\\n" V3 "f 1 2 3\n", 3, 1, {0, 1, 2}},
    {"a corner twice", V3 "f 1 1 2\n", 3, 1, {0, 0, 1}},
    {"PLY", PLY_HEAD PLY_FACES(2) PLY_V4 "3 0 1 2\n4 0 1 3 2\n", 4, 3, {0, 1, 2, 0, 1, 3, 0, 3, 2}},
    {"PLY with other lists and the other name",
     PLY_HEAD "property list uchar int n\nelement face 1\nproperty list uchar float a\nproperty list int "
              "uint vertex_index\nproperty int b\nend_header\n"
              "0 0 0 1 9\n1 0 0 0\n0 1 0 2 9 9\n1 1 0 0\n2 7 7 3 3 2 1 -5\n",
     4,
     1,
     {3, 2, 1}},
};

static void good(void **state)
{
    const struct good_case *c = *state;
    const source_file file = {"m", (const unsigned char *)c->text, strlen(c->text)};
    mesh_data mesh = {0};
    assert_ok(mesh_file_parse(&file, &mesh, &assert_ok_err_));
    assert_int_equal(mesh.vertex_count, c->vertex_count);
    assert_int_equal(mesh.triangle_count, c->triangle_count);
    assert_memory_equal(mesh.triangles, c->triangles, 3 * c->triangle_count * sizeof *mesh.triangles);
    assert_true(mesh.position[0] == 0 && mesh.position[3] == 1 && mesh.position[7] == 1);
    mesh_data_free(&mesh);
    assert_null(mesh.position);
}

static struct bad_case {
    const char *text, *message;
} bad_cases[] = {
    {"", "m: no triangles in it (wanted an OBJ or PLY mesh)"},
    {V3, "m: no triangles in it (wanted an OBJ or PLY mesh)"},
    {"v 1 2\n", "m:1: vertex of 2 coordinates (wanted 3)"},
    {"# a\nv 1 2 x\n", "m:2: not a coordinate: x"},
    {"v 1 2 0x10\n", "m:1: not a coordinate: 0x10"},
    {"v 1 2 1e999\n", "m:1: not a coordinate: 1e999"},
    {"v 1 2 nan\n", "m:1: vertex 0: bad coordinate (wanted |x| <= 1e+12, got nan)"},
    {"v 0 0 0\nv 1 2 -1e13\n", "m:2: vertex 1: bad coordinate (wanted |x| <= 1e+12, got -1e+13)"},
    {V3 "f 1 2\n", "m:4: face of 2 corners (wanted 3 or more)"},
    {V3 "f\n", "m:4: face of 0 corners (wanted 3 or more)"},
    {V3 "f 1 2 4\n", "m:4: no such vertex: 4 (there are 3 so far)"},
    {V3 "f 0 1 2\n", "m:4: no such vertex: 0 (there are 3 so far)"},
    {V3 "f 1 2 -4\n", "m:4: no such vertex: -4 (there are 3 so far)"},
    {V3 "f -0 1 2\n", "m:4: no such vertex: -0 (there are 3 so far)"},
    {"f 1 2 3\n" V3, "m:1: no such vertex: 1 (there are 0 so far)"},
    {V3 "f 1 2 99999999999999999999\n", "m:4: no such vertex: 99999999999999999999 (there are 3 so far)"},
    {V3 "f 1 2 x\n", "m:4: not a corner of a face: x"},
    {V3 "f 1 2 /3\n", "m:4: not a corner of a face: /3"},
    {V3 "f 1 2 -\n", "m:4: not a corner of a face: -"},
    {V3 "f 1 2 3.0\n", "m:4: not a corner of a face: 3.0"},
    {V3 "f 1 2 \\ \n3\n", "m:4: not a corner of a face: \\"},
    {V3 "f 1 2 \\\nx\n", "m:5: not a corner of a face: x"},
    {V3 "f 1 2 \\", "m:4: face of 2 corners (wanted 3 or more)"},
    {V3 "curv2 1 2\n", "m:4: not a line of an OBJ mesh: curv2"},
    {"solid cube\n", "m:1: not a line of an OBJ mesh: solid"},
    {PLY_HEAD "end_header\n" PLY_V4, "m: no element face in the header"},
    {PLY_HEAD "element face 1\nproperty int vertex_indices\nend_header\n" PLY_V4 "3\n",
     "m: element face has no list vertex_indices"},
    {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n" PLY_FACES(
         1) "0 0\n3 0 0 0\n",
     "m: element vertex has no property z"},
    {PLY_HEAD PLY_FACES(0) PLY_V4, "m: no triangles in it (wanted an OBJ or PLY mesh)"},
    {PLY_HEAD PLY_FACES(1) PLY_V4 "3 0 1 4\n", "m: face 0: no such vertex: 4 (there are 4)"},
    {PLY_HEAD PLY_FACES(2) PLY_V4 "3 0 1 2\n3 0 1 -1\n", "m: face 1: no such vertex: -1 (there are 4)"},
    {PLY_HEAD PLY_FACES(1) PLY_V4 "3 0 1 0.5\n", "m: face 0: no such vertex: 0.5 (there are 4)"},
    {PLY_HEAD PLY_FACES(1) PLY_V4 "2 0 1\n", "m: face 0 of 2 corners (wanted 3 or more)"},
    {PLY_HEAD PLY_FACES(1) "0 0 0\n1 0 nan\n0 1 0\n1 1 0\n3 0 1 2\n",
     "m: vertex 1: bad coordinate (wanted |x| <= 1e+12, got nan)"},
    {PLY_HEAD PLY_FACES(1) PLY_V4 "3 0 1\n", "m:14: row has too few values"},
};

static void bad(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof bad_cases / sizeof *bad_cases; i++) {
        const source_file file = {"m", (const unsigned char *)bad_cases[i].text, strlen(bad_cases[i].text)};
        mesh_data mesh = {0};
        gbt_error err = {0};
        const gbt_status status = mesh_file_parse(&file, &mesh, &err);
        if (status != GBT_ERR_FORMAT || strcmp(err.text, bad_cases[i].message) != 0)
            fail_msg("%s\n  wanted: %s\n  got %d: %s", bad_cases[i].text, bad_cases[i].message, (int)status,
                     err.text);
        mesh_data_free(&mesh);
    }
}

static void files(void **state)
{
    (void)state;
    mesh_data mesh;
    gbt_error why = {0};
    write_text(in_folder("a.obj"), V3 "f 1 2 3\n");
    assert_ok(mesh_file_read(in_folder("a.obj"), &mesh, &assert_ok_err_));
    assert_int_equal(mesh.triangle_count, 1);
    mesh_data_free(&mesh);
    assert_int_equal(mesh_file_read(in_folder("none.obj"), &mesh, &why), GBT_ERR_IO);
    mesh_data_free(&mesh);
}

int main(void)
{
    enum { GOOD_COUNT = sizeof good_cases / sizeof good_cases[0] };
    static struct CMUnitTest tests[GOOD_COUNT];
    for (size_t i = 0; i < GOOD_COUNT; i++)
        tests[i] = (struct CMUnitTest){
            .name = good_cases[i].name, .test_func = good, .initial_state = &good_cases[i]};
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test(bad),
        cmocka_unit_test_setup_teardown(files, folder_make, folder_remove),
    };
    const int failures = cmocka_run_group_tests_name("meshes", tests, NULL, NULL);
    return failures + cmocka_run_group_tests_name("mesh files", fixed, NULL, NULL);
}
