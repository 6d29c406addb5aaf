/* SPDX-License-Identifier: Apache-2.0 */
/* tests/io/test_scaffold_file.c -- models of Scaffold-GS: written here by the description of the format,
   evaluated here in double by its equations, and read and decoded by ours. */
#include "folder.h"

#include "anchor/decode.h"
#include "base/rng.h"
#include "data/bytes.h"
#include "io/safetensors.h"
#include "io/scaffold_file.h"

enum { ANCHORS = 40, OFFSETS = 10, FEATURES = 32, HIDDEN = 32, INPUTS = 35 };

typedef struct layer {
    size_t in, out;
    double weight[70 * 36], bias[70];
} layer;

/* What the files say. */
static struct {
    double position[ANCHORS][3], offset[ANCHORS][OFFSETS][3], feature[ANCHORS][FEATURES],
        scale_log[ANCHORS][6];
    layer first[3], second[3];
} scaffold;

static const char *const names[3] = {"opacity", "cov", "color"};
static const size_t outputs[3] = {OFFSETS, 7 * OFFSETS, 3 * OFFSETS};
static uint64_t drawn;

static double draw(double size)
{
    return (double)(float)(size * (2 * (double)rng_uniform(7, 0, drawn++) - 1)); /* files hold floats */
}

static void draw_layer(layer *l, size_t in, size_t out)
{
    l->in = in;
    l->out = out;
    for (size_t i = 0; i < in * out; i++)
        l->weight[i] = draw(0.4);
    for (size_t i = 0; i < out; i++)
        l->bias[i] = draw(0.3);
}

/* with_distance: a bit for each network. */
static void draw_model(unsigned with_distance)
{
    drawn = 0;
    for (size_t a = 0; a < ANCHORS; a++) {
        for (size_t k = 0; k < 3; k++)
            scaffold.position[a][k] = 500 + draw(4);
        for (size_t i = 0; i < OFFSETS; i++)
            for (size_t k = 0; k < 3; k++)
                scaffold.offset[a][i][k] = draw(1);
        for (size_t i = 0; i < FEATURES; i++)
            scaffold.feature[a][i] = draw(1);
        for (size_t i = 0; i < 6; i++)
            scaffold.scale_log[a][i] = draw(1) - 2;
    }
    for (size_t n = 0; n < 3; n++) {
        draw_layer(&scaffold.first[n], INPUTS + (with_distance >> n & 1), HIDDEN);
        draw_layer(&scaffold.second[n], HIDDEN, outputs[n]);
    }
}

/* ---- files ---- */

static void save(sink *s, const char *name)
{
    assert_int_equal(s->status, GBT_OK);
    assert_ok(file_write_atomic(in_folder("%s", name), s->bytes, s->size, NULL));
    sink_free(s);
}

static void put_stem(sink *s, const char *stem, size_t count)
{
    char line[64];
    for (size_t i = 0; i < count; i++) {
        snprintf(line, sizeof line, "property float %s%zu\n", stem, i);
        sink_put_text(s, line);
    }
}

static void write_anchors(void)
{
    sink s = {0};
    char line[96];
    snprintf(line, sizeof line, "ply\nformat binary_little_endian 1.0\nelement vertex %d\n", ANCHORS + 1);
    sink_put_text(&s, line);
    sink_put_text(&s, "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty "
                      "float ny\nproperty float nz\n");
    put_stem(&s, "f_offset_", 3 * OFFSETS);
    put_stem(&s, "f_anchor_feat_", FEATURES);
    sink_put_text(&s, "property float opacity\n");
    put_stem(&s, "scale_", 6);
    put_stem(&s, "rot_", 4);
    sink_put_text(&s, "end_header\n");
    for (size_t row = 0; row <= ANCHORS; row++) {
        const size_t a = row < ANCHORS ? row : 0;
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, row < ANCHORS ? (float)scaffold.position[a][k] : NAN); /* the last is of no use
                                                                                     */
        for (size_t k = 0; k < 3; k++)
            sink_put_f32(&s, 0);
        for (size_t k = 0; k < 3; k++) /* all x, all y, all z */
            for (size_t i = 0; i < OFFSETS; i++)
                sink_put_f32(&s, (float)scaffold.offset[a][i][k]);
        for (size_t i = 0; i < FEATURES; i++)
            sink_put_f32(&s, (float)scaffold.feature[a][i]);
        sink_put_f32(&s, -2.1972246f);
        for (size_t i = 0; i < 6; i++)
            sink_put_f32(&s, (float)scaffold.scale_log[a][i]);
        for (size_t i = 0; i < 4; i++)
            sink_put_f32(&s, i == 0);
    }
    save(&s, "point_cloud.ply");
}

static void put_values(sink *s, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        sink_put_f32(s, (float)values[i]);
}

/* The last array comes first in the file: places are what the header says. */
static void write_network(size_t n)
{
    const layer *l1 = &scaffold.first[n], *l2 = &scaffold.second[n];
    const size_t sizes[] = {4 * l2->out, 4 * l1->in * l1->out, 4 * l1->out, 4 * l2->in * l2->out};
    char header[1024], name[64];
    const int length =
        snprintf(header, sizeof header,
                 "{\"__metadata__\":{\"format\":\"pt\"},\"0.weight\":{\"dtype\":\"F32\",\"shape\":[%zu,%zu],"
                 "\"data_offsets\":[%zu,%zu]},\"0.bias\":{\"dtype\":\"F32\",\"shape\":[%zu],\"data_offsets\":"
                 "[%zu,%zu]},\"2.weight\":{\"dtype\":\"F32\",\"shape\":[%zu,%zu],\"data_offsets\":[%zu,%zu]},"
                 "\"2.bias\":{\"dtype\":\"F32\",\"shape\":[%zu],\"data_offsets\":[0,%zu]}}   ",
                 l1->out, l1->in, sizes[0], sizes[0] + sizes[1], l1->out, sizes[0] + sizes[1],
                 sizes[0] + sizes[1] + sizes[2], l2->out, l2->in, sizes[0] + sizes[1] + sizes[2],
                 sizes[0] + sizes[1] + sizes[2] + sizes[3], l2->out, sizes[0]);
    sink s = {0};
    sink_put_uint(&s, (uint64_t)length, 8);
    sink_put_text(&s, header);
    put_values(&s, l2->bias, l2->out);
    put_values(&s, l1->weight, l1->in * l1->out);
    put_values(&s, l1->bias, l1->out);
    put_values(&s, l2->weight, l2->in * l2->out);
    snprintf(name, sizeof name, "%s_mlp.safetensors", names[n]);
    save(&s, name);
}

static void write_model(unsigned with_distance)
{
    draw_model(with_distance);
    write_anchors();
    for (size_t n = 0; n < 3; n++)
        write_network(n);
}

/* ---- the equations ---- */

static double sigmoid(double x) { return 1 / (1 + exp(-x)); }

static void evaluate(size_t n, const double *input, double *out)
{
    double hidden[HIDDEN];
    for (size_t h = 0; h < HIDDEN; h++) {
        hidden[h] = scaffold.first[n].bias[h];
        for (size_t i = 0; i < scaffold.first[n].in; i++)
            hidden[h] += scaffold.first[n].weight[h * scaffold.first[n].in + i] * input[i];
        hidden[h] = fmax(hidden[h], 0);
    }
    for (size_t o = 0; o < outputs[n]; o++) {
        out[o] = scaffold.second[n].bias[o];
        for (size_t h = 0; h < HIDDEN; h++)
            out[o] += scaffold.second[n].weight[o * HIDDEN + h] * hidden[h];
    }
}

/* Gaussians of anchor `a` seen from `camera`: mean 3, scale 3, quaternion 4, opacity, colour 3; returns how
   many have an opacity above 0. */
static size_t decode(size_t a, const double camera[3], double out[OFFSETS][14])
{
    double input[FEATURES + 4], d[3], opacity[70], shape[70], color[70];
    for (size_t k = 0; k < 3; k++)
        d[k] = scaffold.position[a][k] - camera[k];
    const double distance = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    memcpy(input, scaffold.feature[a], FEATURES * sizeof *input);
    for (size_t k = 0; k < 3; k++)
        input[FEATURES + k] = d[k] / distance;
    input[FEATURES + 3] = distance;
    evaluate(0, input, opacity);
    evaluate(1, input, shape);
    evaluate(2, input, color);
    size_t kept = 0;
    for (size_t i = 0; i < OFFSETS; i++) {
        if (!(tanh(opacity[i]) > 0))
            continue;
        double *g = out[kept++], length = 0;
        for (size_t k = 0; k < 3; k++) {
            g[k] = scaffold.position[a][k] + scaffold.offset[a][i][k] * exp(scaffold.scale_log[a][k]);
            g[3 + k] = exp(scaffold.scale_log[a][3 + k]) * sigmoid(shape[7 * i + k]);
            g[11 + k] = sigmoid(color[3 * i + k]);
        }
        for (size_t k = 3; k < 7; k++)
            length += shape[7 * i + k] * shape[7 * i + k];
        for (size_t k = 3; k < 7; k++)
            g[3 + k] = shape[7 * i + k] / sqrt(length);
        g[10] = tanh(opacity[i]);
    }
    return kept;
}

static void decodes_to_the_same_gaussians(void **state)
{
    (void)state;
    for (unsigned with_distance = 0; with_distance < 8; with_distance += with_distance == 0 ? 2 : 5) {
        write_model(with_distance);
        model m;
        size_t dropped;
        gbt_error err = {0};
        if (scaffold_file_read(in_folder("point_cloud.ply"), &m, &dropped, &err) != GBT_OK)
            fail_msg("%s", err.text);
        assert_int_equal(m.anchors.count, ANCHORS);
        assert_int_equal(m.anchors.offset_count, OFFSETS);
        assert_int_equal(dropped, 1);
        assert_int_equal(m.decoder.has_distance, with_distance != 0);
        const double camera[3] = {498, 503, 491};
        float center[3];
        uint32_t visible[ANCHORS];
        for (size_t k = 0; k < 3; k++)
            center[k] = (float)(camera[k] - m.origin[k]);
        for (uint32_t a = 0; a < ANCHORS; a++)
            visible[a] = a;
        gaussians g = {0};
        decode_tape tape = {0};
        assert_ok(decode_forward(&m.anchors, &m.decoder, center, visible, ANCHORS, 0, &g, &tape, NULL));
        size_t at = 0;
        for (size_t a = 0; a < ANCHORS; a++) {
            double want[OFFSETS][14];
            const size_t kept = decode(a, camera, want);
            for (size_t i = 0; i < kept; i++, at++) {
                assert_true(at < g.count);
                const float got[14] = {g.mean_x[at],  g.mean_y[at],  g.mean_z[at],  g.scale_x[at],
                                       g.scale_y[at], g.scale_z[at], g.quat_w[at],  g.quat_x[at],
                                       g.quat_y[at],  g.quat_z[at],  g.opacity[at], g.red[at],
                                       g.green[at],   g.blue[at]};
                for (size_t k = 0; k < 14; k++) {
                    const double value = (double)got[k] + (k < 3 ? m.origin[k] : 0);
                    if (!(fabs(value - want[i][k]) < 2e-5))
                        fail_msg("anchor %zu, Gaussian %zu, value %zu: %g, not %g", a, i, k, value,
                                 want[i][k]);
                }
            }
        }
        assert_int_equal(at, g.count);
        assert_true(at > ANCHORS && at < ANCHORS * OFFSETS);
        gaussians_free(&g);
        decode_tape_free(&tape);
        model_free(&m);
    }
}

/* ---- what is wrong ---- */

static void refused(const char *says, gbt_status status)
{
    model m;
    size_t dropped;
    gbt_error err = {0};
    assert_int_equal(scaffold_file_read(in_folder("point_cloud.ply"), &m, &dropped, &err), status);
    if (strstr(err.text, says) == NULL || strchr(err.text, '\n') != NULL)
        fail_msg("wanted \"%s\", got \"%s\"", says, err.text);
    assert_null(m.anchors.position);
}

static void says_what_is_wrong(void **state)
{
    (void)state;
    write_model(0);
    unlink(in_folder("cov_mlp.safetensors"));
    refused("cov_mlp.safetensors: cannot open", GBT_ERR_IO);
    write_text(in_folder("cov_mlp.pt"), "");
    refused("torch.jit.load(n + '_mlp.pt', 'cpu')", GBT_ERR_IO);
    unlink(in_folder("cov_mlp.pt"));
    write_text(in_folder("checkpoints.pth"), "");
    refused("torch.load('checkpoints.pth', 'cpu').items()]\"", GBT_ERR_IO);
    unlink(in_folder("checkpoints.pth"));
    write_network(1);
    write_text(in_folder("feature_bank_mlp.pt"), "");
    refused("a feature bank is not supported", GBT_ERR_FORMAT);
    unlink(in_folder("feature_bank_mlp.pt"));
    write_text(in_folder("mlp_feature_bank.safetensors"), "");
    refused("mlp_feature_bank.safetensors: a feature bank is not supported", GBT_ERR_FORMAT);
    unlink(in_folder("mlp_feature_bank.safetensors"));
    scaffold.first[2].in = 36 + 32;
    scaffold.first[2].out = 16;
    write_network(2);
    refused("an appearance embedding is not supported", GBT_ERR_FORMAT);
    scaffold.first[2].in = 35;
    write_network(2);
    refused("array 0.weight is 16 x 35 (wanted 32 x 35)", GBT_ERR_FORMAT);
    scaffold.first[2].out = HIDDEN;
    scaffold.second[2].bias[3] = (double)NAN;
    write_network(2);
    refused("array 2.bias: value 3 is not finite", GBT_ERR_FORMAT);
    write_text(in_folder("point_cloud.ply"),
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
               "y\nproperty float z\nend_header\n1 2 3\n");
    refused("no number f_anchor_feat_0 (wanted anchors of Scaffold-GS)", GBT_ERR_FORMAT);
}

/* Cut off or flipped anywhere, a file of arrays is refused in one line, or read with values that are
   finite. */
static void damaged_arrays(void **state)
{
    (void)state;
    static const char header[] = "{\"a\":{\"dtype\":\"F32\",\"shape\":[2,2],\"data_offsets\":[0,16]},\"b\":{"
                                 "\"dtype\":\"F32\",\"shape\":[1],\"data_offsets\":[16,20]}}";
    sink s = {0};
    sink_put_uint(&s, sizeof header - 1, 8);
    sink_put_text(&s, header);
    for (int i = 0; i < 5; i++)
        sink_put_f32(&s, (float)i);
    size_t taken = 0, refusals = 0;
    for (size_t at = 0; at < s.size; at++)
        for (unsigned flip = 0; flip < 256; flip += flip == 0 ? 1 : 51) { /* 0: cut off here */
            unsigned char *copy = malloc(s.size);
            memcpy(copy, s.bytes, s.size);
            copy[at] ^= (unsigned char)flip;
            const source_file file = {"variant", copy, flip == 0 ? at : s.size};
            tensor t;
            gbt_error err = {0};
            const gbt_status status = safetensors_read(&file, "a", &t, &err);
            assert_true((status == GBT_OK) == (err.text[0] == '\0') && strchr(err.text, '\n') == NULL);
            for (size_t i = 0; status == GBT_OK && i < t.rows * t.columns; i++)
                assert_true(isfinite(t.values[i]));
            taken += status == GBT_OK;
            refusals += status == GBT_ERR_FORMAT;
            mem_free(t.values);
            free(copy);
        }
    assert_true(taken > 20 && refusals > 200);
    const source_file file = {"whole", s.bytes, s.size};
    tensor t;
    assert_ok(safetensors_read(&file, "b", &t, NULL));
    assert_true(t.rows == 1 && t.columns == 1 && t.values[0] == 4);
    mem_free(t.values);
    assert_int_equal(safetensors_read(&file, "c", &t, NULL), GBT_ERR_FORMAT);
    sink_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(decodes_to_the_same_gaussians),
        cmocka_unit_test(says_what_is_wrong),
        cmocka_unit_test(damaged_arrays),
    };
    return cmocka_run_group_tests_name("scaffold files", tests, folder_make, folder_remove);
}
