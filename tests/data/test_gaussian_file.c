/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_gaussian_file.c -- plain Gaussians to .ply, .splat, .spz, .glb and back: what each format
   keeps, its bytes, damaged files. */
#include <jansson.h>
#include <zlib.h>

#include "data/gaussian_file.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_support.h"

static void ply_keeps_everything(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, b;
        make_cloud(&a, 50, degree);
        const double origin[3] = {100, -200, 300};
        assert_ok(gaussian_file_write(in_folder("a.ply"), &a, origin, &assert_ok_err_));
        assert_ok(gaussian_file_read(in_folder("a.ply"), &b, &assert_ok_err_));
        assert_int_equal(b.sh_degree, degree);
        check_near(&a, &b, origin, &(limits){.mean = 2e-5, .quat = 1e-6, .opacity = 1e-6});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
}

/* The mark of a model that is drawn as wide as pixels: as Brush and SuperSplat write it, and as Postshot
 * does. */
static void ply_says_how_it_is_drawn(void **state)
{
    (void)state;
    static const char other[] =
        "ply\nformat ascii 1.0\ncomment antialiased 1\ncomment gbtrace near -1\nelement vertex 1\n"
        "property float x\nproperty float y\nproperty float z\nproperty float f_dc_0\n"
        "property float f_dc_1\nproperty float f_dc_2\nproperty float opacity\n"
        "property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
        "property float rot_0\nproperty float rot_1\nproperty float rot_2\n"
        "property float rot_3\nend_header\n1 2 3 0 0 0 0 0 0 0 1 0 0 0\n";
    for (int marked = 0; marked < 2; marked++) {
        gaussian_cloud a, b;
        make_cloud(&a, 3, 1);
        a.antialiased = marked == 1;
        a.near = 4.90744f * (float)marked;
        assert_ok(gaussian_file_write(in_folder("a.ply"), &a, nowhere, &assert_ok_err_));
        assert_ok(gaussian_file_read(in_folder("a.ply"), &b, &assert_ok_err_));
        assert_int_equal(b.antialiased, marked);
        assert_true(b.near == a.near);
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
    write_text(in_folder("b.ply"), other);
    gaussian_cloud b;
    assert_ok(gaussian_file_read(in_folder("b.ply"), &b, &assert_ok_err_));
    assert_true(b.antialiased && b.near == 0);
    gaussian_cloud_free(&b);
}

/* The near distance, in every format but those that have no place for it; also one that is read and written
   again. */
static void near_distances_are_kept(void **state)
{
    (void)state;
    static const char *const names[] = {"n.ply", "n.compressed.ply", "n.sog",  "n.glb", "n.usda", "n.usdz",
                                        "n.spz", "n.v4.spz",         "n.splat"};
    gaussian_cloud a, b;
    make_cloud(&a, 20, 1);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        for (int said = 0; said < 2; said++) {
            a.near = said == 1 ? 4.90744f : 0;
            assert_ok(gaussian_file_write(in_folder("%s", names[i]), &a, nowhere, &assert_ok_err_));
            assert_ok(gaussian_file_read(in_folder("%s", names[i]), &b, &assert_ok_err_));
            assert_true(b.near == (i < 6 ? a.near : 0));
            gaussian_cloud_free(&b);
        }
    gaussian_cloud_free(&a);
    assert_true(gaussian_cloud_near(0.5) == 0.5f && gaussian_cloud_near(-1) == 0 &&
                gaussian_cloud_near((double)NAN) == 0 && gaussian_cloud_near((double)INFINITY) == 0);
}

static void spz_keeps_its_steps(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, b;
        make_cloud(&a, 300, degree);
        assert_ok(gaussian_file_write(in_folder("a.SPZ"), &a, nowhere, &assert_ok_err_));
        assert_ok(gaussian_file_read(in_folder("a.SPZ"), &b, &assert_ok_err_));
        assert_int_equal(b.sh_degree, degree);
        check_near(&a, &b, nowhere,
                   &(limits){.mean = 0x1p-17 + 1e-6,
                             .scale = 1.0 / 32 + 1e-6,
                             .quat = 1e-5,
                             .opacity = 1.0 / 510 + 1e-6,
                             .color = 0.5 / (0.15 * 255) + 1e-6,
                             .harmonics = 8.5 / 128});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
}

/* The rules are those of every format: scales of 0 are flat, and what is less is left out. */
static void splat_scales(void **state)
{
    (void)state;
    gaussian_cloud a, b;
    make_cloud(&a, 3, 0);
    assert_ok(gaussian_file_write(in_folder("a.splat"), &a, nowhere, &assert_ok_err_));
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("a.splat"), &bytes, &size, &assert_ok_err_));
    const float scales[3][3] = {{1, 0, 2}, {1, -1, 2}, {0, 0, 0}};
    for (size_t i = 0; i < 3; i++)
        memcpy(bytes + 32 * i + 12, scales[i], sizeof scales[i]);
    assert_ok(file_write_atomic(in_folder("a.splat"), bytes, size, &assert_ok_err_));
    mem_free(bytes);
    assert_ok(gaussian_file_read(in_folder("a.splat"), &b, &assert_ok_err_));
    assert_true(b.count == 2 && b.dropped == 1 && b.scales_clamped == 2);
    assert_true(b.scale_log[0] == 0 && b.scale_log[1] < -8 && fabsf(b.scale_log[2] - logf(2)) < 1e-6f);
    gaussian_cloud_free(&a);
    gaussian_cloud_free(&b);
}

/* By rows of the file: the writer sorts them. */
static void splat_keeps_one_color(void **state)
{
    (void)state;
    gaussian_cloud a, b;
    make_cloud(&a, 40, 3);
    for (size_t i = 0; i < a.count; i++) { /* sorted already */
        for (size_t k = 0; k < 3; k++)
            a.scale_log[3 * i + k] = -0.1f * (float)i - 0.01f * (float)k;
        a.opacity[i] = 0.95f - 0.02f * (float)i;
    }
    assert_ok(gaussian_file_write(in_folder("a.splat"), &a, nowhere, &assert_ok_err_));
    assert_ok(gaussian_file_read(in_folder("a.splat"), &b, &assert_ok_err_));
    check_near(&a, &b, nowhere,
               &(limits){.mean = 1e-9,
                         .scale = 1e-6,
                         .quat = 1e-4,
                         .opacity = 1.0 / 510 + 1e-6,
                         .color = 0.5 / (255 * 0.28209479) + 1e-6,
                         .harmonics = 1});
    gaussian_cloud_free(&a);
    gaussian_cloud_free(&b);
    make_cloud(&a, 100, 0);
    assert_ok(gaussian_file_write(in_folder("a.splat"), &a, nowhere, &assert_ok_err_));
    assert_ok(gaussian_file_read(in_folder("a.splat"), &b, &assert_ok_err_));
    double before = INFINITY;
    for (size_t i = 0; i < b.count; i++) { /* opacity is rounded to 1 / 255 */
        const double size =
            exp((double)b.scale_log[3 * i] + (double)b.scale_log[3 * i + 1] + (double)b.scale_log[3 * i + 2]);
        assert_true(size * ((double)b.opacity[i] - 0.5 / 255) <= before * (1 + 1e-5));
        before = size * ((double)b.opacity[i] + 0.5 / 255);
    }
    gaussian_cloud_free(&a);
    gaussian_cloud_free(&b);
}

/* One Gaussian whose bytes follow from the format's description by hand. */
static void spz_bytes(void **state)
{
    (void)state;
    gaussian_cloud a;
    make_cloud(&a, 1, 1);
    const float mean[3] = {1, -2, 64}, scale_log[3] = {-10, 0, -1.5f}, quat[4] = {0.5f, -0.5f, 0.5f, -0.5f};
    memcpy(a.mean, mean, sizeof mean);
    memcpy(a.scale_log, scale_log, sizeof scale_log);
    memcpy(a.quat, quat, sizeof quat);
    a.opacity[0] = 0.6f;
    memset(a.sh, 0, 48 * sizeof *a.sh);
    a.sh[0] = 1;
    a.sh[1] = -1;
    a.sh[3] = 0.25f;
    a.sh[11] = -0.5f;
    assert_ok(gaussian_file_write(in_folder("one.spz"), &a, nowhere, &assert_ok_err_));
    gaussian_cloud_free(&a);
    gzFile zipped = gzopen(in_folder("one.spz"), "rb");
    unsigned char got[64];
    assert_int_equal(gzread(zipped, got, sizeof got), 16 + 9 + 1 + 3 + 3 + 4 + 9);
    gzclose(zipped);
    /* 64 2^16 is the largest power that fits: 16 fractional bits. */
    static const unsigned char want[] = {'N', 'G', 'S', 'P', 3,   0,   0,   0,   1,    0, 0, 0,    1,
                                         16,  0,   0,   0,   0,   1,   0,   0,   0xfe, 0, 0, 0x40, /* 1, -2,
                                                                                                      64 */
                                         153,              /* 0.6 255 */
                                         166, 89,  128,    /* 38.25 c + 127.5, ties to even */
                                         0,   160, 136,    /* 16 (l + 10) */
                                         0,   0,   0,   0, /* the rotation: below */
                                         160, 128, 128, 128, 128, 128, 128, 128, 64};
    unsigned char expected[sizeof want];
    memcpy(expected, want, sizeof want);
    /* x y z w = -.5 .5 -.5 .5: x is the first of the largest, left out and made positive, so the others
       change signs; 361 = 511 sqrt(2) / 2. */
    const uint32_t rotation = 0u << 30 | (1u << 9 | 361u) << 20 | (0u << 9 | 361u) << 10 | (1u << 9 | 361u);
    for (int k = 0; k < 4; k++)
        expected[32 + k] = (unsigned char)(rotation >> (8 * k));
    for (size_t k = 0; k < sizeof want; k++)
        if (got[k] != expected[k])
            fail_msg("byte %zu: %u (wanted %u)", k, got[k], expected[k]);
    assert_ok(gaussian_file_read(in_folder("one.spz"), &a, &assert_ok_err_)); /* these have bytes of
                                                                                         their own */
    assert_memory_equal(a.mean, mean, sizeof mean);
    assert_true(a.scale_log[1] == 0 && a.scale_log[2] == -1.5f); /* the first is raised: a needle */
    for (int k = 3; k < 12; k++)
        assert_true(a.sh[k] == (k == 3 ? 0.25f : k == 11 ? -0.5f : 0));
    gaussian_cloud_free(&a);
}

static void glb_round_trip(void **state)
{
    (void)state;
    const double origin[3] = {4.5e6, -3, 0.25};
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, b;
        make_cloud(&a, 100, degree);
        assert_ok(gaussian_file_write(in_folder("r.glb"), &a, origin, &assert_ok_err_));
        assert_ok(gaussian_file_read(in_folder("r.glb"), &b, &assert_ok_err_));
        assert_int_equal(b.sh_degree, degree);
        for (int k = 0; k < 3; k++)
            assert_true(b.origin[k] == origin[k]);
        check_near(&a, &b, origin, &(limits){.mean = 1e-8, .scale = 1e-6, .quat = 1e-6, .opacity = 1e-7});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
}

/* Words of a file's JSON, replaced by others of the same length: what each of them is answered by. */
static void glb_that_is_wrong(void **state)
{
    (void)state;
    static const struct {
        const char *before, *after, *wanted;
    } rows[] = {
        {"glTF\2", "glTF\1", "not binary glTF 2.0"},
        {"\"KHR_gaussian_splatting\":{", "\"KHR_gaussian_splattinx\":{", "no primitive"},
        {"srgb_rec709_display", "lin0_rec709_display", "another space"},
        {"\"colorSpace\":\"srgb_rec709_display\"", "\"extensions\":{\"KHR_compressed\":{}}", "compressed"},
        {"\"translation\":", "\"translation\" ", "glTF:1: not usable JSON"},
        {"translation\":", "scale\":      ", "matrix, rotation or scale"},
        {"\"POSITION\"", "\"POSITIOM\"", "POSITION is missing"},
        {"\"count\":20", "\"count\":21", "wanted 21"},
        {"\"buffer\":0", "\"buffer\":1", "POSITION: its values are not in the binary chunk"},
        {"\"componentType\":5126", "\"componentType\":5125", "POSITION: wanted VEC3"}};
    gaussian_cloud a, b;
    make_cloud(&a, 20, 1);
    assert_ok(gaussian_file_write(in_folder("w.glb"), &a, nowhere, &assert_ok_err_));
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("w.glb"), &bytes, &size, &assert_ok_err_));
    const source_file file = {"w.glb", bytes, size};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        const size_t length = strlen(rows[r].before);
        unsigned char *at = memmem(bytes, size, rows[r].before, length);
        assert_non_null(at);
        assert_int_equal(strlen(rows[r].after), length);
        memcpy(at, rows[r].after, length);
        gbt_error said = {0};
        assert_int_equal(gaussian_format_glb.read(&file, &b, &said), GBT_ERR_FORMAT);
        if (strstr(said.text, rows[r].wanted) == NULL)
            fail_msg("%s: %s", rows[r].after, said.text);
        memcpy(at, rows[r].before, length);
    }
    mem_free(bytes);
    gaussian_cloud_free(&a);
}

/* Read a .glb with another JSON, and keep what is said in `warned`. */
static gbt_status read_changed(const source_file *file, const json_t *root, gaussian_cloud *out,
                               char warned[256], gbt_error *err)
{
    cursor c = {.file = file, .at = 12};
    const size_t length = cursor_u32(&c);
    char *text = json_dumps(root, 0);
    sink s = {0};
    sink_put(&s, file->bytes, 12);
    sink_put_uint(&s, strlen(text), 4);
    sink_put(&s, "JSON", 4);
    sink_put(&s, text, strlen(text));
    sink_put(&s, file->bytes + 20 + length, file->size - 20 - length);
    const source_file changed = {file->name, s.bytes, s.size};
    warned[0] = '\0';
    gbt_listen(keep_warning, warned);
    const gbt_status status = gaussian_format_glb.read(&changed, out, err);
    gbt_listen(NULL, NULL);
    sink_free(&s);
    free(text);
    return status;
}

/* Nodes beside the Gaussians' own, and those that they are in. */
static void glb_nodes_of_others(void **state)
{
    (void)state;
    static const char own[] = "{\"mesh\":0,\"translation\":[1,2,3]}";
    static const struct {
        const char *other;
        bool is_read;
    } rows[] = {{"{\"camera\":0,\"translation\":[4,5,6],\"rotation\":[0,1,0,0]}", true},
                {"{\"children\":[0],\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}", true},
                {"{\"children\":[0],\"rotation\":[0,0,0,1],\"scale\":[1,1,1],\"translation\":[0,0,0]}", true},
                {"{\"children\":[0],\"translation\":[0,0,1]}", false},
                {"{\"children\":[0],\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1]}", false},
                {"{\"children\":[0],\"rotation\":[0,1,0,0]}", false},
                {"{\"children\":[0],\"scale\":[1,1,2]}", false},
                /* Of three nodes: beside the Gaussians, and above them. */
                {"{\"children\":[2],\"rotation\":[0,1,0,0]},{\"camera\":0}", true},
                {"{\"children\":[0]},{\"children\":[1],\"rotation\":[0,1,0,0]}", false},
                {"{\"children\":[2,-1,7,\"0\"]},{\"children\":[1],\"scale\":[2,2,2]}", true},
                {"{\"children\":[0,2]},{\"children\":[1]}", true}};
    gaussian_cloud a, b;
    make_cloud(&a, 5, 0);
    assert_ok(gaussian_file_write(in_folder("n.glb"), &a, nowhere, &assert_ok_err_));
    gaussian_cloud_free(&a);
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("n.glb"), &bytes, &size, &assert_ok_err_));
    const source_file file = {"n.glb", bytes, size};
    cursor c = {.file = &file, .at = 12};
    const size_t length = cursor_u32(&c);
    json_t *root = json_loadb((const char *)bytes + 20, length, 0, NULL);
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        char nodes[512], warned[256];
        snprintf(nodes, sizeof nodes, "[%s,%s]", own, rows[r].other);
        json_object_set_new(root, "nodes", json_loads(nodes, 0, NULL));
        gbt_error said = {0};
        const gbt_status status = read_changed(&file, root, &b, warned, &said);
        assert_string_equal(warned, "");
        if (status != (rows[r].is_read ? GBT_OK : GBT_ERR_FORMAT))
            fail_msg("%s: %s", rows[r].other, said.text);
        assert_true(status == GBT_OK ? b.origin[0] == -1 && b.origin[1] == -2 && b.origin[2] == 3
                                     : strstr(said.text, "or a parent a translation") != NULL);
        gaussian_cloud_free(&b);
    }
    json_decref(root);
    mem_free(bytes);
}

/* A mesh of twice the same primitive, and that mesh once more; a mesh in several nodes, of which others than
   the first may be turned, or in one that is scaled. */
static void glb_of_several(void **state)
{
    (void)state;
    static const char first[] = "{\"mesh\":0,\"translation\":[1,2,3]}";
    static const struct {
        const char *others, *says;
    } rows[] = {
        {"{\"mesh\":0,\"translation\":[7,8,9],\"rotation\":[0,1,0,0]}", "first of 2 nodes of the Gaussians'"},
        {"{\"mesh\":0},{\"children\":[1],\"scale\":[2,2,2]},{\"mesh\":0}",
         "first of 3 nodes of the Gaussians'"},
        {"{\"mesh\":1}", "first of 4 primitives of Gaussians"}};
    gaussian_cloud a, b;
    make_cloud(&a, 5, 0);
    assert_ok(gaussian_file_write(in_folder("p.glb"), &a, nowhere, &assert_ok_err_));
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("p.glb"), &bytes, &size, &assert_ok_err_));
    const source_file file = {"p.glb", bytes, size};
    cursor c = {.file = &file, .at = 12};
    const size_t length = cursor_u32(&c);
    json_t *root = json_loadb((const char *)bytes + 20, length, 0, NULL),
           *meshes = json_object_get(root, "meshes"),
           *primitives = json_object_get(json_array_get(meshes, 0), "primitives");
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        char nodes[256], warned[256];
        snprintf(nodes, sizeof nodes, "[%s,%s]", first, rows[r].others);
        json_object_set_new(root, "nodes", json_loads(nodes, 0, NULL));
        if (r == 2) {
            json_array_append_new(primitives, json_deep_copy(json_array_get(primitives, 0)));
            json_array_append_new(meshes, json_deep_copy(json_array_get(meshes, 0)));
        }
        assert_ok(read_changed(&file, root, &b, warned, &assert_ok_err_));
        if (strstr(warned, rows[r].says) == NULL)
            fail_msg("%s: %s", rows[r].says, warned);
        const double origin[3] = {-1, -2, 3};
        check_near(&a, &b, origin, &(limits){.mean = 1e-8, .scale = 1e-6, .quat = 1e-6, .opacity = 1e-7});
        gaussian_cloud_free(&b);
    }
    json_decref(root);
    mem_free(bytes);
    gaussian_cloud_free(&a);
}

static void glb_is_what_gltf_wants(void **state)
{
    (void)state;
    gaussian_cloud a;
    make_cloud(&a, 33, 2);
    const double origin[3] = {691234.0625, 5334567.123, -0.1};
    assert_ok(gaussian_file_write(in_folder("a.glb"), &a, origin, &assert_ok_err_));
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("a.glb"), &bytes, &size, &assert_ok_err_));
    const source_file file = {"a.glb", bytes, size};
    cursor c = {.file = &file};
    assert_int_equal(cursor_u32(&c), 0x46546C67);
    assert_int_equal(cursor_u32(&c), 2);
    assert_int_equal(cursor_u32(&c), size);
    const size_t json_size = cursor_u32(&c);
    assert_int_equal(cursor_u32(&c), 0x4E4F534A);
    assert_int_equal(json_size % 4, 0);
    json_t *root = json_loadb((const char *)bytes + c.at, json_size, 0, NULL);
    assert_non_null(root);
    const size_t data_at = c.at + json_size + 8;
    json_t *primitive =
        json_array_get(json_object_get(json_array_get(json_object_get(root, "meshes"), 0), "primitives"), 0);
    json_t *attributes = json_object_get(primitive, "attributes"),
           *accessors = json_object_get(root, "accessors"), *views = json_object_get(root, "bufferViews");
    assert_int_equal(json_object_size(attributes), 1 + 1 + 3 + 9);
    assert_int_equal(json_integer_value(
                         json_object_get(json_array_get(json_object_get(root, "buffers"), 0), "byteLength")),
                     size - data_at);
    json_t *position =
        json_array_get(accessors, (size_t)json_integer_value(json_object_get(attributes, "POSITION")));
    double low = INFINITY;
    for (size_t i = 0; i < a.count; i++)
        low = fmin(low, -(double)a.mean[3 * i]);
    assert_true(fabs(json_number_value(json_array_get(json_object_get(position, "min"), 0)) - low) < 1e-12);
    /* The origin is the node's place, with all its digits. */
    json_t *place = json_object_get(json_array_get(json_object_get(root, "nodes"), 0), "translation");
    for (size_t k = 0; k < 3; k++)
        assert_true(json_number_value(json_array_get(place, k)) == (k < 2 ? -origin[k] : origin[k]));
    /* The last value of the last accessor, and the quaternion of the first Gaussian. */
    json_t *last = json_array_get(views, json_array_size(views) - 1);
    assert_int_equal(json_integer_value(json_object_get(last, "byteOffset")) +
                         json_integer_value(json_object_get(last, "byteLength")),
                     size - data_at);
    float value, quat[4];
    memcpy(&value, bytes + size - 4, 4);
    assert_true(value == a.sh[48 * 32 + 3 * 8 + 2]); /* function 8: even, keeps its sign */
    json_t *rotation = json_array_get(accessors, (size_t)json_integer_value(json_object_get(
                                                     attributes, "KHR_gaussian_splatting:ROTATION")));
    json_t *view = json_array_get(views, (size_t)json_integer_value(json_object_get(rotation, "bufferView")));
    memcpy(quat, bytes + data_at + (size_t)json_integer_value(json_object_get(view, "byteOffset")),
           sizeof quat);
    const float want[4] = {-a.quat[1], -a.quat[2], a.quat[3], a.quat[0]};
    for (int k = 0; k < 4; k++)
        assert_true(fabsf(quat[k] - want[k]) < 1e-6f);
    /* Half a turn about z: places, and the odd functions of degrees 1 and 2. */
    static const char *const names[] = {"POSITION", "KHR_gaussian_splatting:SH_DEGREE_1_COEF_0",
                                        "KHR_gaussian_splatting:SH_DEGREE_1_COEF_1",
                                        "KHR_gaussian_splatting:SH_DEGREE_2_COEF_3"};
    static const size_t function[] = {0, 1, 2, 7};
    for (int n = 0; n < 4; n++) {
        json_t *accessor =
            json_array_get(accessors, (size_t)json_integer_value(json_object_get(attributes, names[n])));
        json_t *part =
            json_array_get(views, (size_t)json_integer_value(json_object_get(accessor, "bufferView")));
        const unsigned char *at =
            bytes + data_at + (size_t)json_integer_value(json_object_get(part, "byteOffset"));
        for (size_t i = 0; i < 3 * a.count; i++, at += 4) {
            const float stored = n == 0 ? a.mean[i] : a.sh[(i / 3 * 16 + function[n]) * 3 + i % 3];
            const bool turns = n == 0 ? i % 3 < 2 : function[n] % 2 == 1;
            memcpy(&value, at, 4);
            assert_true(value == (turns ? -stored : stored));
        }
    }
    json_decref(root);
    mem_free(bytes);
    gaussian_cloud_free(&a);
}

static void refusals(void **state)
{
    (void)state;
    gaussian_cloud cloud;
    gbt_error err = {0};
    assert_int_equal(gaussian_file_read("scene.obj", &cloud, &err), GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "scene.obj: cannot be read as Gaussians"));
    err = (gbt_error){0};
    assert_int_equal(gaussian_file_check_writable("scene", &err), GBT_ERR_ARGUMENT);
    assert_non_null(
        strstr(err.text, "wanted .ply, .compressed.ply, .splat, .spz, .v4.spz, .sog, .glb, .usda or .usdz"));
    err = (gbt_error){0};
    const source_file five = {"v5.spz", (const unsigned char *)"NGSP\5\0\0\0xxxxxxxxxxxxxxxxxxxxxxxx", 32};
    assert_int_equal(gaussian_format_spz.read(&five, &cloud, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "version 5"));
    err = (gbt_error){0};
    /* The size is checked before more than four bytes are read. */
    const source_file large = {"large.spz", (const unsigned char *)"\x1f\x8b\b", (size_t)1 << 31};
    assert_int_equal(gaussian_format_spz.read(&large, &cloud, &err), GBT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "2147483648 bytes (wanted less than 2 GiB)"));
    make_cloud(&cloud, 1, 0);
    err = (gbt_error){0};
    assert_int_equal(gaussian_file_write(in_folder("far.spz"), &cloud, (const double[3]){1e7, 0, 0}, &err),
                     GBT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "does not fit"));
    assert_false(file_exists(in_folder("far.spz")));
    gaussian_cloud_free(&cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(ply_keeps_everything, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(ply_says_how_it_is_drawn, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(near_distances_are_kept, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(spz_keeps_its_steps, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(splat_scales, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(splat_keeps_one_color, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(spz_bytes, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(glb_round_trip, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(glb_that_is_wrong, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(glb_nodes_of_others, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(glb_of_several, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(glb_is_what_gltf_wants, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(refusals, folder_make, folder_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
