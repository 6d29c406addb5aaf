/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_gaussian_packed.c -- plain Gaussians in small files and back: what each format keeps, its
   bytes, damaged files. */
#include <zlib.h>

#include "data/archive.h"
#include "data/gaussian_file.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_order.h"
#include "data/gaussian_support.h"
#include "data/palette.h"
#include "data/spz_streams.h"

/* Write, read, and bring back into order. */
static void there_and_back(const char *path, const gaussian_cloud *a, const double origin[3],
                           gaussian_cloud *b)
{
    assert_ok(gaussian_file_write(path, a, origin, &assert_ok_err_));
    assert_true(gaussian_file_has_gaussians(path));
    assert_ok(gaussian_file_read(path, b, &assert_ok_err_));
    match_order(a, b, origin);
    assert_int_equal(b->sh_degree, a->sh_degree);
    assert_int_equal(b->antialiased, a->antialiased);
}

/* 600 Gaussians are two chunks and a part of one. */
static void compressed_ply_keeps_its_steps(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, b;
        make_cloud(&a, 600, degree);
        a.antialiased = degree % 2 == 1;
        const double origin[3] = {100, -200, 300};
        there_and_back(in_folder("a.Compressed.PLY"), &a, origin, &b);
        check_near(&a, &b, origin,
                   &(limits){.mean = 20.0 / 1023 + 1e-4,
                             .scale = 3.0 / 1023 + 1e-5,
                             .quat = 3e-6,
                             .opacity = 0.5 / 255 + 1e-6,
                             .color = 0.9 / 255 + 1e-6,
                             .harmonics = 1.0 / 64 + 1e-6});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
}

static void spz4_keeps_the_values_of_spz(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, three, four;
        make_cloud(&a, 300, degree);
        a.antialiased = degree % 2 == 1;
        const double origin[3] = {100, -200, 300};
        assert_ok(gaussian_file_write(in_folder("a.spz"), &a, origin, &assert_ok_err_));
        assert_ok(gaussian_file_write(in_folder("a.v4.spz"), &a, origin, &assert_ok_err_));
        assert_ok(gaussian_file_read(in_folder("a.spz"), &three, &assert_ok_err_));
        assert_ok(gaussian_file_read(in_folder("a.v4.spz"), &four, &assert_ok_err_));
        assert_true(three.antialiased == a.antialiased && four.antialiased == a.antialiased);
        assert_int_equal(four.sh_degree, degree);
        check_near(&three, &four, nowhere, &(limits){.quat = 1e-7});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&three);
        gaussian_cloud_free(&four);
    }
}

/* `from` with a record behind its streams, as other programs may write it, zipped again. */
static void put_extension(const char *from, const char *to, unsigned char flags, unsigned char damage)
{
    enum { ROOM = 1 << 16 };
    static const unsigned char record[12] = {2, 0, 0xbe, 0xad, 4, 0, 0, 0, 1, 2, 3, 4};
    static unsigned char plain[ROOM], zipped[ROOM];
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(from, &bytes, &size, &assert_ok_err_));
    z_stream in = {.next_in = bytes, .avail_in = (uInt)size, .next_out = plain, .avail_out = ROOM - 12};
    assert_int_equal(inflateInit2(&in, 15 + 16), Z_OK);
    assert_int_equal(inflate(&in, Z_FINISH), Z_STREAM_END);
    plain[14] |= flags;
    memcpy(plain + in.total_out, record, sizeof record);
    z_stream out = {.next_in = plain,
                    .avail_in = (uInt)in.total_out + sizeof record,
                    .next_out = zipped,
                    .avail_out = ROOM};
    assert_int_equal(deflateInit2(&out, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
    assert_int_equal(deflate(&out, Z_FINISH), Z_STREAM_END);
    zipped[out.total_out - 8] ^= damage; /* of the checksum */
    assert_ok(file_write_atomic(to, zipped, out.total_out, &assert_ok_err_));
    inflateEnd(&in);
    deflateEnd(&out);
    mem_free(bytes);
}

static void spz_with_extensions(void **state)
{
    (void)state;
    gaussian_cloud a, plain, more;
    make_cloud(&a, 300, 2);
    const char *from = in_folder("a.spz"), *to = in_folder("b.spz");
    assert_ok(gaussian_file_write(from, &a, nowhere, &assert_ok_err_));
    assert_ok(gaussian_file_read(from, &plain, &assert_ok_err_));
    put_extension(from, to, SPZ_EXTENSIONS, 0);
    assert_ok(gaussian_file_read(to, &more, &assert_ok_err_));
    check_near(&plain, &more, nowhere, &(limits){.quat = 1e-7});
    gaussian_cloud_free(&more);
    put_extension(from, to, SPZ_EXTENSIONS, 1);
    assert_int_equal(gaussian_file_read(to, &more, NULL), GBT_ERR_FORMAT);
    put_extension(from, to, 0, 0); /* more than it says */
    assert_int_equal(gaussian_file_read(to, &more, NULL), GBT_ERR_FORMAT);
    gaussian_cloud_free(&plain);
    gaussian_cloud_free(&a);
}

/* Two Gaussians of version 4 whose harmonics are all 128 + their number. */
static void spz4_of_degree_4(void **state)
{
    (void)state;
    unsigned char streams[2 * (9 + 1 + 3 + 3 + 4 + 72)] = {0}, *harmonics = streams + 2 * 20;
    for (int i = 0; i < 2 * 72; i++)
        harmonics[i] = (unsigned char)(128 + i % 72);
    spz_header header = {.version = 4, .count = 2, .degree = 4, .fraction = 12};
    gaussian_cloud c = {0};
    assert_ok(spz_header_check(&header, "a", &assert_ok_err_));
    assert_ok(spz_unpack(streams, &header, &c, &assert_ok_err_));
    assert_int_equal(c.sh_degree, 3);
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 45; k++)
            assert_true(c.sh[48 * i + 3 + k] == (float)k / 128);
    gaussian_cloud_free(&c);
    header.version = 3;
    assert_int_equal(spz_header_check(&header, "a", NULL), GBT_ERR_FORMAT);
}

/* Flat ones are drawn alike; large and tiny ones are not. */
static void spz_tells_scales_that_it_has_not(void **state)
{
    (void)state;
    static const struct {
        float scale_log[3];
        bool is_told;
    } rows[] = {{{7, 7, 7}, true}, {{-3, 7, -3}, true}, {{-3, -3, -13}, false}, {{-13, -11, -12}, true}};
    static const char *const names[] = {"a.spz", "a.v4.spz"};
    for (size_t r = 0; r < 2 * sizeof rows / sizeof *rows; r++) {
        char said[256] = "";
        gaussian_cloud a;
        make_cloud(&a, 3, 0);
        memcpy(a.scale_log + 3, rows[r / 2].scale_log, sizeof rows->scale_log);
        gbt_listen(keep_warning, said);
        assert_ok(gaussian_file_write(in_folder("%s", names[r % 2]), &a, nowhere, &assert_ok_err_));
        gbt_listen(NULL, NULL);
        gaussian_cloud_free(&a);
        if ((strstr(said, "whose scale is clamped: 1 (") != NULL) != rows[r / 2].is_told)
            fail_msg("%zu: %s", r, said);
    }
}

/* The header and the table, which are not packed: 300 Gaussians of degree 1. */
static void spz4_bytes(void **state)
{
    (void)state;
    gaussian_cloud a;
    make_cloud(&a, 300, 1);
    a.antialiased = true;
    a.mean[0] = 64;
    assert_ok(gaussian_file_write(in_folder("a.v4.spz"), &a, nowhere, &assert_ok_err_));
    gaussian_cloud_free(&a);
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("a.v4.spz"), &bytes, &size, &assert_ok_err_));
    static const unsigned char want[32] = {'N', 'G', 'S', 'P', 4, 0, 0,  0, 300 & 255, 300 >> 8,
                                           0,   0,   1,   16,  1, 6, 32, 0, 0,         0};
    assert_memory_equal(bytes, want, sizeof want);
    const source_file file = {"a", bytes, size};
    cursor c = {.file = &file, .at = 32};
    uint64_t packed = 32 + 6 * 16;
    static const uint64_t row[6] = {9, 1, 3, 3, 4, 9};
    for (int i = 0; i < 6; i++) {
        packed += cursor_u64(&c);
        assert_int_equal(cursor_u64(&c), 300 * row[i]);
    }
    assert_int_equal(packed, size);
    /* Every frame of zstd begins so. */
    assert_int_equal(cursor_u32(&c), 0xFD2FB528);
    mem_free(bytes);
}

/* A palette of 1024 entries holds all harmonics of 600. */
static void sog_keeps_its_steps(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, b;
        make_cloud(&a, 600, degree);
        a.antialiased = degree % 2 == 1;
        const double origin[3] = {1, -2, 3};
        there_and_back(in_folder("a.sog"), &a, origin, &b);
        check_near(&a, &b, origin,
                   &(limits){.mean = 24 * 2 * log(24) / 65535,
                             .scale = 6.0 / 256,
                             .quat = 5e-5,
                             .opacity = 0.5 / 255 + 1e-6,
                             .color = 1.8 / 256,
                             .harmonics = 1.8 / 256});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
}

/* Of 8000 Gaussians with 300 colours each has its own entry: cells are cut until nothing differs. */
static void sog_palette_is_exact(void **state)
{
    (void)state;
    gaussian_cloud a, b;
    make_cloud(&a, 8000, 3);
    for (size_t i = 300; i < a.count; i++)
        memcpy(a.sh + 48 * i, a.sh + 48 * (i % 300), 48 * sizeof(float));
    for (size_t i = 0; i < 48 * a.count; i++)
        a.sh[i] = roundf(a.sh[i] * 20) / 20;
    assert_ok(gaussian_file_write(in_folder("a.sog"), &a, nowhere, &assert_ok_err_));
    assert_ok(gaussian_file_read(in_folder("a.sog"), &b, &assert_ok_err_));
    uint32_t *order = gaussian_order(&a, NULL);
    for (size_t i = 0; i < a.count; i++)
        for (size_t k = 0; k < 48; k++)
            assert_true(fabsf(a.sh[48 * order[i] + k] - b.sh[48 * i + k]) < 1e-5f);
    mem_free(order);
    gaussian_cloud_free(&a);
    gaussian_cloud_free(&b);
}

/* Levels beat equal steps where values crowd, and are exact for few values. */
static void levels_follow_the_values(void **state)
{
    (void)state;
    enum { COUNT = 5000 };
    static float values[COUNT];
    float levels[PALETTE_LEVELS];
    double error = 0, equal = 0;
    for (size_t i = 0; i < COUNT; i++)
        values[i] = (float)pow(rng_normal(3, 1, i), 3);
    float low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < COUNT; i++) {
        low = fminf(low, values[i]);
        high = fmaxf(high, values[i]);
    }
    assert_ok(palette_scalar_levels(values, COUNT, levels, &assert_ok_err_));
    const double step = ((double)high - (double)low) / 255;
    for (size_t i = 0; i < COUNT; i++) {
        const unsigned char k = palette_nearest(levels, values[i]);
        const double d = (double)values[i] - (double)levels[k], from = (double)values[i] - (double)low;
        for (int j = 0; j < PALETTE_LEVELS; j++)
            assert_true(fabs(d) <= fabs((double)values[i] - (double)levels[j]));
        error += d * d;
        equal += pow(from - step * nearbyint(from / step), 2);
    }
    if (error > 0.2 * equal)
        fail_msg("%g of equal steps", error / equal);
    for (size_t i = 0; i < COUNT; i++)
        values[i] = (float)(i % 7);
    assert_ok(palette_scalar_levels(values, COUNT, levels, &assert_ok_err_));
    for (size_t i = 0; i < COUNT; i++)
        assert_true(fabsf(levels[palette_nearest(levels, values[i])] - values[i]) < 1e-6f);
}

/* An entry is the mean of its vectors, and a larger palette is nearer. */
static void palette_entries_are_means(void **state)
{
    (void)state;
    enum { COUNT = 2000, WIDTH = 9 };
    static float vectors[COUNT * WIDTH];
    double before = INFINITY;
    for (size_t i = 0; i < COUNT * WIDTH; i++)
        vectors[i] = (float)rng_normal(4, i % WIDTH, i / WIDTH) * (float)(1 + i % WIDTH);
    for (size_t limit = 1; limit <= 4096; limit *= 8) {
        palette p;
        assert_ok(palette_make(vectors, COUNT, WIDTH, limit, &p, &assert_ok_err_));
        assert_int_equal(p.count, limit < COUNT ? limit : COUNT);
        double error = 0;
        for (size_t e = 0; e < p.count; e++)
            for (size_t k = 0; k < WIDTH; k++) {
                double sum = 0, members = 0;
                for (size_t i = 0; i < COUNT; i++)
                    if (p.labels[i] == e) {
                        members++;
                        sum += (double)vectors[i * WIDTH + k];
                        error += pow((double)vectors[i * WIDTH + k] - (double)p.entries[e * WIDTH + k], 2);
                    }
                assert_true(members > 0 && fabs(sum / members - (double)p.entries[e * WIDTH + k]) < 1e-5);
            }
        assert_true(error < 0.9 * before);
        before = error;
        palette_free(&p);
    }
    assert_true(before < 1e-6);
}

/* A sky of Gaussians far outside costs those inside no precision: they share no chunk but one. */
static void far_ones_are_apart(void **state)
{
    (void)state;
    gaussian_cloud a;
    make_cloud(&a, 2000, 0);
    for (size_t i = 0; i < 300; i++)
        for (size_t k = 0; k < 3; k++)
            a.mean[3 * (6 * i) + k] *= 1000;
    gbt_error err = {0};
    uint32_t *order = gaussian_order(&a, &err);
    assert_non_null(order);
    unsigned char *seen = calloc(a.count, 1);
    for (size_t i = 0; i < a.count; i++) {
        assert_false(seen[order[i]]);
        seen[order[i]] = 1;
        assert_true((order[i] % 6 == 0 && order[i] < 1800) == (i >= 1700));
    }
    free(seen);
    mem_free(order);
    gaussian_cloud_free(&a);
}

/* One Gaussian whose words follow from the format's description by hand: every range is empty, so all shares
   are 0 but those of rotation and opacity. */
static void compressed_ply_bytes(void **state)
{
    (void)state;
    gaussian_cloud a;
    make_cloud(&a, 1, 0);
    const float quat[4] = {0.5f, -0.5f, 0.5f, -0.5f};
    memcpy(a.quat, quat, sizeof quat);
    a.opacity[0] = 0.6f;
    assert_ok(gaussian_file_write(in_folder("one.compressed.ply"), &a, nowhere, &assert_ok_err_));
    gaussian_cloud_free(&a);
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("one.compressed.ply"), &bytes, &size, &assert_ok_err_));
    /* w is left out; 1023 (1/2 + 1/2 c sqrt 2) of the others, which are -1/2 1/2 -1/2. */
    const uint32_t low = 150, high = 873;
    const uint32_t words[4] = {0, 0u << 30 | low << 20 | high << 10 | low, 0, 153};
    for (size_t k = 0; k < 16; k++)
        assert_int_equal(bytes[size - 16 + k], words[k / 4] >> 8 * (k % 4) & 255);
    mem_free(bytes);
}

/* Files before colours had a range: 0 to 1. */
static void older_compressed_ply(void **state)
{
    (void)state;
    static const char text[] =
        "ply\nformat ascii 1.0\nelement chunk 1\nproperty float min_x\nproperty float min_y\nproperty float "
        "min_z\n"
        "property float max_x\nproperty float max_y\nproperty float max_z\nproperty float min_scale_x\n"
        "property float min_scale_y\nproperty float min_scale_z\nproperty float max_scale_x\n"
        "property float max_scale_y\nproperty float max_scale_z\nelement vertex 1\nproperty uint "
        "packed_position\n"
        "property uint packed_rotation\nproperty uint packed_scale\nproperty uint packed_color\nend_header\n"
        "-1 0 2 1 4 3 -5 -5 -5 -1 -1 -1\n4294967295 537395712 0 4278190335\n";
    const source_file file = {"old.ply", (const unsigned char *)text, sizeof text - 1};
    gaussian_cloud c;
    assert_ok(gaussian_format_ply.read(&file, &c, &assert_ok_err_));
    const float mean[3] = {1, 4, 3};
    for (int k = 0; k < 3; k++) {
        assert_true(fabsf(c.mean[k] - mean[k]) < 1e-6f);
        assert_true(fabsf(c.scale_log[k] + 5) < 1e-6f);
        assert_true(fabsf(c.sh[k] - (k == 0 ? 0.5f : -0.5f) / 0.28209479f) < 1e-5f);
    }
    assert_true(c.opacity[0] == 1 && c.quat[0] > 0.999f);
    gaussian_cloud_free(&c);
}

/* A .usda with one Gaussian as another program may write it. */
static const char usda[] =
    "#usda 1.0\n(\n    \"\"\"Made { by = hand\"\"\"\n    upAxis = \"Y\"\n)\n# def "
    "ParticleField3DGaussianSplat\n"
    "def Xform \"World\" (kind = \"group\")\n{\n"
    "  def ParticleField3DGaussianSplat \"one\" (\n    displayName = \"}\"\n  )\n  {\n"
    "    uniform token colorSpace:name = 'srgb_rec709_display'\n"
    "    half[] opacitiesh = [0.5]\n    custom string note = \"positions = [1]\"\n"
    "    point3f[] positions = [(1, 2.5e0,\n 3)] (interpolation = \"vertex\")\n"
    "    quatf[] orientations = [(0, 2, 0, 0)]\n    float[] opacities = [0.25]\n    float[] other = [7]\n"
    "    float3[] scales = [(1, 2, 4)]\n    uniform int radiance:sphericalHarmonicsDegree = 1\n"
    "    float3[] radiance:sphericalHarmonicsCoefficients = [(1, 2, 3), (4, 5, 6), (7, 8, 9), (10, 11, 12)] "
    "(\n"
    "        elementSize = 4\n    )\n    def Scope \"inner\" {\n float[] positions = [9]\n }\n"
    "    double3 xformOp:translate = (10, 20, 30)\n    float xformOp:rotateZ = 180.0\n"
    "    float3 xformOp:scale = (2, 2, 2)\n    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n"
    "  }\n}\n";

static gbt_status read_text(const char *text, gaussian_cloud *out, gbt_error *err)
{
    const source_file file = {"a.usda", (const unsigned char *)text, strlen(text)};
    return gaussian_format_usda.read(&file, out, err);
}

static void usda_of_others(void **state)
{
    (void)state;
    gaussian_cloud c;
    assert_ok(read_text(usda, &c, &assert_ok_err_));
    const float mean[3] = {1, 2.5f, 3};
    assert_int_equal(c.count, 1);
    assert_int_equal(c.sh_degree, 1);
    for (int k = 0; k < 3; k++) {
        assert_true(c.mean[k] == mean[k] && c.origin[k] == 10 * (k + 1));
        assert_true(fabsf(c.scale_log[k] - (float)k * logf(2)) < 1e-6f);
    }
    for (int k = 0; k < 48; k++)
        assert_true(c.sh[k] == (k < 12 ? (float)(k + 1) : 0));
    assert_true(c.opacity[0] == 0.25f && c.quat[1] == 1);
    gaussian_cloud_free(&c);
}

/* Old text, new text, what is said. */
static void usda_that_is_wrong(void **state)
{
    (void)state;
    static const char *const rows[][3] = {
        {"ParticleField3DGaussianSplat \"one", "Mesh \"one", "holds no prim"},
        {"#usda 1.0", "#usdb 1.0", "begins with #usda"},
        {"(1, 2, 4)", "(1, 2)", "2 numbers in scales (wanted 3"},
        {"(1, 2, 4)", "(1, x, 4)", "not a number"},
        {"Degree = 1", "Degree = 4", "degree 4"},
        {"srgb_rec709_display", "lin_rec709_scene", "colours of another space (wanted srgb_rec709_display)"},
        {"Degree = 1", "Degree = 2", "12 numbers of harmonics (wanted 27)"},
        {"(1, 2, 4)", "(1, -2, 4)", "no usable Gaussian"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[sizeof usda + 64];
        const char *at = strstr(usda, rows[i][0]);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - usda), usda, rows[i][1], at + strlen(rows[i][0]));
        gaussian_cloud c;
        gbt_error err = {0};
        assert_int_equal(read_text(text, &c, &err), GBT_ERR_FORMAT);
        if (strstr(err.text, rows[i][2]) == NULL)
            fail_msg("%s (wanted: %s)", err.text, rows[i][2]);
    }
}

/* What the prim's order lists: where its Gaussians are, and whether a warning says that more is left out. */
static void usda_order_of_transformations(void **state)
{
    (void)state;
    static const struct {
        const char *old, *new;
        double x, y, z;
        bool is_told;
    } rows[] = {
        {"[\"xformOp:translate\"]", "[\"xformOp:rotateZ\", \"xformOp:translate\"]", 10, 20, 30, false},
        {"[\"xformOp:translate\"]", "['xformOp:translate', 'xformOp:rotateZ']", -10, -20, 30, false},
        {"[\"xformOp:translate\"]", "[\"xformOp:rotateZ\"]", 0, 0, 0, false},
        {"[\"xformOp:translate\"]", "[]", 0, 0, 0, false},
        {"[\"xformOp:translate\"]", "None", 0, 0, 0, false},
        {"uniform token[] xformOpOrder", "custom token[] other", 0, 0, 0, false},
        {"[\"xformOp:translate\"]", "[\"xformOp:translate\", \"xformOp:scale\"]", 10, 20, 30, true},
        {"[\"xformOp:translate\"]", "[\"!invert!xformOp:translate\"]", 0, 0, 0, true},
        {"180.0\n    float3 xformOp:scale = (2, 2, 2)\n    uniform token[] xformOpOrder = [",
         "90\n    uniform token[] xformOpOrder = [\"xformOp:rotateZ\", ", 10, 20, 30, true},
        {"xformOp:translate = (10, 20, 30)", "xformOp:translate.timeSamples = {0: (1, 2, 3)}", 0, 0, 0,
         true}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[sizeof usda + 64], said[256] = "";
        const char *at = strstr(usda, rows[i].old);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - usda), usda, rows[i].new,
                 at + strlen(rows[i].old));
        gaussian_cloud c;
        gbt_listen(keep_warning, said);
        assert_ok(read_text(text, &c, &assert_ok_err_));
        gbt_listen(NULL, NULL);
        if (c.origin[0] != rows[i].x || c.origin[1] != rows[i].y || c.origin[2] != rows[i].z)
            fail_msg("%s: %g %g %g", rows[i].new, c.origin[0], c.origin[1], c.origin[2]);
        if ((strstr(said, "only the translation") != NULL) != rows[i].is_told)
            fail_msg("%s: %s", rows[i].new, said);
        gaussian_cloud_free(&c);
    }
}

/* Further prims, behind the first one and beside what it is in; not what only has the type's name. */
static void usda_of_several_prims(void **state)
{
    (void)state;
    static const char other[] = "def ParticleField3DGaussianSplat \"two\" {\n float[] scales = [1]\n}\n"
                                "over ParticleField3DGaussianSplat \"no\" {\n}\n";
    for (int more = 0; more < 3; more++) {
        char text[sizeof usda + 2 * sizeof other], said[256] = "", want[64] = "";
        snprintf(text, sizeof text, "%.*s%s}\n%s", (int)strlen(usda) - 2, usda, more > 0 ? other : "",
                 more > 1 ? other : "");
        if (more > 0)
            snprintf(want, sizeof want, "a.usda: only the first of %d prims of Gaussians is read", more + 1);
        gaussian_cloud c;
        gbt_listen(keep_warning, said);
        assert_ok(read_text(text, &c, &assert_ok_err_));
        gbt_listen(NULL, NULL);
        assert_true(c.count == 1 && c.origin[0] == 10);
        gaussian_cloud_free(&c);
        assert_string_equal(said, want);
    }
}

/* Coordinates of a country too: floats keep half a metre of them. */
static void usd_keeps_everything(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        gaussian_cloud a, b;
        make_cloud(&a, 40, degree);
        const double origin[3] = {691234.0625, 5334567.123, -0.1};
        const char *const path = in_folder("%s", degree % 2 == 0 ? "a.usda" : "a.usdz");
        assert_ok(gaussian_file_write(path, &a, origin, &assert_ok_err_));
        assert_ok(gaussian_file_read(path, &b, &assert_ok_err_));
        assert_int_equal(b.sh_degree, degree);
        check_near(&a, &b, origin, &(limits){.mean = 1e-8, .scale = 1e-6, .quat = 1e-6});
        gaussian_cloud_free(&a);
        gaussian_cloud_free(&b);
    }
}

/* Packages of several files: what is read, or said. */
static void usdz_of_others(void **state)
{
    (void)state;
    static const char empty[] = "#usda 1.0\n( subLayers = [@b.usda@] )\n", binary[] = "PXR-USDC";
    static const struct {
        archive_member members[3];
        const char *says; /* NULL: it is read */
    } rows[] = {
        {{{"a.usda", empty, sizeof empty - 1}, {"c.usdc", binary, 8}, {"b.usda", usda, sizeof usda - 1}},
         NULL},
        {{{"a.usda", empty, sizeof empty - 1}, {"c.usdc", binary, 8}, {"d.png", "", 0}},
         "p.usdz: binary USD (wanted text: convert it with usdcat)"},
        {{{"c.usdc", binary, 8}, {"d.png", "", 0}, {"e.png", "", 0}},
         "p.usdz: binary USD (wanted text: convert it with usdcat)"},
        {{{"a.usda", empty, sizeof empty - 1}, {"b.usda", "", 0}, {"d.png", "", 0}},
         "p.usdz: holds no prim of type ParticleField3DGaussianSplat"},
        {{{"d.png", "", 0}, {"e.png", "", 0}, {"f.png", "", 0}}, "p.usdz: has no .usda file inside"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        sink s = {0};
        gaussian_cloud c;
        gbt_error err = {0};
        assert_ok(archive_put(&s, "p.usdz", rows[i].members, 3, 64, &assert_ok_err_));
        const source_file file = {"p.usdz", s.bytes, s.size};
        const gbt_status status = gaussian_format_usdz.read(&file, &c, &err);
        assert_int_equal(status, rows[i].says == NULL ? GBT_OK : GBT_ERR_FORMAT);
        assert_string_equal(err.text, rows[i].says == NULL ? "" : rows[i].says);
        assert_int_equal(c.count, rows[i].says == NULL ? 1 : 0);
        gaussian_cloud_free(&c);
        sink_free(&s);
    }
}

/* Bytes of a package begin at a multiple of 64: so it can be mapped. */
static void usdz_is_aligned(void **state)
{
    (void)state;
    gaussian_cloud a;
    make_cloud(&a, 3, 0);
    assert_ok(gaussian_file_write(in_folder("a.usdz"), &a, nowhere, &assert_ok_err_));
    gaussian_cloud_free(&a);
    unsigned char *bytes;
    size_t size;
    assert_ok(file_read(in_folder("a.usdz"), &bytes, &size, &assert_ok_err_));
    const unsigned char *text = memmem(bytes, size, "#usda 1.0", 9);
    assert_non_null(text);
    assert_int_equal((text - bytes) % 64, 0);
    assert_int_equal(bytes[8] | bytes[9] << 8, 0); /* stored */
    mem_free(bytes);
}

/* Bundles that are whole, of a meta.json that is wrong. */
static void sog_meta_that_is_wrong(void **state)
{
    (void)state;
    static const struct {
        const char *meta, *says;
    } rows[] = {{"{\"version\":1,\"count\":1}", "meta.json: not of version 2"},
                {"{\"version\":2,\"count\":1000000}", "1000000 Gaussians cannot be in"},
                {"{\"version\":2,\"count\":0}", "0 Gaussians cannot be in"},
                {"{\"version\":2,\"count\":1}", "meta.json: means.mins is no list of 3 numbers"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const archive_member meta = {"meta.json", rows[i].meta, strlen(rows[i].meta)};
        sink s = {0};
        assert_ok(archive_put(&s, "a.sog", &meta, 1, 1, &assert_ok_err_));
        const source_file file = {"a.sog", s.bytes, s.size};
        gaussian_cloud cloud;
        gbt_error err = {0};
        assert_int_equal(gaussian_format_sog.read(&file, &cloud, &err), GBT_ERR_FORMAT);
        if (strstr(err.text, rows[i].says) == NULL)
            fail_msg("wanted \"%s\", got: %s", rows[i].says, err.text);
        sink_free(&s);
    }
}

/* The bundle with level `level` of all three codebooks null, instead of a number. */
static void put_null_level(const source_file *from, int level, sink *out)
{
    enum { FILES = 8 };
    static const char *const names[FILES] = {"meta.json",          "means_l.webp",   "means_u.webp",
                                             "scales.webp",        "quats.webp",     "sh0.webp",
                                             "shN_centroids.webp", "shN_labels.webp"};
    archive_member members[FILES];
    unsigned char *bytes[FILES];
    sink meta = {0};
    for (int i = 0; i < FILES; i++) {
        size_t size;
        assert_ok(archive_take(from, names[i], &bytes[i], &size, &assert_ok_err_));
        members[i] = (archive_member){names[i], bytes[i], size};
    }
    static const char word[] = "\"codebook\":[";
    const char *at = (const char *)bytes[0];
    for (const char *book; (book = strstr(at, word)) != NULL;) {
        const char *number = book + sizeof word - 1;
        for (int k = 0; k < level; k++)
            number = strchr(number, ',') + 1;
        sink_put(&meta, at, (size_t)(number - at));
        sink_put_text(&meta, "null");
        at = number + strcspn(number, ",]");
    }
    sink_put_text(&meta, at);
    members[0] = (archive_member){"meta.json", meta.bytes, meta.size};
    assert_ok(archive_put(out, "b.sog", members, FILES, 1, &assert_ok_err_));
    sink_free(&meta);
    for (int i = 0; i < FILES; i++)
        mem_free(bytes[i]);
}

/* A first level that is null continues the others downwards; a later one is no number. */
static void sog_without_a_first_level(void **state)
{
    (void)state;
    gaussian_cloud a, b;
    unsigned char *bytes;
    source_file file = {.name = "a.sog"};
    make_cloud(&a, 300, 1);
    for (size_t i = 0; i < 3 * a.count; i++) /* the levels become k / 64 */
        a.scale_log[i] = (float)(i % 256) / 64;
    assert_ok(gaussian_file_write(in_folder("a.sog"), &a, nowhere, &assert_ok_err_));
    assert_ok(gaussian_file_read(in_folder("a.sog"), &b, &assert_ok_err_));
    gaussian_cloud_free(&a);
    assert_ok(file_read(in_folder("a.sog"), &bytes, &file.size, &assert_ok_err_));
    file.bytes = bytes;
    for (int level = 0; level < 3; level++) {
        sink s = {0};
        gaussian_cloud c;
        gbt_error err = {0};
        put_null_level(&file, level, &s);
        const source_file changed = {"b.sog", s.bytes, s.size};
        assert_int_equal(gaussian_format_sog.read(&changed, &c, &err), level == 0 ? GBT_OK : GBT_ERR_FORMAT);
        if (level > 0)
            assert_non_null(strstr(err.text, "scales.codebook is no list of 256 numbers"));
        for (size_t i = 0; level == 0 && i < 3 * b.count; i++) {
            /* 1/64 + (1/64 - 255/64) / 255 */
            const float want = b.scale_log[i] == 0 ? 0.0156250f - 254.0f / 64 / 255 : b.scale_log[i];
            assert_true(fabsf(c.scale_log[i] - want) < 1e-6f);
        }
        gaussian_cloud_free(&c);
        sink_free(&s);
    }
    mem_free(bytes);
    gaussian_cloud_free(&b);
}

static void memory_runs_out(void **state)
{
    (void)state;
    static const char *const names[] = {"m.sog", "m.glb"};
    const double origin[3] = {0, 0, 0};
    gaussian_cloud a;
    make_cloud(&a, 20, 0);
    for (int i = 0; i < 2; i++) {
        gbt_status status = GBT_ERR_NO_MEMORY;
        long k = 0;
        assert_ok(gaussian_file_write(in_folder(names[i]), &a, origin, &assert_ok_err_));
        for (; status != GBT_OK && k < 1000; k++) {
            gaussian_cloud b;
            gbt_error err = {0};
            mem_fail_after(k);
            status = gaussian_file_read(in_folder(names[i]), &b, &err);
            mem_fail_after(-1);
            if (status != GBT_OK && (status != GBT_ERR_NO_MEMORY || err.text[0] == '\0'))
                fail_msg("%s, allocation %ld: %d %s", names[i], k, (int)status, err.text);
            gaussian_cloud_free(&b);
        }
        assert_true(status == GBT_OK && k > 3);
    }
    gaussian_cloud_free(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(compressed_ply_keeps_its_steps, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(compressed_ply_bytes, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(spz4_keeps_the_values_of_spz, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(spz_with_extensions, folder_make, folder_remove),
        cmocka_unit_test(spz4_of_degree_4),
        cmocka_unit_test_setup_teardown(spz_tells_scales_that_it_has_not, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(spz4_bytes, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(sog_keeps_its_steps, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(sog_palette_is_exact, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(usd_keeps_everything, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(usdz_is_aligned, folder_make, folder_remove),
        cmocka_unit_test(usda_of_others),
        cmocka_unit_test(usdz_of_others),
        cmocka_unit_test(usda_that_is_wrong),
        cmocka_unit_test(usda_order_of_transformations),
        cmocka_unit_test(usda_of_several_prims),
        cmocka_unit_test(levels_follow_the_values),
        cmocka_unit_test(palette_entries_are_means),
        cmocka_unit_test(sog_meta_that_is_wrong),
        cmocka_unit_test_setup_teardown(sog_without_a_first_level, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(memory_runs_out, folder_make, folder_remove),
        cmocka_unit_test(older_compressed_ply),
        cmocka_unit_test(far_ones_are_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
