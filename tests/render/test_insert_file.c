/* SPDX-License-Identifier: Apache-2.0 */
/* tests/render/test_insert_file.c -- insert files: what each field means, and one clear line about what is
   wrong. */
#include "base/near.h"
#include "folder.h"
#include "render/insert_file.h"

static const char *path;
static const double none[3] = {0, 0, 0};

static int set_up(void **state)
{
    if (folder_make(state) != 0)
        return -1;
    path = in_folder("i.json");
    write_text(in_folder("m.obj"), "v 1 0 0\nv 0 1 0\nv 0 0 1\nv 9 9 9\nf 1 2 3\n");
    return 0;
}

static insert_scene read_good(const char *text, const double origin[3])
{
    insert_scene in;
    gbt_error err = {0};
    write_text(path, text);
    if (insert_file_read(path, origin, &in, &err) != GBT_OK)
        fail_msg("%s: %s", text, err.text);
    return in;
}

static void defaults(void **state)
{
    (void)state;
    insert_scene in = read_good("{\"objects\": [{\"mesh\": \"m.obj\"}]}", none);
    assert_true(in.lamp == INSERT_NO_LAMP && in.ambient == 1 && in.object_count == 1 &&
                in.triangle_count == 1 && in.vertex_count == 4);
    const insert_object *o = in.objects;
    assert_true(o->material == INSERT_MATT && !o->smooth && o->color[0] == 0.8f && o->color[1] == 0.8f &&
                o->color[2] == 0.8f && o->triangle_end == 1);
    const float vertices[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 9, 9, 9};
    assert_memory_equal(in.vertices, vertices, sizeof vertices);
    assert_true(in.reach >= 9 && in.reach < 9.01f && in.offset_min > 0);
    insert_scene_free(&in);
    assert_null(in.tree);
}

/* x -> turn (scale x) + position - origin, and the lamp likewise. */
static void placed(void **state)
{
    (void)state;
    const double origin[3] = {1000000, 0, -5};
    insert_scene in =
        read_good("{\"light\": {\"position\": [1000001, 2, 3], \"radius\": 0.5, \"ambient\": 0.125}, "
                  "\"objects\": [{\"mesh\": \"m.obj\", \"material\": \"mirror\", \"color\": [0, 0.5, 1], "
                  "\"smooth\": true, \"position\": [1000000.25, 1, 0], \"scale\": 2, \"axis\": [0, 0, 3], "
                  "\"angle_deg\": 90}, {\"mesh\": \"m.obj\", \"position\": [1000000, 0, -5]}]}",
                  origin);
    const double wanted[6] = {0.25, 3, 5, -1.75, 1, 5};
    for (int i = 0; i < 6; i++)
        assert_near((double)in.vertices[i], wanted[i], 1e-6);
    assert_near((double)in.vertices[12], 1, 0);
    assert_true(in.lamp == INSERT_LAMP_POINT && in.lamp_at[0] == 1 && in.lamp_at[1] == 2 &&
                in.lamp_at[2] == 8 && in.lamp_radius == 0.5 && in.ambient == 0.125f);
    assert_true(in.objects[0].material == INSERT_MIRROR && in.objects[0].smooth &&
                in.objects[0].color[1] == 0.5f);
    assert_true(in.objects[1].material == INSERT_MATT && in.objects[1].triangle_end == 2 &&
                in.triangles[3] == 4);
    insert_scene_free(&in);
    in = read_good("{\"light\": {\"towards\": [0, -3, 4]}, \"objects\": [{\"mesh\": \"m.obj\"}]}", origin);
    assert_true(in.lamp == INSERT_LAMP_DISTANT && in.ambient == 0.4f);
    assert_near(in.lamp_at[1], -0.6, 1e-15);
    insert_scene_free(&in);
}

#define ONE(fields) "{\"objects\": [{\"mesh\": \"m.obj\"" fields "}]}"
#define LIGHT(fields) "{\"light\": " fields ", \"objects\": [{\"mesh\": \"m.obj\"}]}"

static const struct bad_case {
    const char *text, *message; /* behind "PATH" */
} bad_cases[] = {
    {"", ":1: file is empty"},
    {"[]", ": wanted a JSON object"},
    {"{}", ": objects: wanted a list of 1 to 1000 objects"},
    {"{\"objects\": []}", ": objects: wanted a list of 1 to 1000 objects"},
    {"{\"objects\": {}}", ": objects: wanted a list of 1 to 1000 objects"},
    {"{\"objects\": [3]}", ": objects[0].mesh: missing (wanted an object with a mesh)"},
    {"{\"objects\": [{\"mesh\": \"m.obj\"}, {}]}",
     ": objects[1].mesh: wanted the name of an OBJ or PLY file"},
    {"{\"object\": []}", ": object: unknown field (wanted one of objects light)"},
    {ONE(", \"colour\": [1, 1, 1]"), ": objects[0].colour: unknown field (wanted one of mesh material color"},
    {ONE(", \"material\": \"glass\""), ": objects[0].material: wanted one of matt, mirror"},
    {ONE(", \"color\": [1, 1, 1.5]"), ": objects[0].color: wanted 3 numbers in [0, 1]"},
    {ONE(", \"color\": [1, 1]"), ": objects[0].color: wanted 3 numbers"},
    {ONE(", \"smooth\": 1"), ": objects[0].smooth: wanted true or false"},
    {ONE(", \"scale\": 0"), ": objects[0].scale: wanted a number in (0, 1e+15]"},
    {ONE(", \"scale\": 1e14"), ": objects[0].mesh: vertex 0 lies beyond 1e+12"},
    {ONE(", \"position\": [1e13, 0, 0]"), ": objects[0].mesh: vertex 0 lies beyond 1e+12"},
    {ONE(", \"axis\": [1, 0, 0]"), ": objects[0].angle_deg: missing (a rotation needs axis and angle_deg)"},
    {ONE(", \"angle_deg\": 3"), ": objects[0].axis: missing (a rotation needs axis and angle_deg)"},
    {ONE(", \"axis\": [0, 0, 0], \"angle_deg\": 3"), ": objects[0].axis: is 0 (wanted a direction)"},
    {ONE(", \"axis\": [0, 0, 1], \"angle_deg\": 361"),
     ": objects[0].angle_deg: wanted a number in [-360, 360]"},
    {LIGHT("[1, 2, 3]"), ": light: wanted an object with position or towards"},
    {LIGHT("{}"), ": light: wanted either position or towards"},
    {LIGHT("{\"position\": [1, 2, 3], \"towards\": [1, 2, 3]}"),
     ": light: wanted either position or towards"},
    {LIGHT("{\"position\": [1, 2]}"), ": light.position: wanted 3 numbers"},
    {LIGHT("{\"towards\": [0, 0, 0]}"), ": light.towards: is 0 (wanted a direction)"},
    {LIGHT("{\"towards\": [0, 0, 1], \"radius\": 1}"),
     ": light.radius: only with position (a distant lamp has no radius)"},
    {LIGHT("{\"position\": [0, 0, 1], \"radius\": -1}"), ": light.radius: wanted a number in [0, 1e+15]"},
    {LIGHT("{\"position\": [0, 0, 1], \"ambient\": 2}"), ": light.ambient: wanted a number in [0, 1]"},
    {LIGHT("{\"at\": [0, 0, 1]}"),
     ": light.at: unknown field (wanted one of position towards radius ambient)"},
};

static void says_what_is_wrong(void **state)
{
    (void)state;
    insert_scene in;
    for (size_t i = 0; i < sizeof bad_cases / sizeof *bad_cases; i++) {
        gbt_error err = {0};
        write_text(path, bad_cases[i].text);
        const gbt_status status = insert_file_read(path, none, &in, &err);
        const size_t length = strlen(path);
        if (status != GBT_ERR_FORMAT || strncmp(err.text, path, length) != 0 ||
            strncmp(err.text + length, bad_cases[i].message, strlen(bad_cases[i].message)) != 0)
            fail_msg("%s: %d: %s", bad_cases[i].text, (int)status, err.text);
        insert_scene_free(&in);
    }
    gbt_error err = {0};
    write_text(path, "{\"objects\": [{\"mesh\": \"nothing.obj\"}]}");
    assert_int_equal(insert_file_read(path, none, &in, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "nothing.obj: cannot open"));
    insert_scene_free(&in);
}

static void without_memory(void **state)
{
    (void)state;
    insert_scene in;
    gbt_status status = GBT_ERR_NO_MEMORY;
    write_text(path, "{\"objects\": [{\"mesh\": \"m.obj\"}, {\"mesh\": \"m.obj\", \"smooth\": true}]}");
    long n = 0;
    for (; n < 100 && status != GBT_OK; n++) {
        gbt_error err = {0};
        mem_fail_after(n);
        status = insert_file_read(path, none, &in, &err);
        mem_fail_after(-1);
        assert_true(status == GBT_OK || status == GBT_ERR_NO_MEMORY);
        insert_scene_free(&in);
    }
    assert_true(status == GBT_OK && n > 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(defaults), cmocka_unit_test(placed),
                                       cmocka_unit_test(says_what_is_wrong),
                                       cmocka_unit_test(without_memory)};
    return cmocka_run_group_tests(tests, set_up, folder_remove);
}
