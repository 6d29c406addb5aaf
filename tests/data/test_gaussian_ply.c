/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/test_gaussian_ply.c -- 3DGS models: layout, repairs, refusals. */
#include "data_support.h"

#include "data/gaussian_file.h"
#include "data/gaussian_ply.h"

/* A model in ASCII: `rest` f_rest properties, rows of mean, dc, rest, opacity, scale, rot as the usual
   exporters order them. */
static void put_header(sink *s, size_t count, size_t rest, const char *leave_out)
{
    static const char *const before[] = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
    static const char *const behind[] = {"opacity", "scale_0", "scale_1", "scale_2",
                                         "rot_0",   "rot_1",   "rot_2",   "rot_3"};
    char line[128];
    snprintf(line, sizeof line, "ply\nformat ascii 1.0\nelement vertex %zu\n", count);
    sink_put_text(s, line);
    for (size_t i = 0; i < 9 + rest + 8; i++) {
        char name[32];
        if (i >= 9 && i < 9 + rest)
            snprintf(name, sizeof name, "f_rest_%zu", i - 9);
        else
            snprintf(name, sizeof name, "%s", i < 9 ? before[i] : behind[i - 9 - rest]);
        snprintf(line, sizeof line, "property float %s%s\n",
                 leave_out != NULL && strcmp(leave_out, name) == 0 ? "other_" : "", name);
        sink_put_text(s, line);
    }
    sink_put_text(s, "end_header\n");
}

static void put_rest(sink *s, size_t rest)
{
    char text[32];
    for (size_t i = 0; i < rest; i++) {
        snprintf(text, sizeof text, "%zu.25 ", i + 1);
        sink_put_text(s, text);
    }
}

static void put_row(sink *s, const char *mean, size_t rest, const char *opacity, const char *scale,
                    const char *rot)
{
    sink_put_text(s, mean);
    sink_put_text(s, " 0 0 0 0.1 0.2 0.3 ");
    put_rest(s, rest);
    sink_put_text(s, opacity);
    sink_put_text(s, " ");
    sink_put_text(s, scale);
    sink_put_text(s, " ");
    sink_put_text(s, rot);
    sink_put_text(s, "\n");
}

static gbt_status read_sink(sink *s, gaussian_cloud *cloud, gbt_error *err)
{
    unsigned char *copy = exact_copy(s->bytes, s->size);
    const source_file file = {"g.ply", copy, s->size};
    const gbt_status status = gaussian_ply_read(&file, cloud, err);
    free(copy);
    sink_free(s);
    return status;
}

/* f_rest is channel-major in the file and coefficient-major here: sh[k][c] = f_rest[c * M + k - 1]. */
static void layout_of_each_degree(void **state)
{
    (void)state;
    for (int degree = 0; degree <= 3; degree++) {
        const size_t per_channel = (size_t)((degree + 1) * (degree + 1) - 1);
        sink s = {0};
        put_header(&s, 2, 3 * per_channel, NULL);
        put_row(&s, "1 2 3", 3 * per_channel, "0", "-1 -2 -3", "2 0 0 0");
        put_row(&s, "4 5 6", 3 * per_channel, "2", "-1 -1 -1", "1 1 -1 1");
        gaussian_cloud cloud;
        assert_ok(read_sink(&s, &cloud, &assert_ok_err_));
        assert_int_equal(cloud.count, 2);
        assert_int_equal(cloud.sh_degree, degree);
        assert_int_equal(cloud.dropped + cloud.identity_rotations + cloud.scales_clamped, 0);
        const float mean[6] = {1, 2, 3, 4, 5, 6}, scale[6] = {-1, -2, -3, -1, -1, -1},
                    quat[8] = {1, 0, 0, 0, 0.5f, 0.5f, -0.5f, 0.5f};
        assert_memory_equal(cloud.mean, mean, sizeof mean);
        assert_memory_equal(cloud.scale_log, scale, sizeof scale);
        for (int k = 0; k < 8; k++)
            assert_true(cloud.quat[k] == quat[k]);
        assert_true(cloud.opacity[0] == 0.5f);
        assert_true(fabsf(cloud.opacity[1] - 0.880797078f) < 1e-7f);
        for (size_t i = 0; i < 2; i++)
            for (size_t k = 0; k < 16; k++)
                for (size_t c = 0; c < 3; c++) {
                    float want = 0;
                    if (k == 0)
                        want = (const float[]){0.1f, 0.2f, 0.3f}[c];
                    else if (k <= per_channel)
                        want = (float)(c * per_channel + k) + 0.25f;
                    assert_true(cloud.sh[(i * 16 + k) * 3 + c] == want);
                }
        gaussian_cloud_free(&cloud);
    }
}

typedef struct row_case {
    const char *name, *mean, *opacity, *scale, *rot;
    size_t dropped, identity, clamped;
    float opacity_out, scale_out[3];
} row_case;

/* ln(1e4) = 9.21034037 */
static row_case row_cases[] = {
    {"plain", "1 2 3", "0", "-1 -2 -3", "1 0 0 0", 0, 0, 0, 0.5f, {-1, -2, -3}},
    {"mean NaN", "nan 2 3", "0", "-1 -2 -3", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"mean infinite", "1 2 inf", "0", "-1 -2 -3", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"mean 1e13", "1 1e13 3", "0", "-1 -2 -3", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"opacity NaN", "1 2 3", "nan", "-1 -2 -3", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"opacity +inf", "1 2 3", "inf", "-1 -2 -3", "1 0 0 0", 0, 0, 0, 1, {-1, -2, -3}},
    {"opacity -inf", "1 2 3", "-inf", "-1 -2 -3", "1 0 0 0", 0, 0, 0, 0, {-1, -2, -3}},
    {"opacity 1000", "1 2 3", "1000", "-1 -2 -3", "1 0 0 0", 0, 0, 0, 1, {-1, -2, -3}},
    {"opacity -1000", "1 2 3", "-1000", "-1 -2 -3", "1 0 0 0", 0, 0, 0, 0, {-1, -2, -3}},
    {"scale NaN", "1 2 3", "0", "-1 nan -3", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"scale 1000", "1 2 3", "0", "-1 -2 1000", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"scale +inf", "1 2 3", "0", "-1 -2 inf", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"scale at the limit", "1 2 3", "0", "30 30 30", "1 0 0 0", 0, 0, 0, 0.5f, {30, 30, 30}},
    {"scale above the limit", "1 2 3", "0", "30.1 30 30", "1 0 0 0", 1, 0, 0, 0, {0}},
    {"scale -inf", "1 2 3", "0", "0 -inf 0", "1 0 0 0", 0, 0, 1, 0.5f, {0, -9.21034037f, 0}},
    {"pancake", "1 2 3", "0", "0 -10 0", "1 0 0 0", 0, 0, 1, 0.5f, {0, -9.21034037f, 0}},
    {"thin, but not too thin", "1 2 3", "0", "0 -9.21 0", "1 0 0 0", 0, 0, 0, 0.5f, {0, -9.21f, 0}},
    {"needle", "1 2 3", "0", "-20 2 -20", "1 0 0 0", 0, 0, 1, 0.5f, {-7.21034037f, 2, -7.21034037f}},
    {"point", "1 2 3", "0", "-1000 -inf -1000", "1 0 0 0", 0, 0, 1, 0.5f, {-30, -30, -30}},
    {"zero quaternion", "1 2 3", "0", "-1 -2 -3", "0 0 0 0", 0, 1, 0, 0.5f, {-1, -2, -3}},
    {"tiny quaternion", "1 2 3", "0", "-1 -2 -3", "1e-20 0 0 0", 0, 0, 0, 0.5f, {-1, -2, -3}},
    {"quaternion NaN", "1 2 3", "0", "-1 -2 -3", "nan 0 0 0", 1, 0, 0, 0, {0}},
    {"quaternion infinite", "1 2 3", "0", "-1 -2 -3", "0 0 0 inf", 1, 0, 0, 0, {0}},
};

/* The row under test stands between two good ones, so a dropped row must not disturb its neighbours. */
static void rows(void **state)
{
    const row_case *c = *state;
    sink s = {0};
    put_header(&s, 3, 9, NULL);
    put_row(&s, "7 8 9", 9, "1", "0 0 0", "0 1 0 0");
    put_row(&s, c->mean, 9, c->opacity, c->scale, c->rot);
    put_row(&s, "10 11 12", 9, "1", "0 0 0", "0 0 1 0");
    gaussian_cloud cloud;
    assert_ok(read_sink(&s, &cloud, &assert_ok_err_));
    assert_int_equal(cloud.count, 3 - c->dropped);
    assert_int_equal(cloud.dropped, c->dropped);
    assert_int_equal(cloud.identity_rotations, c->identity);
    assert_int_equal(cloud.scales_clamped, c->clamped);
    const size_t last = cloud.count - 1;
    assert_true(cloud.mean[0] == 7 && cloud.quat[1] == 1 && cloud.mean[3 * last] == 10 &&
                cloud.quat[4 * last + 2] == 1);
    if (c->dropped == 0) {
        assert_true(cloud.opacity[1] == c->opacity_out);
        for (int k = 0; k < 3; k++)
            assert_true(fabsf(cloud.scale_log[3 + k] - c->scale_out[k]) < 1e-6f);
        assert_true(cloud.quat[4] == 1 && cloud.quat[5] == 0 && cloud.quat[6] == 0 && cloud.quat[7] == 0);
    }
    gaussian_cloud_free(&cloud);
}

/* filter_3D of Mip-Splatting: 1, none, and one that is no number; whole and by parts. */
static void filter_is_part_of_a_scale(void **state)
{
    (void)state;
    enum { ROWS = 3, COLUMNS = 15 };
    static const char *const names[COLUMNS] = {"filter_3D", "x",      "y",       "z",       "f_dc_0",
                                               "f_dc_1",    "f_dc_2", "opacity", "scale_0", "scale_1",
                                               "scale_2",   "rot_0",  "rot_1",   "rot_2",   "rot_3"};
    static const float filters[ROWS] = {1, 0, NAN};
    sink s = {0};
    sink_put_text(&s, "ply\nformat binary_little_endian 1.0\nelement vertex 3\n");
    for (int k = 0; k < COLUMNS; k++) {
        sink_put_text(&s, "property float ");
        sink_put_text(&s, names[k]);
        sink_put_text(&s, "\n");
    }
    sink_put_text(&s, "end_header\n");
    for (int i = 0; i < ROWS; i++)
        for (int k = 0; k < COLUMNS; k++)
            sink_put_f32(&s, k == 0 ? filters[i] : strcmp(names[k], "rot_0") == 0 ? 1 : 0);
    assert_ok(file_write_atomic(in_folder("f.ply"), s.bytes, s.size, &assert_ok_err_));
    sink_free(&s);
    gaussian_cloud whole, part;
    assert_ok(gaussian_file_read(in_folder("f.ply"), &whole, &assert_ok_err_));
    gaussian_ply_parts parts;
    assert_ok(gaussian_ply_open(in_folder("f.ply"), &parts, &assert_ok_err_));
    assert_ok(gaussian_cloud_alloc(&part, ROWS, &assert_ok_err_));
    unsigned char bytes[ROWS * COLUMNS * sizeof(float)];
    uint32_t kept[ROWS];
    assert_ok(gaussian_ply_part(&parts, 0, ROWS, bytes, &part, kept, &assert_ok_err_));
    const gaussian_cloud *const clouds[] = {&whole, &part};
    for (int i = 0; i < 2; i++) {
        const gaussian_cloud *c = clouds[i];
        assert_true(c->count == 2 && c->dropped == 1);
        assert_true(fabs((double)c->opacity[0] - 0.5 / sqrt(8)) < 1e-7 && c->opacity[1] == 0.5f);
        for (int k = 0; k < 3; k++)
            assert_true(fabs((double)c->scale_log[k] - 0.5 * log(2)) < 1e-7 && c->scale_log[3 + k] == 0);
    }
    gaussian_ply_close(&parts);
    gaussian_cloud_free(&whole);
    gaussian_cloud_free(&part);
}

/* Map coordinates as doubles, after a row that is not usable and one far away; whole and by parts. Floats are
   as they are. */
static void means_in_double(void **state)
{
    (void)state;
    enum { ROWS = 3000, FLOATS = 11 };
    static const char *const names[3 + FLOATS] = {"x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                                  "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                                  "rot_0",  "rot_1",   "rot_2",   "rot_3"};
    static unsigned char bytes[ROWS * (3 * sizeof(double) + FLOATS * sizeof(float))];
    static uint32_t kept[ROWS];
    static double means[ROWS][3];
    for (size_t i = 0; i < ROWS; i++) {
        means[i][0] = i == 0 ? (double)NAN : i == 1 ? 1e9 : 691234.0625 + 0.01 * (double)i;
        means[i][1] = 5334567.123 - 0.003 * (double)i;
        means[i][2] = -0.1;
    }
    for (int is_double = 0; is_double < 2; is_double++) {
        sink s = {0};
        sink_put_text(&s, "ply\nformat binary_little_endian 1.0\nelement vertex 3000\n");
        for (int k = 0; k < 3 + FLOATS; k++) {
            sink_put_text(&s, k < 3 && is_double ? "property double " : "property float ");
            sink_put_text(&s, names[k]);
            sink_put_text(&s, "\n");
        }
        sink_put_text(&s, "end_header\n");
        for (size_t i = 0; i < ROWS; i++) {
            for (size_t k = 0; k < 3; k++)
                if (is_double)
                    sink_put_f64(&s, means[i][k]);
                else
                    sink_put_f32(&s, (float)means[i][k]);
            for (int k = 0; k < FLOATS; k++)
                sink_put_f32(&s, 0.5f);
        }
        assert_ok(file_write_atomic(in_folder("d.ply"), s.bytes, s.size, &assert_ok_err_));
        sink_free(&s);
        gaussian_cloud whole, part;
        gaussian_ply_parts parts;
        assert_ok(gaussian_file_read(in_folder("d.ply"), &whole, &assert_ok_err_));
        assert_ok(gaussian_ply_open(in_folder("d.ply"), &parts, &assert_ok_err_));
        assert_ok(gaussian_cloud_alloc(&part, ROWS, &assert_ok_err_));
        assert_ok(gaussian_ply_part(&parts, 0, ROWS, bytes, &part, kept, &assert_ok_err_));
        assert_true(whole.count == ROWS - 1 && part.count == ROWS - 1);
        assert_memory_equal(whole.mean, part.mean, 3 * whole.count * sizeof *whole.mean);
        for (size_t k = 0; k < 3; k++) {
            const double origin = whole.origin[k];
            assert_true(origin == part.origin[k] && origin == parts.origin[k] && origin == round(origin));
            assert_true(is_double || origin == 0);
            for (size_t i = 1; is_double && i < whole.count; i++)
                assert_true(fabs((double)whole.mean[3 * i + k] + origin - means[i + 1][k]) < 1e-6);
        }
        gaussian_ply_close(&parts);
        gaussian_cloud_free(&whole);
        gaussian_cloud_free(&part);
    }
}

static void refused(sink *s, const char *says)
{
    gaussian_cloud cloud;
    gbt_error err = {0};
    assert_int_equal(read_sink(s, &cloud, &err), GBT_ERR_FORMAT);
    check_message(GBT_ERR_FORMAT, &err);
    if (strstr(err.text, says) == NULL)
        fail_msg("wanted \"%s\", got: %s", says, err.text);
    assert_null(cloud.mean);
}

static void missing_properties(void **state)
{
    (void)state;
    static const char *const names[] = {"x",      "y",       "z",       "opacity", "f_dc_0",
                                        "f_dc_2", "scale_0", "scale_2", "rot_0",   "rot_3"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        sink s = {0};
        char says[64];
        snprintf(says, sizeof says, "has no property %s", names[i]);
        put_header(&s, 1, 0, names[i]);
        put_row(&s, "1 2 3", 0, "0", "0 0 0", "1 0 0 0");
        refused(&s, says);
    }
}

static void wrong_counts_of_rest(void **state)
{
    (void)state;
    static const size_t counts[] = {1, 8, 10, 23, 27, 44, 46, 72};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        sink s = {0};
        put_header(&s, 1, counts[i], NULL);
        put_row(&s, "1 2 3", counts[i], "0", "0 0 0", "1 0 0 0");
        refused(&s, "wrong number of f_rest properties (wanted 0, 9, 24 or 45");
    }
}

static void other_files(void **state)
{
    (void)state;
    sink s = {0};
    sink_put_text(&s, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
                      "float z\nend_header\n1 2 3\n");
    refused(&s, "is a point cloud, not a Gaussian model");
    sink_put_text(&s, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                      "f_anchor_feat_0\nproperty float opacity\nend_header\n1 2 3\n");
    refused(&s, "anchors of a neural model");
    put_header(&s, 0, 0, NULL);
    refused(&s, "holds no usable Gaussian (0 rows dropped)");
    put_header(&s, 1, 0, NULL);
    put_row(&s, "nan 2 3", 0, "0", "0 0 0", "1 0 0 0");
    refused(&s, "holds no usable Gaussian (1 rows dropped)");
    put_header(&s, 1000000000, 0, NULL);
    put_row(&s, "1 2 3", 0, "0", "0 0 0", "1 0 0 0");
    refused(&s, "1000000000 Gaussians cannot be");
}

/* A NumPy array of floats with `per_row` columns, or NULL; free with mem_free() on *owned. */
static const float *load_array(const char *name, size_t count, size_t per_row, unsigned char **owned)
{
    const char *path = shared_path(name);
    size_t size;
    *owned = NULL;
    if (path == NULL)
        return NULL;
    assert_ok(file_read(path, owned, &size, &assert_ok_err_));
    assert_true(size > count * per_row * sizeof(float));
    const float *values =
        (const float *)(*owned + size - count * per_row * sizeof(float)); /* the header is padded to 64 bytes
                                                                           */
    assert_int_equal((uintptr_t)values % 4, 0);
    return values;
}

static double sign_of(double value) { return value < 0 ? -1 : 1; }

/* The same 2000 Gaussians as plain arrays, written by another program. */
static void same_as_arrays(void **state)
{
    (void)state;
    enum { COUNT = 2000 };
    unsigned char *owned[5];
    const float *center = load_array("peer/match2k/centers.npy", COUNT, 3, &owned[0]);
    const float *scale = load_array("peer/match2k/scales.npy", COUNT, 3, &owned[1]);
    const float *quat = load_array("peer/match2k/quats_xyzw.npy", COUNT, 4, &owned[2]);
    const float *opacity = load_array("peer/match2k/opacities.npy", COUNT, 1, &owned[3]);
    const float *sh = load_array("peer/match2k/sh3.npy", COUNT, 48, &owned[4]);
    const char *path = shared_path("peer/match2k/scene.ply");
    if (path == NULL || center == NULL || scale == NULL || quat == NULL || opacity == NULL || sh == NULL)
        skip();
    gaussian_cloud cloud;
    assert_ok(gaussian_file_read(path, &cloud, &assert_ok_err_));
    assert_int_equal(cloud.count, COUNT);
    for (size_t i = 0; i < COUNT; i++) {
        const float *q = cloud.quat + 4 * i, *want = quat + 4 * i;
        const double flip = sign_of((double)q[0] * (double)want[3] + (double)q[1] * (double)want[0] +
                                    (double)q[2] * (double)want[1] + (double)q[3] * (double)want[2]);
        for (size_t k = 0; k < 3; k++) {
            assert_true(cloud.mean[3 * i + k] == center[3 * i + k]);
            assert_true(fabs(exp((double)cloud.scale_log[3 * i + k]) / (double)scale[3 * i + k] - 1) < 2e-6);
            assert_true(fabs((double)q[1 + k] * flip - (double)want[k]) < 1e-6);
        }
        assert_true(fabs((double)q[0] * flip - (double)want[3]) < 1e-6);
        assert_true(fabsf(cloud.opacity[i] - opacity[i]) < 1e-6f);
        for (size_t k = 0; k < 48; k++)
            assert_true(fabsf(cloud.sh[48 * i + k] - sh[48 * i + k]) < 1e-6f);
    }
    gaussian_cloud_free(&cloud);
    for (int i = 0; i < 5; i++)
        mem_free(owned[i]);
}

static void real_models(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        size_t count;
    } models[] = {{"peer/vol10k/scene.ply", 10000},
                  {"peer/match2k/scene.ply", 2000},
                  {"peer/match1500/scene.ply", 1500}};
    size_t found = 0;
    for (size_t i = 0; i < sizeof models / sizeof models[0]; i++) {
        const char *path = shared_path(models[i].name);
        if (path == NULL)
            continue;
        found++;
        gaussian_cloud cloud;
        assert_ok(gaussian_file_read(path, &cloud, &assert_ok_err_));
        assert_int_equal(cloud.count, models[i].count);
        assert_int_equal(cloud.dropped, 0);
        gaussian_cloud_free(&cloud);
    }
    if (found == 0)
        skip();
}

int main(void)
{
    enum { ROW_COUNT = sizeof row_cases / sizeof row_cases[0] };
    static struct CMUnitTest tests[ROW_COUNT];
    for (size_t i = 0; i < ROW_COUNT; i++)
        tests[i] =
            (struct CMUnitTest){.name = row_cases[i].name, .test_func = rows, .initial_state = &row_cases[i]};
    const struct CMUnitTest fixed[] = {
        cmocka_unit_test(layout_of_each_degree),
        cmocka_unit_test_setup_teardown(means_in_double, folder_make, folder_remove),
        cmocka_unit_test_setup_teardown(filter_is_part_of_a_scale, folder_make, folder_remove),
        cmocka_unit_test(missing_properties),
        cmocka_unit_test(wrong_counts_of_rest),
        cmocka_unit_test(other_files),
        cmocka_unit_test(real_models),
        cmocka_unit_test(same_as_arrays),
    };
    const int failures = cmocka_run_group_tests_name("gaussian ply, rows", tests, NULL, NULL);
    return failures + cmocka_run_group_tests_name("gaussian ply", fixed, NULL, NULL);
}
