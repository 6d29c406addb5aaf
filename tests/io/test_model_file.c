/* SPDX-License-Identifier: Apache-2.0 */
/* tests/io/test_model_file.c -- a model survives the file bit for bit; a damaged or impossible one is refused
   with its section. */
#include <math.h>

#include "base/rng.h"
#include "folder.h"
#include "io/model_file.h"

static void fill_values(float *values, size_t count, uint64_t stream)
{
    for (size_t i = 0; i < count; i++)
        values[i] = (float)rng_normal(7, stream, i);
}

static void make_model(model *m, size_t count, int offset_count, bool has_distance)
{
    *m = (model){.anchors.offset_count = offset_count,
                 .origin = {5e5, -4.5e6, 0.1},
                 .voxel_size = 0.02f,
                 .extent = 3.5f,
                 .background = {0.0f, 0.5f, 1.0f},
                 .t_near = 0.01f,
                 .data_folder = "photos/some folder",
                 .config = "seed = 1\ninit = gb\n",
                 .iterations = UINT64_C(1) << 40};
    assert_ok(anchors_resize(&m->anchors, count, NULL));
    fill_values(m->anchors.position, count * 3, 1);
    fill_values(m->anchors.feature, count * ANCHOR_FEATURE_DIM, 2);
    fill_values(m->anchors.offset, count * (size_t)offset_count * 3, 3);
    fill_values(m->anchors.scale_log, count * 6, 4);
    if (has_distance) { /* every second model has what is optional */
        m->anchor_pixel = mem_alloc(count, sizeof *m->anchor_pixel, "test", NULL);
        for (size_t i = 0; i < count; i++)
            m->anchor_pixel[i] = rng_uniform(7, 5, i);
        m->sky.varies = true;
        fill_values(m->sky.harmonic[0], 3 * SKY_HARMONICS, 6);
        m->sky.has_horizon = true;
        fill_values(m->sky.up, 3, 7);
        fill_values(m->sky.ground, 3, 8);
    }
    assert_ok(decoder_init(&m->decoder, offset_count, has_distance, 9, NULL));
    m->decoder.distance_scale = 0.25f;
    m->decoder.distance_min = 0.5f;
    m->decoder.distance_max = INFINITY;
}

static void check_same(const model *a, const model *b)
{
    const size_t n = a->anchors.count, k = (size_t)a->anchors.offset_count;
    assert_int_equal(b->anchors.count, n);
    assert_int_equal(b->anchors.offset_count, k);
    if (n > 0) {
        assert_memory_equal(a->anchors.position, b->anchors.position, n * 12);
        assert_memory_equal(a->anchors.feature, b->anchors.feature, n * ANCHOR_FEATURE_DIM * 4);
        assert_memory_equal(a->anchors.offset, b->anchors.offset, n * k * 12);
        assert_memory_equal(a->anchors.scale_log, b->anchors.scale_log, n * 24);
    }
    assert_true((a->anchor_pixel == NULL) == (b->anchor_pixel == NULL));
    if (a->anchor_pixel != NULL && n > 0)
        assert_memory_equal(a->anchor_pixel, b->anchor_pixel, n * 4);
    assert_int_equal(a->decoder.offset_count, b->decoder.offset_count);
    assert_int_equal(a->decoder.has_distance, b->decoder.has_distance);
    assert_true(a->decoder.distance_scale == b->decoder.distance_scale);
    assert_true(a->decoder.distance_min == b->decoder.distance_min);
    assert_true(a->decoder.distance_max == b->decoder.distance_max);
    assert_int_equal(a->decoder.param_count, b->decoder.param_count);
    assert_memory_equal(a->decoder.params, b->decoder.params, a->decoder.param_count * 4);
    assert_memory_equal(a->origin, b->origin, sizeof a->origin);
    assert_memory_equal(a->background, b->background, sizeof a->background);
    assert_int_equal(a->sky.varies, b->sky.varies);
    assert_memory_equal(a->sky.harmonic, b->sky.harmonic, sizeof a->sky.harmonic);
    assert_int_equal(a->sky.has_horizon, b->sky.has_horizon);
    assert_memory_equal(a->sky.up, b->sky.up, sizeof a->sky.up);
    assert_memory_equal(a->sky.ground, b->sky.ground, sizeof a->sky.ground);
    assert_true(a->voxel_size == b->voxel_size && a->extent == b->extent && a->t_near == b->t_near);
    assert_string_equal(a->data_folder, b->data_folder);
    assert_string_equal(a->config, b->config);
    assert_true(a->iterations == b->iterations);
}

typedef struct shape_case {
    const char *name;
    size_t count;
    int offset_count;
    bool has_distance;
} shape_case;

static shape_case shape_cases[] = {
    {"round trip: 300 anchors, 10 offsets", 300, 10, false},
    {"round trip: with distance", 7, 10, true},
    {"round trip: 1 anchor, 1 offset", 1, 1, false},
    {"round trip: most offsets", 5, ANCHOR_MAX_OFFSETS, true},
    {"round trip: no anchor", 0, 10, false},
};

static void round_trip(void **state)
{
    const shape_case *row = *state;
    model m, back;
    make_model(&m, row->count, row->offset_count, row->has_distance);
    assert_ok(model_save(in_folder("m.gbt"), &m, NULL));
    assert_ok(model_load(in_folder("m.gbt"), &back, NULL));
    check_same(&m, &back);
    model_free(&back);
    assert_null(back.anchors.position);
    model_free(&m);
}

static void same_model_same_bytes(void **state)
{
    (void)state;
    model m, back;
    make_model(&m, 20, 10, true);
    assert_ok(model_save(in_folder("a.gbt"), &m, NULL));
    assert_ok(model_load(in_folder("a.gbt"), &back, NULL));
    assert_ok(model_save(in_folder("b.gbt"), &back, NULL));
    assert_same_file(in_folder("a.gbt"), in_folder("b.gbt"));
    model_free(&m);
    model_free(&back);
}

/* ---- models that must not be saved, and files with good checksums that must not be loaded ---- */

static void spoil_position(model *m) { m->anchors.position[5] = NAN; }
static void spoil_feature(model *m) { m->anchors.feature[0] = INFINITY; }
static void spoil_offset(model *m) { m->anchors.offset[3 * 10 * 3 - 1] = -INFINITY; }
static void spoil_scale(model *m) { m->anchors.scale_log[17] = NAN; }
static void spoil_params(model *m) { m->decoder.params[m->decoder.param_count - 1] = NAN; }
static void spoil_param_count(model *m) { m->decoder.param_count--; }
static void spoil_has_distance(model *m) { m->decoder.has_distance = !m->decoder.has_distance; }
static void spoil_origin(model *m) { m->origin[2] = NAN; }
static void spoil_voxel(model *m) { m->voxel_size = -1.0f; }
static void spoil_extent(model *m) { m->extent = INFINITY; }
static void spoil_near(model *m) { m->t_near = NAN; }
static void spoil_background(model *m) { m->background[1] = NAN; }
static void spoil_distance_scale(model *m) { m->decoder.distance_scale = INFINITY; }
static void spoil_distance_max(model *m) { m->decoder.distance_max = NAN; }

typedef struct spoil_case {
    const char *name;
    void (*spoil)(model *m);
    const char *message;
} spoil_case;

static spoil_case spoil_cases[] = {
    {"position", spoil_position, "section anchor.position: value 5 is not finite"},
    {"feature", spoil_feature, "section anchor.feature: value 0 is not finite"},
    {"offset", spoil_offset, "section anchor.offset: value 89 is not finite"},
    {"scale", spoil_scale, "section anchor.scale_log: value 17 is not finite"},
    {"decoder weights", spoil_params, "section decoder.params: value"},
    {"too few weights", spoil_param_count, "section decoder.params does not fit 10 offsets per anchor"},
    {"weights of another network", spoil_has_distance,
     "section decoder.params does not fit 10 offsets per anchor"},
    {"origin", spoil_origin, "section scene.origin: value 2 is not finite"},
    {"voxel size", spoil_voxel, "section scene.numbers: a length is negative"},
    {"extent", spoil_extent, "section scene.numbers: value 0 is not finite"},
    {"near", spoil_near, "section scene.numbers: value 0 is not finite"},
    {"background", spoil_background, "section scene.numbers: value 1 is not finite"},
    {"distance scale", spoil_distance_scale, "section decoder.numbers: value 0 is not finite"},
    {"distance range", spoil_distance_max,
     "section decoder.numbers: the trained range of distances is not a number"},
};

static void spoiled(void **state)
{
    const spoil_case *row = *state;
    model m, back;
    make_model(&m, 3, 10, false);
    assert_ok(model_save(in_folder("good.gbt"), &m, NULL));
    row->spoil(&m);
    gbt_error err = {0};
    assert_int_equal(model_save(in_folder("bad.gbt"), &m, &err), GBT_ERR_ARGUMENT);
    if (strstr(err.text, row->message) == NULL)
        fail_msg("save: \"%s\" is not \"%s\"", err.text, row->message);
    assert_false(file_exists(in_folder("bad.gbt")));
    container_writer w = {0}; /* past model_save()'s check, as a forger would */
    model_add(&w, &m);
    assert_ok(container_save(&w, in_folder("bad.gbt"), NULL));
    container_writer_free(&w);
    memset(&back, 0x55, sizeof back);
    err = (gbt_error){0};
    assert_int_equal(model_load(in_folder("bad.gbt"), &back, &err), GBT_ERR_FORMAT);
    if (strstr(err.text, row->message) == NULL || strstr(err.text, "bad.gbt: ") == NULL)
        fail_msg("load: \"%s\" is not \"%s\"", err.text, row->message);
    assert_null(back.anchors.position);
    assert_null(back.decoder.params);
    unlink(in_folder("bad.gbt"));
    model_free(&m);
}

/** Files that hold all but one section, or one of another shape. */
static void every_section_is_needed(void **state)
{
    (void)state;
    model m;
    make_model(&m, 3, 10, false);
    container_writer whole = {0};
    model_add(&whole, &m);
    assert_int_equal(whole.count, 12);
    for (size_t left_out = 0; left_out < whole.count; left_out++) {
        const char *name = whole.sections[left_out].name;
        for (int empty = 0; empty < 2; empty++) {
            if (empty == 1 && (strcmp(name, "train.config") == 0 || strcmp(name, "scene.data_folder") == 0))
                continue; /* an empty text is a text */
            container_writer w = {0};
            for (size_t i = 0; i < whole.count; i++) {
                const container_section *s = &whole.sections[i];
                if (i != left_out)
                    container_add(&w, s->name, s->dtype, s->dim_count, s->dims,
                                  s->data != NULL ? s->data : s->small);
                else if (empty == 1)
                    container_add(&w, s->name, s->dtype, 1, (size_t[]){0}, NULL);
            }
            assert_ok(container_save(&w, in_folder("part.gbt"), NULL));
            container_writer_free(&w);
            model back;
            gbt_error err = {0};
            assert_int_equal(model_load(in_folder("part.gbt"), &back, &err), GBT_ERR_FORMAT);
            if (strstr(err.text, name) == NULL)
                fail_msg("without %s: \"%s\"", name, err.text);
        }
    }
    container_writer_free(&whole);
    model_free(&m);
}

static void shapes_that_disagree(void **state)
{
    (void)state;
    const float zeros[17 * 3 * 4] = {0};
    const struct {
        size_t positions, features, offsets, k;
        const char *message;
    } rows[] = {
        {4, 3, 4, 1, "section anchor.feature has another shape (wanted f32[4][32], got f32[3][32])"},
        {3, 3, 4, 1, "section anchor.offset has another shape (wanted f32[3][*][3], got f32[4][1][3])"},
        {1, 1, 1, 0, "section anchor.offset: bad number of offsets per anchor (wanted 1 to 16, got 0)"},
        {1, 1, 1, 17, "section anchor.offset: bad number of offsets per anchor (wanted 1 to 16, got 17)"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        container_writer w = {0};
        container_add(&w, "anchor.position", CONTAINER_F32, 2, (size_t[]){rows[i].positions, 3}, zeros);
        container_add(&w, "anchor.feature", CONTAINER_F32, 2, (size_t[]){rows[i].features, 32}, zeros);
        container_add(&w, "anchor.offset", CONTAINER_F32, 3, (size_t[]){rows[i].offsets, rows[i].k, 3},
                      zeros);
        container_add(&w, "anchor.scale_log", CONTAINER_F32, 2, (size_t[]){rows[i].positions, 6}, zeros);
        assert_ok(container_save(&w, in_folder("odd.gbt"), NULL));
        container_writer_free(&w);
        model back;
        gbt_error err = {0};
        assert_int_equal(model_load(in_folder("odd.gbt"), &back, &err), GBT_ERR_FORMAT);
        if (strstr(err.text, rows[i].message) == NULL)
            fail_msg("row %zu: \"%s\"", i, err.text);
    }
}

static void every_flipped_byte_is_found(void **state)
{
    (void)state;
    model m, back;
    make_model(&m, 2, 1, false);
    assert_ok(model_save(in_folder("m.gbt"), &m, NULL));
    unsigned char *bytes;
    size_t byte_count;
    assert_ok(file_read(in_folder("m.gbt"), &bytes, &byte_count, NULL));
    for (size_t i = 0; i < byte_count; i++) {
        bytes[i] ^= 0x40;
        container c;
        gbt_status status = container_parse(bytes, byte_count, "m.gbt", &c, NULL);
        if (status == GBT_OK) {
            status = model_from_container(&c, &back, NULL);
            container_free(&c);
        }
        if (status != GBT_ERR_FORMAT)
            fail_msg("byte %zu: status %d", i, (int)status);
        bytes[i] ^= 0x40;
    }
    mem_free(bytes);
    model_free(&m);
}

static void no_memory(void **state)
{
    (void)state;
    model m;
    make_model(&m, 3, 10, false);
    bool worked = false;
    for (long n = 0; n < 64 && !worked; n++) {
        model back;
        gbt_error err = {0};
        mem_fail_after(n);
        gbt_status status = model_save(in_folder("memory.gbt"), &m, &err);
        const bool saved = status == GBT_OK;
        if (saved)
            status = model_load(in_folder("memory.gbt"), &back, &err);
        mem_fail_after(-1);
        worked = status == GBT_OK;
        if (!worked) {
            assert_int_equal(status, GBT_ERR_NO_MEMORY);
            assert_int_not_equal(err.text[0], '\0');
        } else {
            assert_true(n >= 9); /* 5 growing sections lists or image, file, sections, 4 arrays, weights: at
                                    least these */
            check_same(&m, &back);
        }
        if (saved)
            model_free(&back);
    }
    assert_true(worked);
    model_free(&m);
}

static void texts_up_to_their_size(void **state)
{
    (void)state;
    model m, back;
    make_model(&m, 1, 1, false);
    memset(m.config, 'c', MODEL_CONFIG_SIZE - 1);
    memset(m.data_folder, 'f', MODEL_FOLDER_SIZE - 1);
    assert_ok(model_save(in_folder("m.gbt"), &m, NULL));
    assert_ok(model_load(in_folder("m.gbt"), &back, NULL));
    check_same(&m, &back);
    model_free(&m);
    model_free(&back);
}

static void missing_file(void **state)
{
    (void)state;
    model back;
    gbt_error err = {0};
    assert_int_equal(model_load("/nonexistent/m.gbt", &back, &err), GBT_ERR_IO);
    assert_string_equal(err.text, "/nonexistent/m.gbt: cannot open: No such file or directory");
}

int main(void)
{
    enum {
        SHAPES = sizeof shape_cases / sizeof *shape_cases,
        SPOILS = sizeof spoil_cases / sizeof *spoil_cases
    };
    static char names[SPOILS][80];
    struct CMUnitTest tests[7 + SHAPES + SPOILS] = {
        cmocka_unit_test(same_model_same_bytes),
        cmocka_unit_test(every_section_is_needed),
        cmocka_unit_test(shapes_that_disagree),
        cmocka_unit_test(every_flipped_byte_is_found),
        cmocka_unit_test(no_memory),
        cmocka_unit_test(texts_up_to_their_size),
        cmocka_unit_test(missing_file),
    };
    size_t count = 7;
    for (size_t i = 0; i < SHAPES; i++)
        tests[count++] = (struct CMUnitTest){
            .name = shape_cases[i].name, .test_func = round_trip, .initial_state = &shape_cases[i]};
    for (size_t i = 0; i < SPOILS; i++) {
        snprintf(names[i], sizeof names[i], "spoiled: %s", spoil_cases[i].name);
        tests[count++] =
            (struct CMUnitTest){.name = names[i], .test_func = spoiled, .initial_state = &spoil_cases[i]};
    }
    return _cmocka_run_group_tests("model_file", tests, count, folder_make, folder_remove);
}
