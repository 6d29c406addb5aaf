/* SPDX-License-Identifier: Apache-2.0 */
/* tests/scenes/test_world.c -- shapes, patterns and light whose answers are known in closed form. */
#include "test_support.h"

#include "base/memory.h"
#include "scenes/texture.h"
#include "scenes/world.h"

static void white(const surface *s, look *out)
{
    (void)s;
    out->albedo[0] = 0.5f;
    out->albedo[1] = 0.25f;
    out->albedo[2] = 1.0f;
}

static world new_world(void)
{
    return (world){
        .look = white, .epsilon = 1e-4f, .lamp = {.position = {0, 0, 2}, .color = {1, 2, 3}, .exposure = 1}};
}

/** A display value back to the radiance it stands for. */
static double undo_display(double shown) { return -log(1 - pow(shown, 2.2)); }

static void ball_is_hit_where_it_is(void **state)
{
    (void)state;
    world w = new_world();
    world_place(&w, 1, 2, 3, 0.7f);
    world_ball(&w, 5, 9, (const float[3]){0, 0, 0}, 0.5f, 64);
    assert_ok(world_finish(&w, 4));
    for (int i = 0; i < 200; i++) {
        const double a = 0.37 * i, z = -0.95 + 1.9 * i / 199;
        const double out[3] = {sqrt(1 - z * z) * cos(a), sqrt(1 - z * z) * sin(a), z};
        const float origin[3] = {1 + 4 * (float)out[0], 2 + 4 * (float)out[1], 3 + 4 * (float)out[2]};
        const float dir[3] = {-(float)out[0], -(float)out[1], -(float)out[2]};
        surface s;
        assert_true(world_trace(&w, origin, dir, &s));
        assert_float_equal(s.distance, 3.5, 2.7e-3); /* 0.5 (1 - cos(pi / 64) cos(pi / 64)): the polyhedron is
                                                        inside the ball */
        assert_true(s.normal[0] * (float)out[0] + s.normal[1] * (float)out[1] + s.normal[2] * (float)out[2] >
                    0.999f);
        assert_false(s.is_back);
        assert_int_equal(s.material, 5);
        assert_int_equal(s.variant, 9);
    }
    const float center[3] = {1, 2, 3}, up[3] = {0, 0.6f, 0.8f};
    surface s;
    assert_true(world_trace(&w, center, up, &s));
    assert_true(s.is_back);
    assert_true(s.normal[1] * up[1] + s.normal[2] * up[2] < -0.99f); /* turned to the viewer */
    assert_false(world_trace(&w, (const float[3]){1, 2, 3.6f}, (const float[3]){0, 0, 1}, &s));
    world_free(&w);
}

/* name, builder, a ray from (0, 0, 10) moved by x, y straight down, and the height it must find */
static void box_shape(world *w)
{
    world_box(w, 1, 0, (const float[3]){0, 0, 1}, (const float[3]){1, 2, 0.5f}, 0.3f);
}
static void sheet_shape(world *w)
{
    world_sheet(w, 1, 0, (const float[3]){-1, -1, 2}, (const float[3]){2, 0, 0}, (const float[3]){0, 2, 0},
                0.3f);
}
static void torus_shape(world *w) { world_torus(w, 1, (const float[3]){0, 0, 1}, 2, 0.5f, 200, 64); }
static void tube_shape(world *w)
{
    world_tube(w, 1, (const float[3]){-3, 0, 1}, (const float[3]){3, 0, 1}, 0.25f, 64);
}
static void cone_shape(world *w) { world_revolve(w, 1, 0, (const float[][2]){{2, 0}, {0, 1}}, 2, 100); }
static float slope(float x, float y) { return 0.5f * x - 0.25f * y; }
static void field_shape(world *w)
{
    world_field(w, 1, (const float[2]){-2, -2}, (const float[2]){2, 2}, 8, slope);
}

typedef struct shape_case {
    const char *name;
    void (*build)(world *w);
    float x, y;
    double height; /* -1: nothing there */
} shape_case;

static shape_case shape_cases[] = {
    {"box, top", box_shape, 0.3f, -1.7f, 1.5},
    {"box, just outside x", box_shape, 1.01f, 0, -1},
    {"box, just outside y", box_shape, 0, -2.01f, -1},
    {"sheet", sheet_shape, -0.9f, 0.9f, 2},
    {"sheet, outside", sheet_shape, -1.1f, 0.9f, -1},
    {"torus, crest", torus_shape, 0, 2, 1.5},
    {"torus, seam side", torus_shape, 1.6f, 0, 1.3},
    {"torus, hole", torus_shape, 0.2f, 0.2f, -1},
    {"tube", tube_shape, 1, 0, 1.25},
    {"tube, beside", tube_shape, 1, 0.26f, -1},
    {"cone", cone_shape, 1, 0, 0.5},
    {"field", field_shape, 0.7f, -0.4f, 0.45},
};

static void shape_is_where_it_should_be(void **state)
{
    const shape_case *c = *state;
    world w = new_world();
    c->build(&w);
    assert_ok(world_finish(&w, 4));
    surface s;
    const bool is_hit = world_trace(&w, (const float[3]){c->x, c->y, 10}, (const float[3]){0, 0, -1}, &s);
    assert_int_equal(is_hit, c->height >= 0);
    if (is_hit) {
        assert_float_equal(s.position[2], c->height, 3e-3);
        assert_false(s.is_back); /* the outside of every shape is outside */
        assert_true(s.normal[2] > 0);
    }
    world_free(&w);
}

static void lamp_light_is_inverse_square_times_cosine(void **state)
{
    (void)state;
    world w = new_world();
    world_sheet(&w, 0, 0, (const float[3]){-3, -3, 0}, (const float[3]){6, 0, 0}, (const float[3]){0, 6, 0},
                1);
    world_box(&w, 0, 0, (const float[3]){-1, 0, 1}, (const float[3]){0.2f, 0.2f, 0.01f}, 1);
    assert_ok(world_finish(&w, 4));
    /* Without a sky nothing comes back from the lamp's bounces on an open floor. */
    for (int i = 0; i < 20; i++) {
        const float x = 0.05f + 0.1f * (float)i, jitter[2] = {0, 0};
        float rgb[3];
        surface s;
        assert_true(world_trace(&w, (const float[3]){x, -2, 1}, (const float[3]){0, 0, -1}, &s));
        memset(s.indirect, 0, sizeof s.indirect);
        world_shade(&w, &s, (const float[3]){0, 0, -1}, jitter, rgb);
        const double square = (double)x * (double)x + 4 + 4, cosine = 2 / sqrt(square);
        const double want[3] = {0.5 * 1 * cosine / square, 0.25 * 2 * cosine / square,
                                1.0 * 3 * cosine / square};
        for (int k = 0; k < 3; k++)
            assert_float_equal(undo_display((double)rgb[k]), want[k], 2e-4);
    }
    /* Behind the box, seen from the lamp, there is only indirect light. */
    float rgb[3];
    surface s;
    assert_true(world_trace(&w, (const float[3]){-2, 0, 0.5f}, (const float[3]){0, 0, -1}, &s));
    memset(s.indirect, 0, sizeof s.indirect);
    world_shade(&w, &s, (const float[3]){0, 0, -1}, (const float[2]){0, 0}, rgb);
    for (int k = 0; k < 3; k++)
        assert_float_equal(rgb[k], 0, 0);
    world_free(&w);
}

static void open_floor_gathers_the_sky(void **state)
{
    (void)state;
    world w = new_world();
    w.lamp.sky_low[0] = w.lamp.sky_high[0] = 0.7f; /* an even sky: irradiance / pi is the sky itself */
    w.lamp.sky_high[1] = 1;                        /* grows with the cosine: 2/3 of the zenith's */
    world_sheet(&w, 0, 0, (const float[3]){-1, -1, 0}, (const float[3]){2, 0, 0}, (const float[3]){0, 2, 0},
                0.5f);
    assert_ok(world_finish(&w, 256));
    for (size_t i = 0; i < w.vertex_count; i++) {
        assert_float_equal(w.indirect[3 * i], 0.7, 1e-4);
        assert_float_equal(w.indirect[3 * i + 1], 2.0 / 3, 2e-3);
        assert_float_equal(w.indirect[3 * i + 2], 0, 0);
    }
    world_free(&w);
}

static void buried_vertices_take_their_neighbours_light(void **state)
{
    (void)state;
    world w = new_world();
    w.lamp.sky_low[0] = w.lamp.sky_high[0] = 1;
    world_sheet(&w, 0, 0, (const float[3]){-4, -4, 0}, (const float[3]){8, 0, 0}, (const float[3]){0, 8, 0},
                1);
    world_box(&w, 0, 0, (const float[3]){0, 0, 0}, (const float[3]){0.5f, 0.5f, 0.5f}, 1); /* over the middle
                                                                                              vertex */
    assert_ok(world_finish(&w, 64));
    const size_t middle = 4 * 9 + 4;
    assert_float_equal(w.position[3 * middle], 0, 1e-6);
    assert_float_equal(w.position[3 * middle + 1], 0, 1e-6);
    assert_true(w.indirect[3 * middle] > 0.5f);
    world_free(&w);
}

static void patterns_keep_their_ranges(void **state)
{
    (void)state;
    double low = 1, high = -1;
    for (int i = 0; i < 20000; i++) {
        const float x = 0.137f * (float)i - 900, y = -0.731f * (float)(i % 977), z = 0.011f * (float)i;
        const float noise = texture_noise(x, y, z), fbm = texture_fbm(x, y, z, 4),
                    wood = texture_wood(x, y, z), hash = texture_hash(i, -i, 7);
        assert_true(noise >= -1 && noise <= 1 && fbm >= -1 && fbm <= 1 && wood >= -0.01f && wood <= 1.01f &&
                    hash >= 0 && hash < 1);
        low = fmin(low, (double)noise);
        high = fmax(high, (double)noise);
    }
    assert_true(low < -0.9 && high > 0.9);
    assert_float_equal(texture_noise(3, 4, 5), 2 * texture_hash(3, 4, 5) - 1, 1e-6); /* the lattice itself */
    int id[2];
    assert_float_equal(texture_brick(0.5f, 0.5f, 2, 1, id), 0.5, 1e-6);
    assert_true(id[0] == 0 && id[1] == 0);
    assert_float_equal(texture_brick(0.9f, 1.5f, 2, 1, id), 0.1, 1e-5); /* the second row is shifted by half a
                                                                           brick */
    assert_true(id[0] == 1 && id[1] == 0);
    assert_float_equal(texture_step(1, 2, 0.9f), 0, 0);
    assert_float_equal(texture_step(1, 2, 2.1f), 1, 0);
    assert_float_equal(texture_step(1, 2, 1.5f), 0.5, 1e-6);
}

static void letters_are_letters(void **state)
{
    (void)state;
    assert_true(texture_glyph('T', 0.5f, 0.05f)); /* its stem */
    assert_true(texture_glyph('T', 0.0f, 0.99f)); /* its bar */
    assert_false(texture_glyph('T', 0.05f, 0.5f));
    assert_true(texture_glyph('L', 0.0f, 0.5f));
    assert_true(texture_glyph('L', 0.99f, 0.0f));
    assert_false(texture_glyph('L', 0.99f, 0.99f));
    assert_false(texture_glyph('T', 1.0f, 0.99f));
    assert_false(texture_glyph('T', 0.5f, -0.01f));
    assert_false(texture_glyph('T', NAN, 0.5f));
    assert_false(texture_glyph('?', 0.5f, 0.5f));
}

static void no_memory_is_a_status(void **state)
{
    (void)state;
    for (long k = 0;; k++) {
        gbt_error err = {0};
        world w = new_world();
        w.err = &err;
        mem_fail_after(k);
        world_ball(&w, 0, 0, (const float[3]){0, 0, 0}, 1, 12);
        const gbt_status status = world_finish(&w, 1);
        mem_fail_after(-1);
        world_free(&w);
        if (status == GBT_OK) {
            assert_true(k > 6);
            break;
        }
        assert_int_equal(status, GBT_ERR_NO_MEMORY);
        assert_int_equal(err.status, GBT_ERR_NO_MEMORY);
        assert_true(err.text[0] != '\0');
        assert_true(k < 1000);
    }
}

int main(void)
{
    enum { SHAPES = sizeof shape_cases / sizeof shape_cases[0] };
    struct CMUnitTest tests[SHAPES + 7] = {
        cmocka_unit_test(ball_is_hit_where_it_is),
        cmocka_unit_test(lamp_light_is_inverse_square_times_cosine),
        cmocka_unit_test(open_floor_gathers_the_sky),
        cmocka_unit_test(buried_vertices_take_their_neighbours_light),
        cmocka_unit_test(patterns_keep_their_ranges),
        cmocka_unit_test(letters_are_letters),
        cmocka_unit_test(no_memory_is_a_status),
    };
    for (int i = 0; i < SHAPES; i++)
        tests[7 + i] = (struct CMUnitTest){.name = shape_cases[i].name,
                                           .test_func = shape_is_where_it_should_be,
                                           .initial_state = &shape_cases[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
