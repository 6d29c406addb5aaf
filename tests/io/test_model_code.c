/* SPDX-License-Identifier: Apache-2.0 */
/* tests/io/test_model_code.c -- small model files: what comes back, how far it is from what went in, and what
   damage does. */
#include <math.h>

#include "anchor/decode.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "folder.h"
#include "io/model_code.h"
#include "io/model_file.h"
#include "io/model_steps.h"

/* Values in [-1, 1) times `scale`: no function of the C library, so that every machine makes the same. */
static void fill(float *values, size_t count, uint64_t stream, float scale)
{
    for (size_t i = 0; i < count; i++)
        values[i] = scale * (2 * rng_uniform(7, stream, i) - 1);
}

static void make_model(model *m, size_t count, int offset_count, bool has_distance)
{
    *m = (model){.anchors.offset_count = offset_count,
                 .origin = {5, -4, 1},
                 .voxel_size = 0.02f,
                 .extent = 3,
                 .t_near = 0.01f,
                 .data_folder = "nowhere",
                 .config = "seed = 1\n"};
    assert_ok(anchors_resize(&m->anchors, count, NULL));
    fill(m->anchors.position, count * 3, 1, 5);
    fill(m->anchors.feature, count * ANCHOR_FEATURE_DIM, 2, 1);
    fill(m->anchors.offset, count * (size_t)offset_count * 3, 3, 0.5f);
    fill(m->anchors.scale_log, count * 6, 4, 1);
    for (size_t i = 0; i < count * 6; i++)
        m->anchors.scale_log[i] -= 3;
    if (has_distance) {
        m->anchor_pixel = mem_alloc(count, sizeof *m->anchor_pixel, "test", NULL);
        assert_non_null(m->anchor_pixel);
        for (size_t i = 0; i < count; i++)
            m->anchor_pixel[i] = i % 7 == 0 ? 0 : 0.01f * (1 + rng_uniform(7, 5, i));
    }
    assert_ok(decoder_init(&m->decoder, offset_count, has_distance, 9, NULL));
    m->decoder.distance_scale = 0.25f;
    m->decoder.distance_max = INFINITY;
}

/* The same steps on every machine; model_steps_at() goes through the C library's functions. */
static void make_steps(model_steps *s, size_t count, bool with_doublings)
{
    *s = (model_steps){.position = 0.01, .count = count};
    for (size_t i = 0; i < ANCHOR_FEATURE_DIM; i++)
        s->field[ANCHOR_FEATURE][i] = 0.0625f * (float)(1 + i % 5);
    for (size_t i = 0; i < ANCHOR_MAX_OFFSETS * 3; i++)
        s->field[ANCHOR_OFFSET][i] = 0.03125f;
    for (size_t i = 0; i < 6; i++)
        s->field[ANCHOR_SCALE_LOG][i] = 0.046875f;
    s->doubling = with_doublings ? mem_calloc(count, 1, "test", NULL) : NULL;
    for (size_t i = 0; with_doublings && i < count; i++)
        s->doubling[i] = (uint8_t)(rng_uniform(7, 8, i) * 3);
}

/* ---- what comes back ---- */

/* Every anchor of the small model next to the one that it was made of: nearest position, then nearest
   features. */
static size_t find_anchor(const model *m, const model *small, size_t i, double cell)
{
    size_t best = SIZE_MAX;
    double least = INFINITY;
    for (size_t j = 0; j < m->anchors.count; j++) {
        double apart = 0;
        for (size_t k = 0; k < 3; k++)
            apart = fmax(apart, fabs((double)m->anchors.position[3 * j + k] -
                                     (double)small->anchors.position[3 * i + k]));
        if (apart > 0.501 * cell + 1e-5)
            continue;
        double sum = 0;
        for (size_t k = 0; k < ANCHOR_FEATURE_DIM; k++)
            sum += fabs((double)m->anchors.feature[j * ANCHOR_FEATURE_DIM + k] -
                        (double)small->anchors.feature[i * ANCHOR_FEATURE_DIM + k]);
        if (sum < least) {
            least = sum;
            best = j;
        }
    }
    return best;
}

static void check_row(const float *from, const float *to, const float *steps, size_t width, int doubling)
{
    for (size_t c = 0; c < width; c++) {
        const double apart = fabs((double)from[c] - (double)to[c]);
        if (apart > 0.50001 * (double)steps[c] * (1 << doubling) + 1e-6)
            fail_msg("channel %d is %g away, of a step of %g", (int)c, apart,
                     (double)steps[c] * (1 << doubling));
    }
}

typedef struct shape_case {
    const char *name;
    size_t count;
    int offset_count;
    bool has_distance, with_doublings;
} shape_case;

static shape_case shape_cases[] = {
    {"K = 2, pixels, steps of every anchor", 900, 2, true, true},
    {"K = 10", 200, 10, false, true},
    {"K = 16", 50, 16, true, false},
    {"K = 1", 300, 1, false, false},
    {"2 anchors", 2, 2, true, true},
    {"1 anchor", 1, 3, true, true},
    {"no anchor", 0, 2, true, true},
    {"K = 5", 100, 5, true, true},
};

static void rounded_by_half_a_step(void **state)
{
    const shape_case *row = *state;
    model m, back;
    model_steps steps;
    model_sizes sizes;
    make_model(&m, row->count, row->offset_count, row->has_distance);
    make_steps(&steps, row->count, row->with_doublings);
    assert_ok(model_save_coded(in_folder("small.gbt"), &m, &steps, &sizes, NULL));
    assert_ok(model_load(in_folder("small.gbt"), &back, NULL));
    assert_int_equal(back.anchors.count, row->count);
    assert_int_equal(back.anchors.offset_count, row->offset_count);
    assert_true((back.anchor_pixel != NULL) == row->has_distance);
    assert_int_equal(back.decoder.param_count, m.decoder.param_count);
    const size_t k3 = 3 * (size_t)row->offset_count;
    for (size_t i = 0; i < row->count; i++) {
        const size_t j = find_anchor(&m, &back, i, steps.position);
        assert_true(j != SIZE_MAX);
        const int d = row->with_doublings ? steps.doubling[j] : 0;
        check_row(m.anchors.feature + j * ANCHOR_FEATURE_DIM, back.anchors.feature + i * ANCHOR_FEATURE_DIM,
                  steps.field[ANCHOR_FEATURE], ANCHOR_FEATURE_DIM, d);
        check_row(m.anchors.offset + j * k3, back.anchors.offset + i * k3, steps.field[ANCHOR_OFFSET], k3, d);
        check_row(m.anchors.scale_log + j * 6, back.anchors.scale_log + i * 6, steps.field[ANCHOR_SCALE_LOG],
                  6, d);
        if (row->has_distance && m.anchor_pixel[j] > 0)
            assert_true(fabs(log2((double)back.anchor_pixel[i] / (double)m.anchor_pixel[j])) < 0.0626);
        else if (row->has_distance)
            assert_true(back.anchor_pixel[i] == 0);
    }
    for (size_t i = 0; i < m.decoder.param_count; i++)
        assert_true(fabs((double)back.decoder.params[i] - (double)m.decoder.params[i]) <=
                    fabs((double)m.decoder.params[i]) / 2048 + 1e-7);
    size_t parts = sizes.positions + sizes.features + sizes.offsets + sizes.scales + sizes.pixels +
                   sizes.steps + sizes.networks;
    assert_true(parts < sizes.total && sizes.total < parts + 3000);
    unsigned char *bytes;
    size_t byte_count;
    assert_ok(file_read(in_folder("small.gbt"), &bytes, &byte_count, NULL));
    assert_int_equal(byte_count, sizes.total);
    mem_free(bytes);
    model_steps_free(&steps);
    model_free(&m);
    model_free(&back);
}

/* A step grows where the largest value has more steps than a coded number holds. */
static void large_values_get_larger_steps(void **state)
{
    (void)state;
    const float large[3] = {3e8f, -2e7f, 5e6f};
    const size_t at[3] = {40 * ANCHOR_FEATURE_DIM + 5, 40 * 6 + 5, 40 * 6 + 1};
    model m, back;
    model_steps steps;
    model_sizes sizes;
    make_model(&m, 50, 2, false);
    make_steps(&steps, 50, false);
    m.anchors.feature[at[0]] = large[0];
    m.anchors.offset[at[1]] = large[1];
    m.anchors.offset[at[2]] = large[2];
    assert_ok(model_save_coded(in_folder("large.gbt"), &m, &steps, &sizes, NULL));
    assert_ok(model_load(in_folder("large.gbt"), &back, NULL));
    double apart[3] = {INFINITY, INFINITY, INFINITY}; /* anchors come in another order */
    for (size_t i = 0; i < 50; i++) {
        const float values[3] = {back.anchors.feature[i * ANCHOR_FEATURE_DIM + 5],
                                 back.anchors.offset[i * 6 + 5], back.anchors.offset[i * 6 + 1]};
        for (int k = 0; k < 3; k++)
            apart[k] = fmin(apart[k], fabs((double)values[k] - (double)large[k]));
    }
    for (int k = 0; k < 3; k++)
        assert_true(apart[k] <= fabs((double)large[k]) * 0x1p-20);
    model_steps_free(&steps);
    model_free(&m);
    model_free(&back);
}

static void lossless_keeps_bits_and_order(void **state)
{
    const shape_case *row = *state;
    model m, back;
    make_model(&m, row->count, row->offset_count, row->has_distance);
    if (row->count > 0) {
        m.anchors.feature[0] = -0.0f;
        m.anchors.offset[0] = 1e-42f;
        m.anchors.position[0] = 3e38f;
    }
    assert_ok(model_save(in_folder("plain.gbt"), &m, NULL));
    assert_ok(model_save_coded(in_folder("small.gbt"), &m, NULL, NULL, NULL));
    assert_ok(model_load(in_folder("small.gbt"), &back, NULL));
    assert_ok(model_save(in_folder("again.gbt"), &back, NULL));
    assert_same_file(in_folder("plain.gbt"), in_folder("again.gbt"));
    model_free(&m);
    model_free(&back);
}

/* Coordinates of every size, many anchors at one place, constants: what comes back codes to itself. */
static void odd_models(void **state)
{
    (void)state;
    for (int kind = 0; kind < 6; kind++) {
        model m, back, twice;
        model_steps steps;
        make_model(&m, 200, 2, true);
        make_steps(&steps, 200, true);
        for (size_t i = 0; i < 600; i++) {
            float *p = &m.anchors.position[i];
            *p = kind == 0             ? *p * 1e30f
                 : kind == 1           ? *p * 1e-30f
                 : kind == 2           ? 1.5f
                 : kind == 3           ? (float)(i % 3)
                 : kind == 4 && i == 7 ? 1e7f
                                       : *p;
        }
        if (kind == 5) {
            memset(m.anchors.feature, 0, 200 * ANCHOR_FEATURE_DIM * sizeof(float));
            m.anchors.offset[5] = 1e30f, m.anchors.scale_log[3] = -1e20f, m.decoder.params[2] = 1e9f,
            m.anchor_pixel[1] = 1e-45f, m.anchor_pixel[2] = 3e38f;
        }
        assert_ok(model_save_coded(in_folder("small.gbt"), &m, &steps, NULL, NULL));
        assert_ok(model_load(in_folder("small.gbt"), &back, NULL));
        mem_free(steps.doubling);
        steps.doubling = NULL;
        assert_ok(model_save_coded(in_folder("small.gbt"), &back, &steps, NULL, NULL));
        assert_ok(model_load(in_folder("small.gbt"), &twice, NULL));
        assert_int_equal(twice.anchors.count, 200);
        if (kind != 5)
            assert_memory_equal(back.anchors.feature, twice.anchors.feature, sizeof(float)); /* multiples of a
                                                                                                step stay */
        model_steps_free(&steps);
        model_free(&m);
        model_free(&back);
        model_free(&twice);
    }
}

/* ---- the format ---- */

static uint64_t hash_model(const model *m)
{
    const size_t n = m->anchors.count;
    uint64_t h = hash_bytes(HASH_START, m->anchors.position, n * 12);
    h = hash_bytes(h, m->anchors.feature, n * 128);
    h = hash_bytes(h, m->anchors.offset, n * (size_t)m->anchors.offset_count * 12);
    h = hash_bytes(h, m->anchors.scale_log, n * 24);
    h = hash_bytes(h, m->anchor_pixel, n * 4);
    return hash_bytes(h, m->decoder.params, m->decoder.param_count * 4);
}

/* Files that exist must stay readable: if these change, the format has, and needs a new number of its
   form. */
#define GOLDEN_BYTES UINT64_C(0x73319de7b7e4a132)
#define GOLDEN_VALUES UINT64_C(0x7dba4383d3e276be)

static void the_format_has_not_changed(void **state)
{
    (void)state;
    model m, back;
    model_steps steps;
    model_coded coded = {0};
    make_model(&m, 500, 2, true);
    make_steps(&steps, 500, true);
    assert_ok(model_code(&m, &steps, &coded, &back, NULL));
    size_t size = 0;
    for (int part = 0; part < CODE_PARTS; part++)
        size += coded.part_bytes[part];
    const uint64_t bytes = hash_bytes(HASH_START, coded.bytes, size), values = hash_model(&back);
    if (bytes != GOLDEN_BYTES || values != GOLDEN_VALUES)
        fail_msg("bytes 0x%016llx, values 0x%016llx", (unsigned long long)bytes, (unsigned long long)values);
    model_coded_free(&coded);
    model_steps_free(&steps);
    model_free(&m);
    model_free(&back);
}

/* Every section but the texts is needed, and no bit of the coded ones may change without a message: checksums
   are made right again. */
static void damage(void **state)
{
    (void)state;
    for (int lossless = 0; lossless < 2; lossless++) {
        model m;
        model_steps steps;
        make_model(&m, 40, 2, true);
        make_steps(&steps, 40, true);
        assert_ok(model_save_coded(in_folder("small.gbt"), &m, lossless ? NULL : &steps, NULL, NULL));
        container c;
        assert_ok(container_load(in_folder("small.gbt"), &c, NULL));
        int refused = 0, taken = 0;
        for (uint64_t round = 0; round < 400; round++) {
            const size_t chosen = (size_t)(rng_uniform(5, 1, round) * 4);
            static const char *const names[] = {"coded.shape", "coded.steps", "coded.parts", "coded.bytes"};
            container_writer w = {0};
            unsigned char *spoiled = NULL;
            for (size_t i = 0; i < c.count; i++) {
                container_section s = c.sections[i];
                if (strcmp(s.name, names[chosen]) == 0 && s.byte_count > 0) {
                    spoiled = malloc(s.byte_count);
                    assert_non_null(spoiled);
                    memcpy(spoiled, s.data, s.byte_count);
                    const size_t at = (size_t)(rng_uniform(5, 2, round) * (float)s.byte_count);
                    spoiled[at < s.byte_count ? at : 0] ^=
                        (unsigned char)(1u << (int)(rng_uniform(5, 3, round) * 8));
                    if (chosen == 3 && round % 4 == 0)
                        s.dims[0] = at; /* cut short */
                    s.data = spoiled;
                }
                container_add(&w, s.name, s.dtype, s.dim_count, s.dims, s.data);
            }
            unsigned char *bytes;
            size_t byte_count;
            assert_ok(container_encode(&w, &bytes, &byte_count, NULL));
            container damaged;
            assert_ok(container_parse(bytes, byte_count, "damaged.gbt", &damaged, NULL));
            model back;
            gbt_error err = {0};
            const gbt_status status = model_from_container(&damaged, &back, &err);
            if (status == GBT_OK) {
                taken++;
                model_free(&back);
            } else {
                refused++;
                assert_int_equal(status, GBT_ERR_FORMAT);
                assert_true(strncmp(err.text, "damaged.gbt: section ", 21) == 0 &&
                            strchr(err.text, '\n') == NULL);
            }
            container_free(&damaged);
            mem_free(bytes);
            free(spoiled);
            container_writer_free(&w);
        }
        assert_true(refused > 100); /* a plain bit of a mantissa is a bit of a mantissa, whichever it is */
        assert_true(taken > 0);
        container_free(&c);
        model_steps_free(&steps);
        model_free(&m);
    }
}

static void forged_shapes(void **state)
{
    (void)state;
    const struct {
        int place;
        uint32_t value;
        const char *message;
    } rows[] = {
        {0, 3, "section coded.shape: coded by another version of gbtrace (wanted form 1 or 2, got 3)"},
        {1, UINT32_MAX, "section coded.shape: 4294967295 anchors cannot be in"},
        {2, 0, "section coded.shape: 0 offsets per anchor"},
        {2, 17, "section coded.shape: 17 offsets per anchor"},
        {3, 2, "pixel sizes 2"},
        {4, 22, "22 levels (wanted 1 to 16, 0 or 1, 0 to 21)"},
    };
    model m, back;
    model_steps steps;
    make_model(&m, 40, 2, true);
    make_steps(&steps, 40, true);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        model_coded coded = {0};
        container_writer w = {0};
        gbt_error err = {0};
        assert_ok(model_code(&m, &steps, &coded, &back, NULL));
        model_free(&back);
        coded.shape[rows[i].place] = rows[i].value;
        model_add_coded(&w, &coded);
        container_add_small(&w, "decoder.has_distance", CONTAINER_U8, 1, &(uint8_t){1});
        container_add_small(&w, "decoder.numbers", CONTAINER_F32, 3, (float[3]){1, 0, 1});
        assert_ok(container_save(&w, in_folder("forged.gbt"), NULL));
        assert_int_equal(model_load(in_folder("forged.gbt"), &back, &err), GBT_ERR_FORMAT);
        if (strstr(err.text, rows[i].message) == NULL)
            fail_msg("row %d: \"%s\"", (int)i, err.text);
        container_writer_free(&w);
        model_coded_free(&coded);
    }
    model_steps_free(&steps);
    model_free(&m);
}

static void no_memory(void **state)
{
    (void)state;
    model m;
    model_steps steps;
    make_model(&m, 30, 2, true);
    make_steps(&steps, 30, true);
    bool worked = false;
    for (long n = 0; n < 400 && !worked; n++) {
        gbt_error err = {0};
        mem_fail_after(n);
        const gbt_status status = model_save_coded(in_folder("small.gbt"), &m, &steps, NULL, &err);
        mem_fail_after(-1);
        worked = status == GBT_OK;
        assert_true(worked ? n > 20 : status == GBT_ERR_NO_MEMORY && err.text[0] != '\0');
    }
    assert_true(worked);
    model_steps_free(&steps);
    model_free(&m);
}

/* ---- steps ---- */

static void decode_from(const model *m, gaussians *out)
{
    decode_tape tape = {0};
    uint32_t visible[1000];
    for (uint32_t i = 0; i < m->anchors.count; i++)
        visible[i] = i;
    assert_ok(decode_forward(&m->anchors, &m->decoder, (float[3]){1, 2, 9}, visible, m->anchors.count, 0, out,
                             &tape, NULL));
    decode_tape_free(&tape);
}

static void transformed_features_decode_the_same(void **state)
{
    (void)state;
    model m;
    model_sensitivity s = {0};
    gaussians before = {0}, after = {0};
    make_model(&m, 600, 2, true);
    for (size_t i = 0; i < 600; i++) /* correlated, and not around 0 */
        m.anchors.feature[i * ANCHOR_FEATURE_DIM + 1] = 0.5f + 2 * m.anchors.feature[i * ANCHOR_FEATURE_DIM];
    assert_ok(model_sensitivity_guess(&m, &s, NULL));
    assert_null(s.anchor);
    decode_from(&m, &before);
    assert_ok(model_transform_features(&m, &s, NULL));
    decode_from(&m, &after);
    assert_int_equal(before.count, after.count);
    for (size_t i = 0; i < before.count; i++) {
        assert_true(fabsf(before.opacity[i] - after.opacity[i]) < 1e-4f);
        assert_true(fabsf(before.red[i] - after.red[i]) < 1e-4f);
        assert_true(fabsf(before.scale_x[i] - after.scale_x[i]) < 1e-4f);
    }
    double last = INFINITY;
    for (size_t c = 0; c < ANCHOR_FEATURE_DIM; c++) { /* uncorrelated, variances falling, mean 0; noise counts
                                                         the same everywhere */
        double square = 0, product = 0, sum = 0;
        for (size_t i = 0; i < 600; i++) {
            const double x = (double)m.anchors.feature[i * ANCHOR_FEATURE_DIM + c],
                         y = (double)m.anchors.feature[i * ANCHOR_FEATURE_DIM + (c + 1) % ANCHOR_FEATURE_DIM];
            sum += x;
            square += x * x;
            product += x * y;
        }
        assert_true(fabs(sum) < 1e-3 * 600 && square <= last * 1.000001 && fabs(product) < 1e-4 * 600);
        last = square;
        for (size_t d = 0; d < ANCHOR_FEATURE_DIM; d++)
            assert_true(s.feature[c][d] == (c == d ? s.feature[0][0] : 0));
    }
    assert_true(last < 1e-6 * 600); /* one direction was told by another */
    gaussians_free(&before);
    gaussians_free(&after);
    model_sensitivity_free(&s);
    model_free(&m);
}

/* 20 dB are a factor of 10 in every step that is not at its limit; threads change nothing. */
static void steps_follow_quality(void **state)
{
    (void)state;
    model m;
    model_sensitivity s = {0}, one = {0};
    model_steps coarse = {0}, fine = {0};
    make_model(&m, 600, 2, true);
    parallel_set_threads(4);
    assert_ok(model_sensitivity_guess(&m, &s, NULL));
    parallel_set_threads(1);
    assert_ok(model_sensitivity_guess(&m, &one, NULL));
    assert_memory_equal(s.feature, one.feature, sizeof s.feature);
    assert_memory_equal(s.field, one.field, sizeof s.field);
    assert_ok(model_steps_at(&m, &s, 40, &coarse, NULL));
    assert_ok(model_steps_at(&m, &s, 60, &fine, NULL));
    for (size_t c = 0; c < ANCHOR_FEATURE_DIM; c++)
        assert_true(fabs((double)coarse.field[ANCHOR_FEATURE][c] / (double)fine.field[ANCHOR_FEATURE][c] -
                         10) < 1e-3 ||
                    coarse.field[ANCHOR_FEATURE][c] >= 0.99f);
    assert_int_equal(model_steps_at(&m, &s, 0, &fine, NULL), GBT_ERR_ARGUMENT);
    assert_int_equal(model_steps_at(&m, &s, NAN, &fine, NULL), GBT_ERR_ARGUMENT);
    s.count--;
    assert_int_equal(model_steps_at(&m, &s, 40, &fine, NULL), GBT_ERR_ARGUMENT);
    model_steps_free(&coarse);
    model_steps_free(&fine);
    model_sensitivity_free(&s);
    model_sensitivity_free(&one);
    model_free(&m);
}

/* Anchors that count less have larger steps; nothing at all counts: steps are still steps. */
static void steps_of_anchors(void **state)
{
    (void)state;
    model m;
    model_sensitivity s = {0};
    model_steps steps = {0};
    anchors gradient = {.offset_count = 2};
    make_model(&m, 4, 2, true);
    assert_ok(anchors_resize(&gradient, 4, NULL));
    assert_ok(model_sensitivity_start(&s, 4, NULL));
    model_sensitivity_end(&s);
    assert_ok(model_steps_at(&m, &s, 50, &steps, NULL));
    for (size_t c = 0; c < ANCHOR_FEATURE_DIM; c++)
        assert_true(steps.field[ANCHOR_FEATURE][c] > 0 && isfinite(steps.field[ANCHOR_FEATURE][c]));
    assert_true(steps.position > 0 && isfinite(steps.position) && steps.field[ANCHOR_OFFSET][5] > 0 &&
                steps.field[ANCHOR_SCALE_LOG][5] > 0);
    model_steps_free(&steps);
    model_sensitivity_free(&s);
    assert_ok(model_sensitivity_start(&s, 4, NULL));
    for (size_t i = 0; i < 4 * ANCHOR_FEATURE_DIM; i++)
        gradient.feature[i] = (const float[]){2, 1, 0.5f, 0}[i / ANCHOR_FEATURE_DIM];
    model_sensitivity_add(&s, &m.anchors, &gradient, 100);
    model_sensitivity_end(&s);
    assert_true(fabs(s.feature[3][7] - (4 + 1 + 0.25) / 4 / 100) < 1e-9);
    assert_ok(model_steps_at(&m, &s, 50, &steps, NULL));
    const int wanted[] = {0, 0, 1, 2}; /* sqrt(5.25 / 4) = 1.15 is the mean: 0.57, 1.15, 2.3, at most 4 of a
                                          step */
    for (size_t i = 0; i < 4; i++)
        assert_int_equal(steps.doubling[i], wanted[i]);
    model_steps_free(&steps);
    model_sensitivity_free(&s);
    anchors_free(&gradient);
    model_free(&m);
}

int main(void)
{
    enum { SHAPES = sizeof shape_cases / sizeof *shape_cases, SINGLE = 9 };
    static char names[2 * SHAPES][96];
    struct CMUnitTest tests[SINGLE + 2 * SHAPES] = {
        cmocka_unit_test(large_values_get_larger_steps),
        cmocka_unit_test(odd_models),
        cmocka_unit_test(the_format_has_not_changed),
        cmocka_unit_test(damage),
        cmocka_unit_test(forged_shapes),
        cmocka_unit_test(no_memory),
        cmocka_unit_test(transformed_features_decode_the_same),
        cmocka_unit_test(steps_follow_quality),
        cmocka_unit_test(steps_of_anchors),
    };
    size_t count = SINGLE;
    for (size_t i = 0; i < 2 * SHAPES; i++, count++) {
        snprintf(names[i], sizeof names[i], "%s: %s", i % 2 ? "lossless" : "rounded by half a step",
                 shape_cases[i / 2].name);
        tests[count] =
            (struct CMUnitTest){.name = names[i],
                                .test_func = i % 2 ? lossless_keeps_bits_and_order : rounded_by_half_a_step,
                                .initial_state = &shape_cases[i / 2]};
    }
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
