/* SPDX-License-Identifier: Apache-2.0 */
/* tests/command/test_info_init.c -- what info and init say of things whose numbers are known, as JSON; the
   spheres that init draws. */
#include <jansson.h>
#include <unistd.h>

#include "base/image.h"
#include "data/json_out.h"
#include "data/scene.h"
#include "command/ball_mesh.h"
#include "command/expect.h"
#include "folder.h"
#include "gbtrace/info.h"
#include "gbtrace/init.h"
#include "io/model_file.h"

/** A cubic grid of side^3 points, 1 apart, at `offset`. */
static const char *write_grid(const char *name, int side, double offset)
{
    const char *path = in_folder("%s", name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file,
            "ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double "
            "z\nend_header\n",
            side * side * side);
    for (int i = 0; i < side * side * side; i++)
        fprintf(file, "%.17g %.17g %.17g\n", offset + i % side, offset + i / side % side,
                offset + i / side / side);
    fclose(file);
    return path;
}

static json_t *info_as_json(const char *path)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    gbt_error err = {0};
    const gbt_status status = gbt_info(path, 1, out, &err);
    fclose(out);
    if (status != GBT_OK)
        fail_msg("%s", err.text);
    json_t *value = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    free(text);
    assert_non_null(value);
    assert_int_equal(json_integer_value(json_object_get(value, "schema")), 1);
    return value;
}

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_number(value))
        fail_msg("%s is not a number", key);
    return json_number_value(value);
}

static void info_of_a_cloud(void **state)
{
    (void)state;
    json_t *value = info_as_json(write_grid("cloud.ply", 4, 1e6));
    assert_string_equal(json_string_value(json_object_get(value, "kind")), "dataset");
    assert_string_equal(json_string_value(json_object_get(value, "source")), "ply");
    assert_true(number(value, "points") == 64);
    assert_true(number(value, "views") == 0);
    assert_true(json_is_false(json_object_get(value, "points_have_color")));
    const json_t *box = json_object_get(value, "point_box");
    for (size_t k = 0; k < 3; k++) {
        assert_true(json_number_value(json_array_get(json_object_get(value, "origin"), k)) == 1e6 + 1);
        assert_true(json_number_value(json_array_get(json_array_get(box, 0), k)) == 1e6);
        assert_true(json_number_value(json_array_get(json_array_get(box, 1), k)) == 1e6 + 3);
    }
    json_decref(value);
}

/* What runs took with AVX-512 and two threads (docs/results.md): memory within a factor of 1.5, time within a
   quarter. */
static void expectations_hold(void **state)
{
    (void)state;
    static const struct {
        const char *data;
        double downscale, bytes, seconds, steps;
    } runs[] = {{"data/plush", 1.33333, 317.2e6, 84, 4671},
                {"data/fox", 1.33333, 271.7e6, 84, 4732},
                {"data/castle", 1.33333, 289.3e6, 84, 4977},
                {"data/aerial", 1.33333, 319.5e6, 84, 4167}};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        const char *path = shared_path(runs[i].data);
        if (path == NULL)
            skip();
        scene s;
        assert_ok(scene_load(path, NULL, &s, NULL));
        const expectation e = expect_training(&s, runs[i].downscale, 2, CPU_AVX512, runs[i].seconds);
        const double time = e.step_seconds * runs[i].steps / runs[i].seconds;
        print_message("%s: %.2f of the memory, %.2f of the time\n", runs[i].data,
                      e.memory.whole / runs[i].bytes, time);
        assert_true(e.memory.whole < 1.5 * runs[i].bytes && e.memory.whole > runs[i].bytes / 1.5);
        assert_true(e.memory.least < e.memory.whole);
        assert_true(time < 1.25 && time > 1 / 1.25);
        assert_true(e.score_seconds > 0);
        scene_free(&s);
    }
}

static void info_of_a_model(void **state)
{
    (void)state;
    model m = {.anchors.offset_count = 3,
               .origin = {1, 2, 4.5e6},
               .voxel_size = 0.25f,
               .extent = 2,
               .data_folder = "photos",
               .config = "a = 1\nb = \"x\"\n",
               .iterations = 1234};
    assert_ok(anchors_resize(&m.anchors, 17, NULL));
    assert_ok(decoder_init(&m.decoder, 3, true, 1, NULL));
    assert_ok(model_save(in_folder("model.gbt"), &m, NULL));
    const char *paths[2] = {in_folder("model.gbt"), test_folder}; /* the file, and a run folder with it */
    for (int i = 0; i < 2; i++) {
        json_t *value = info_as_json(paths[i]);
        assert_string_equal(json_string_value(json_object_get(value, "kind")), "model");
        assert_true(number(value, "anchors") == 17);
        assert_true(number(value, "offsets") == 3);
        assert_true(number(value, "iterations") == 1234);
        assert_true(number(value, "decoder_parameters") == (double)m.decoder.param_count);
        assert_true(number(value, "voxel_size") == 0.25);
        assert_true(json_is_true(json_object_get(value, "has_distance")));
        assert_string_equal(json_string_value(json_object_get(value, "config")), "a = 1\nb = \"x\"\n");
        unsigned char *bytes;
        size_t byte_count;
        assert_ok(file_read(paths[0], &bytes, &byte_count, NULL));
        mem_free(bytes);
        assert_true(number(value, "bytes") == (double)byte_count);
        json_decref(value);
    }
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    assert_ok(gbt_info(paths[0], 0, out, NULL));
    fclose(out);
    assert_non_null(strstr(text, "  anchors   17, with 3 Gaussians each at most\n"));
    assert_non_null(strstr(text, "  config    a = 1\n  config    b = \"x\"\n"));
    free(text);
    model_free(&m);
    unlink(in_folder("model.gbt"));
}

/* Headers alone are read: whether such a photo is opaque is not known. */
static void info_of_photos_with_an_alpha_channel(void **state)
{
    (void)state;
#define FRAME(name, x)                                                                                       \
    "{\"file_path\": \"" name "\", \"transform_matrix\": [[1, 0, 0, " x "], [0, 1, 0, 0], [0, 0, 1, 0]]}"
    static const char cameras[] =
        "{\"fl_x\": 8, \"w\": 8, \"h\": 8, \"frames\": [" FRAME("0.png", "0") ", " FRAME("1.png", "1") "]}";
    image photo;
    assert_ok(image_alloc(&photo, 8, 8, 4, NULL));
    for (int i = 0; i < 8 * 8 * 4; i++)
        photo.pixels[i] = 1;
    assert_ok(file_make_folder(in_folder("opaque"), NULL));
    for (int i = 0; i < 2; i++)
        assert_ok(image_write(in_folder("opaque/%d.png", i), &photo, NULL));
    image_free(&photo);
    write_text(in_folder("opaque/transforms.json"), cameras);
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    assert_ok(gbt_info(in_folder("opaque"), 0, out, NULL));
    fclose(out);
    if (strstr(text, "alpha channel: 2 (what is transparent lies on black; see the setting alpha)\n") == NULL)
        fail_msg("%s", text);
    free(text);
}

static void info_writes_nothing_when_it_fails(void **state)
{
    (void)state;
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    gbt_error err = {0};
    assert_int_equal(gbt_info(in_folder("none.ply"), 1, out, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "none.ply"));
    fclose(out);
    assert_int_equal(length, 0);
    free(text);
}

static void init_counts(void **state)
{
    (void)state;
    const char *data = write_grid("cloud.ply", 4, 0.0);
    FILE *report = fopen("/dev/null", "w");
    gbt_init_def def = gbt_init_def_default();
    def.init_count = 0.25;
    const struct {
        gbt_init_kind init;
        int max_depth;
        float voxel_size;
        double anchors, voxels, balls;
    } rows[] = {
        /* cubes of 8 points: compact (eq 23) */
        {GBT_INIT_GB, 0, 0.0f, 1, 64, 1},         {GBT_INIT_GB, 1, 0.0f, 2, 64, 2},
        {GBT_INIT_GB, 2, 0.0f, 4, 64, 4},         {GBT_INIT_GB, 18, 0.0f, 8, 64, 8},
        {GBT_INIT_GB, 18, 0.125f, 32, 64, 32}, /* never compact: leaves of N_min = 2
                                    points */
        {GBT_INIT_VOXEL, 18, 0.0f, 64, 64, 8},    {GBT_INIT_VOXEL, 18, 100.0f, 1, 1, 1},
        {GBT_INIT_ADAPTIVE, 18, 0.0f, 16, 64, 8}, {GBT_INIT_RANDOM, 18, 0.0f, 16, 64, 8},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        def.init = rows[i].init;
        def.max_depth = rows[i].max_depth;
        def.voxel_size = rows[i].voxel_size;
        gbt_error err = {0};
        if (gbt_init(data, &def, in_folder("out.ply"), in_folder("out.json"), report, &err) != GBT_OK)
            fail_msg("row %zu: %s", i, err.text);
        json_t *value = json_load_file(in_folder("out.json"), 0, NULL);
        assert_non_null(value);
        if (number(value, "anchors") != rows[i].anchors || number(value, "voxel_anchors") != rows[i].voxels)
            fail_msg("row %zu: %g anchors, %g voxels", i, number(value, "anchors"),
                     number(value, "voxel_anchors"));
        assert_true(number(value, "voxel_size") ==
                    (rows[i].voxel_size > 0 ? (double)rows[i].voxel_size : 1.0));
        const double mean = number(json_object_get(value, "points_per_anchor"), "mean");
        assert_true(fabs(mean * rows[i].anchors - 64) < 1e-4); /* every point in one anchor */
        const json_t *quality = json_object_get(value, "quality"), *gb = json_array_get(quality, 0),
                     *adaptive = json_array_get(quality, 1), *voxel = json_array_get(quality, 2);
        assert_int_equal(json_array_size(quality), 3);
        assert_true(number(gb, "anchors") == rows[i].balls && number(adaptive, "anchors") == 16 &&
                    number(voxel, "anchors") <= 16);
        /* 16 sets of 4 in a unit grid: squares, whose corners are sqrt(1/2) from their centre, are the best
           there is. */
        assert_true(number(adaptive, "distance_rms") >= 0.7071 &&
                    number(adaptive, "distance_rms") < number(voxel, "distance_rms"));
        assert_true(number(adaptive, "color_rms") == 0);
        json_decref(value);
        json_t *back = info_as_json(in_folder("out.ply"));
        assert_true(number(back, "points") == rows[i].anchors);
        json_decref(back);
    }
    fclose(report);
}

static void init_writes_world_coordinates(void **state)
{
    (void)state;
    const char *data = write_grid("far.ply", 2, 4e7);
    FILE *report = fopen("/dev/null", "w");
    gbt_init_def def = gbt_init_def_default();
    def.max_depth = 0;
    assert_ok(gbt_init(data, &def, in_folder("out.ply"), NULL, NULL, NULL));
    assert_ok(gbt_init(data, &def, in_folder("out.ply"), NULL, report, NULL));
    fclose(report);
    json_t *back = info_as_json(in_folder("out.ply"));
    for (size_t k = 0; k < 3; k++)
        /* a float there has steps of 4 */
        assert_true(fabs(json_number_value(json_array_get(json_object_get(back, "origin"), k)) -
                         (4e7 + 0.5)) <= 1e-3);
    json_decref(back);
}

static void init_refuses(void **state)
{
    (void)state;
    const char *data = write_grid("cloud.ply", 2, 0.0);
    const gbt_init_def good = gbt_init_def_default();
    enum { BAD = 10 };
    gbt_init_def bad[BAD];
    for (int i = 0; i < BAD; i++)
        bad[i] = good;
    bad[0].init = (gbt_init_kind)4;
    bad[1].scale_prior = (gbt_scale_prior)2;
    bad[2].voxel_rule = (gbt_voxel_rule)2;
    bad[3].voxel_size = -1;
    bad[4].voxel_size = NAN;
    bad[5].max_depth = 65;
    bad[6] = (gbt_init_def){0};
    bad[7].init_count = -0.1;
    bad[8].init_count = 1.5;
    bad[9].voxel_size = 1e10f;
    for (int i = 0; i < BAD; i++) {
        gbt_error err = {0};
        assert_int_equal(gbt_init(data, &bad[i], in_folder("none.ply"), NULL, stdout, &err),
                         GBT_ERR_ARGUMENT);
        assert_int_not_equal(err.text[0], '\0');
        assert_false(file_exists(in_folder("none.ply")));
    }
    gbt_error err = {0};
    assert_int_equal(gbt_init(data, &good, data, NULL, stdout, &err), GBT_ERR_ARGUMENT); /* would overwrite
                                                                                            its input */
    assert_int_equal(gbt_init(data, &good, in_folder("none.ply"), in_folder("none.ply"), stdout, NULL),
                     GBT_ERR_ARGUMENT);
    assert_int_equal(gbt_init(in_folder("none.ply"), &good, in_folder("out.ply"), NULL, stdout, NULL),
                     GBT_ERR_IO);
}

static void init_without_memory(void **state)
{
    (void)state;
    const char *data = write_grid("cloud.ply", 3, 0.0);
    FILE *report = fopen("/dev/null", "w");
    gbt_init_def def = gbt_init_def_default();
    for (int mesh = 0; mesh < 2; mesh++) {
        def.mesh = mesh;
        gbt_status status = GBT_ERR_NO_MEMORY;
        long n = 0;
        for (; n < 500 && status != GBT_OK; n++) {
            gbt_error err = {0};
            mem_fail_after(n);
            status = gbt_init(data, &def, in_folder("out.ply"), in_folder("out.json"), report, &err);
            mem_fail_after(-1);
            if (status != GBT_OK && (status != GBT_ERR_NO_MEMORY || err.text[0] == '\0'))
                fail_msg("allocation %ld: status %d, \"%s\"", n, (int)status, err.text);
        }
        assert_int_equal(status, GBT_OK);
        assert_true(n > 10);
    }
    fclose(report);
}

static void spheres(void **state)
{
    (void)state;
    const float center[6] = {1, 2, 3, -5, 0, 5}, radius[2] = {0.5f, 2.0f}, color[6] = {1, 0, 0, 0, 1, 0};
    ball_mesh mesh;
    assert_ok(ball_mesh_build(center, radius, color, 2, &mesh, NULL));
    assert_int_equal(mesh.vertex_count, 84);
    assert_int_equal(mesh.face_count, 160);
    for (size_t v = 0; v < 84; v++) {
        double length = 0;
        for (size_t k = 0; k < 3; k++)
            length += pow((double)mesh.position[3 * v + k] - (double)center[3 * (v / 42) + k], 2);
        assert_true(fabs(sqrt(length) - (double)radius[v / 42]) < 1e-6);
        assert_memory_equal(mesh.color + 3 * v, color + 3 * (v / 42), 12);
    }
    /* Closed and oriented alike: every directed edge is there once, and so is its reverse. */
    static unsigned char edge[84][84];
    memset(edge, 0, sizeof edge);
    double volume[2] = {0};
    for (size_t f = 0; f < 160; f++) {
        const uint32_t *t = mesh.faces + 3 * f;
        double p[3][3];
        for (size_t k = 0; k < 3; k++) {
            assert_true(t[k] < 84 && t[k] / 42 == f / 80);
            edge[t[k]][t[(k + 1) % 3]]++;
            for (size_t axis = 0; axis < 3; axis++)
                p[k][axis] = (double)mesh.position[3 * t[k] + axis] - (double)center[3 * (f / 80) + axis];
        }
        volume[f / 80] += (p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                           p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                           p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0])) /
                          6;
    }
    int edges = 0;
    for (int a = 0; a < 84; a++)
        for (int b = 0; b < 84; b++) {
            assert_true(edge[a][b] <= 1 && edge[a][b] == edge[b][a]);
            edges += edge[a][b];
        }
    assert_int_equal(edges, 480);
    for (int i = 0; i < 2; i++) { /* positive: seen from outside; a little less than the sphere's */
        const double share = volume[i] / (4.0 / 3.0 * 3.14159265358979 * pow((double)radius[i], 3));
        assert_true(share > 0.85 && share < 1);
    }
    ball_mesh_free(&mesh);
    assert_int_equal(ball_mesh_build(center, radius, color, SIZE_MAX / 8, &mesh, NULL), GBT_ERR_NO_MEMORY);
    assert_null(mesh.position);
}

static void json_of_any_bytes(void **state)
{
    (void)state;
    json_t *value = json_text("a\xff\xfe z");
    assert_string_equal(json_string_value(value), "a\xc3\xbf\xc3\xbe z");
    json_decref(value);
    value = json_text("\xc3\xa4");
    assert_string_equal(json_string_value(value), "\xc3\xa4");
    json_decref(value);
    gbt_error err = {0};
    assert_int_equal(json_print(NULL, stdout, &err), GBT_ERR_NO_MEMORY);
    assert_int_not_equal(err.text[0], '\0');
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(info_of_a_cloud),
        cmocka_unit_test(expectations_hold),
        cmocka_unit_test(info_of_a_model),
        cmocka_unit_test(info_of_photos_with_an_alpha_channel),
        cmocka_unit_test(info_writes_nothing_when_it_fails),
        cmocka_unit_test(init_counts),
        cmocka_unit_test(init_writes_world_coordinates),
        cmocka_unit_test(init_refuses),
        cmocka_unit_test(init_without_memory),
        cmocka_unit_test(spheres),
        cmocka_unit_test(json_of_any_bytes),
    };
    return cmocka_run_group_tests_name("info and init", tests, folder_make, folder_remove);
}
