/* SPDX-License-Identifier: Apache-2.0 */
/* tests/io/test_range_coder.c -- what is written is read again, in no more bits than theory says; any bytes
   are read without harm. */
#include <math.h>

#include "base/rng.h"
#include "io/float_code.h"
#include "io/half.h"
#include "io/position_code.h"
#include "io/range_coder.h"
#include "test_support.h"

static uint32_t random_bits(uint64_t stream, uint64_t index)
{
    uint32_t out[4];
    rng_philox(3, stream, index, out);
    return out[0];
}

/* A reader over an exact copy of what was written, so that a sanitizer sees a byte too many. */
static void reopen(range_coder *written, range_coder *reader)
{
    assert_ok(coder_write_end(written, NULL));
    unsigned char *copy = malloc(written->size > 0 ? written->size : 1);
    assert_non_null(copy);
    memcpy(copy, written->bytes, written->size);
    coder_read_start(reader, copy, written->size);
}

static void end(range_coder *written, range_coder *reader)
{
    assert_true(coder_read_whole(reader));
    free(reader->bytes);
    coder_free(written);
}

/* ---- bits ---- */

/* Probability and bit of step i of the given kind: sure bits, surprises, and long runs that push carries
   through bytes of 255. */
static int bit_at(int kind, uint64_t i, uint32_t *p)
{
    const uint32_t r = random_bits(10 + (uint64_t)kind, i);
    *p = kind == 0 ? 1 + r % 65535 : kind == 1 ? 1 : kind == 2 ? 65535 : kind == 3 ? 32768 : 64 + r % 65408;
    if (kind == 1 || kind == 2)
        return (int)(i / 7 % 2);
    return kind == 3 ? 0 : (int)(random_bits(30 + (uint64_t)kind, i) & 1);
}

static void bits_come_back(void **state)
{
    (void)state;
    for (int kind = 0; kind < 5; kind++)
        for (uint64_t count = 0; count < 60000; count = count * 3 + 1) {
            range_coder w, r;
            uint32_t p;
            coder_write_start(&w);
            for (uint64_t i = 0; i < count; i++) {
                const int bit = bit_at(kind, i, &p);
                assert_int_equal(coder_bit(&w, p, bit), bit);
            }
            reopen(&w, &r);
            for (uint64_t i = 0; i < count; i++) {
                const int bit = bit_at(kind, i, &p);
                if (coder_bit(&r, p, 0) != bit)
                    fail_msg("kind %d, %d bits: bit %d", kind, (int)count, (int)i);
            }
            end(&w, &r);
        }
}

/* low = 0xFF...: every byte waits for a carry, which then comes, or does not. */
static void carries_through_long_runs(void **state)
{
    (void)state;
    for (int last = 0; last < 2; last++) {
        range_coder w, r;
        coder_write_start(&w);
        for (int i = 0; i < 40000; i++)
            coder_plain(&w, 8, 0); /* a 0 takes the upper part: bytes near 255 */
        coder_plain(&w, 32, last ? UINT32_MAX : 0);
        reopen(&w, &r);
        for (int i = 0; i < 40000; i++)
            assert_int_equal(coder_plain(&r, 8, 77), 0);
        assert_int_equal(coder_plain(&r, 32, 77), last ? UINT32_MAX : 0);
        end(&w, &r);
    }
}

/* ---- integers ---- */

static int32_t int_at(uint64_t i)
{
    static const int32_t edges[] = {
        0, 1, -1, 2, -2, 14, 15, -15, 16, 32767, -32768, CODER_INT_MAX, -CODER_INT_MAX, CODER_INT_MAX - 1};
    if (i < sizeof edges / sizeof *edges)
        return edges[i];
    const int32_t size = (int32_t)(random_bits(1, i) & 0x3FFFFFFF) >> (random_bits(2, i) % 31);
    return random_bits(3, i) & 1 ? -size : size;
}

typedef struct int_models {
    coder_int_model a[4], b[3], c[2], alone;
    coder_int_mixer mixer;
} int_models;

static int32_t code_int_at(range_coder *c, int_models *m, uint64_t i, int32_t value)
{
    if (i % 5 == 4)
        return coder_int_alone(c, &m->alone, value);
    return coder_int(c, (coder_int_model *const[CODER_INPUTS]){&m->a[i % 4], &m->b[i % 3], &m->c[i % 2]},
                     &m->mixer, value);
}

static void start_ints(int_models *m)
{
    coder_ints_start(m->a, 4);
    coder_ints_start(m->b, 3);
    coder_ints_start(m->c, 2);
    coder_ints_start(&m->alone, 1);
    coder_mixers_start(m->mixer.bin, CODER_INT_BINS);
}

static void integers_come_back(void **state)
{
    (void)state;
    range_coder w, r;
    static int_models m;
    coder_write_start(&w);
    start_ints(&m);
    for (uint64_t i = 0; i < 40000; i++)
        assert_int_equal(code_int_at(&w, &m, i, int_at(i)), int_at(i));
    reopen(&w, &r);
    start_ints(&m);
    for (uint64_t i = 0; i < 40000; i++)
        assert_int_equal(code_int_at(&r, &m, i, 0), int_at(i));
    end(&w, &r);
}

/* ---- how many bits ---- */

static void a_coin_costs_its_entropy(void **state)
{
    (void)state;
    static const double chances[] = {0.5, 0.2, 0.05, 0.015};
    for (size_t k = 0; k < sizeof chances / sizeof *chances; k++) {
        const int count = 200000;
        range_coder w;
        coder_bit_model m;
        coder_write_start(&w);
        coder_bits_start(&m, 1);
        double bits = 0;
        for (int i = 0; i < count; i++) {
            const int bit = (double)random_bits(40 + k, (uint64_t)i) < chances[k] * 4294967296.0;
            coder_adaptive(&w, &m, bit);
            bits -= log2(bit ? chances[k] : 1 - chances[k]); /* the best a coder that knows the chance can do
                                                                with this sequence */
        }
        assert_ok(coder_write_end(&w, NULL));
        const double excess = 8 * (double)w.size / bits - 1;
        if (excess > 0.02 || excess < -0.005)
            fail_msg("chance %g: %.4f too many bits", chances[k], excess);
        coder_free(&w);
    }
}

/* Integers of a two-sided geometric source, P(n) = (1 - t) / (1 + t) t^|n|, three times the same context. */
static void integers_cost_their_entropy(void **state)
{
    (void)state;
    static const double spreads[] = {0.3, 0.7, 0.9, 0.98};
    for (size_t k = 0; k < sizeof spreads / sizeof *spreads; k++) {
        const int count = 100000;
        range_coder w;
        static coder_int_model m[CODER_INPUTS];
        static coder_int_mixer mixer;
        coder_write_start(&w);
        coder_ints_start(m, CODER_INPUTS);
        coder_mixers_start(mixer.bin, CODER_INT_BINS);
        double bits = 0;
        for (uint64_t i = 0; i < (uint64_t)count; i++) {
            const double t = spreads[k];
            const double u = ((double)random_bits(50 + k, i) + 0.5) / 4294967296.0,
                         v = ((double)random_bits(60 + k, i) + 0.5) / 4294967296.0;
            const int n = (int)floor(log(u) / log(t)) -
                          (int)floor(log(v) / log(t)); /* the difference of two geometric numbers */
            coder_int(&w, (coder_int_model *const[CODER_INPUTS]){&m[0], &m[1], &m[2]}, &mixer, n);
            bits -= log2((1 - t) / (1 + t)) + abs(n) * log2(t);
        }
        assert_ok(coder_write_end(&w, NULL));
        const double excess = 8 * (double)w.size / bits - 1;
        if (excess > 0.02 || excess < -0.005)
            fail_msg("spread %g: %.4f too many bits", spreads[k], excess);
        coder_free(&w);
    }
}

/* ---- any bytes ---- */

static void any_bytes_are_read(void **state)
{
    (void)state;
    static int_models m;
    for (uint64_t round = 0; round < 300; round++) {
        const size_t size = random_bits(70, round) % 64;
        unsigned char *bytes = malloc(size > 0 ? size : 1);
        assert_non_null(bytes);
        for (size_t i = 0; i < size; i++)
            bytes[i] = round % 3 == 0 ? 0xFF : round % 3 == 1 ? 0 : (unsigned char)random_bits(71 + round, i);
        range_coder r;
        coder_read_start(&r, bytes, size);
        start_ints(&m);
        for (uint64_t i = 0; i < 500; i++) {
            const int32_t value = code_int_at(&r, &m, i, 0);
            assert_true(value >= -CODER_INT_MAX && value <= CODER_INT_MAX);
        }
        uint64_t cells[50];
        const gbt_status status =
            positions_code(&r, (int)(round % (POSITION_LEVELS_MAX + 1)), cells, 50, NULL);
        assert_true(status == GBT_OK || status == GBT_ERR_FORMAT);
        assert_true(r.at <= size);
        free(bytes);
    }
}

/* ---- positions ---- */

static int by_code(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static void cells_come_back(void **state)
{
    (void)state;
    enum { MOST = 3000 };
    static uint64_t codes[MOST], back[MOST];
    for (uint64_t round = 0; round < 40; round++) {
        const int levels = (int)(round % (POSITION_LEVELS_MAX + 1));
        const size_t count = round < 3 ? (size_t)round : 1 + random_bits(80, round) % MOST;
        const uint64_t most = levels == 0 ? 1 : UINT64_C(1) << (3 * levels);
        for (uint64_t i = 0; i < count; i++) {
            const uint64_t any =
                (uint64_t)random_bits(81 + round, 2 * i) << 32 | random_bits(81 + round, 2 * i + 1);
            codes[i] = (round % 2 == 0 ? any : any % 1000 + most / 2) % most; /* all over, and crowded */
        }
        qsort(codes, count, sizeof *codes, by_code);
        range_coder w, r;
        coder_write_start(&w);
        assert_ok(positions_code(&w, levels, codes, count, NULL));
        reopen(&w, &r);
        assert_ok(positions_code(&r, levels, back, count, NULL));
        end(&w, &r);
        assert_memory_equal(codes, back, count * sizeof *codes);
    }
}

static void points_are_in_their_cells(void **state)
{
    (void)state;
    const float sides[] = {1e-30f, 1e-3f, 7, 1e6f, 1e30f};
    for (size_t s = 0; s < sizeof sides / sizeof *sides; s++) {
        float points[300];
        for (size_t i = 0; i < 300; i++)
            points[i] = sides[s] * (rng_uniform(4, s, i) - 0.3f);
        for (double part = 1; part > 1e-7; part /= 37) {
            const position_grid grid = position_grid_over(points, 100, (double)sides[s] * part);
            assert_true(grid.levels >= 0 && grid.levels <= POSITION_LEVELS_MAX);
            for (size_t i = 0; i < 300; i += 3) {
                float middle[3];
                position_middle(&grid, position_cell(&grid, points + i), middle);
                for (size_t k = 0; k < 3; k++) /* half a cell, and what float32 rounds away */
                    assert_true(fabs((double)middle[k] - (double)points[i + k]) <=
                                0.5001 * (double)grid.cell + 2e-7 * (double)sides[s]);
            }
            if (grid.levels < POSITION_LEVELS_MAX)
                assert_true((double)grid.cell <= (double)sides[s] * part * 1.000001);
        }
    }
    uint32_t cell[3];
    position_split(UINT64_C(0x7FFFFFFFFFFFFFFF), cell);
    for (int k = 0; k < 3; k++)
        assert_int_equal(cell[k], 0x1FFFFF);
    position_split(1 + 16, cell); /* x bit 0, y bit 1 */
    assert_int_equal(cell[0], 1);
    assert_int_equal(cell[1], 2);
    assert_int_equal(cell[2], 0);
}

/* ---- floats ---- */

static void floats_come_back(void **state)
{
    (void)state;
    enum { ROWS = 500, COLUMNS = 7 };
    static float values[ROWS * COLUMNS], back[ROWS * COLUMNS];
    for (size_t i = 0; i < ROWS * COLUMNS; i++) {
        const uint32_t bits = random_bits(90, i); /* NaN and infinities too */
        memcpy(&values[i], &bits, sizeof bits);
    }
    range_coder w, r;
    coder_write_start(&w);
    assert_ok(floats_code(&w, values, ROWS, COLUMNS, NULL));
    reopen(&w, &r);
    assert_ok(floats_code(&r, back, ROWS, COLUMNS, NULL));
    end(&w, &r);
    assert_memory_equal(values, back, sizeof values);
}

static void halves_are_nearest(void **state)
{
    (void)state;
    for (uint32_t h = 0; h < 0x10000; h++)
        if ((h & 0x7C00) != 0x7C00)
            assert_int_equal(half_from_float(float_from_half((uint16_t)h)), h);
    for (uint32_t h = 0; h < 0x7BFF; h++) { /* between two halves: the even one in the middle, else the nearer
                                             */
        const float low = float_from_half((uint16_t)h), high = float_from_half((uint16_t)(h + 1)),
                    middle = 0.5f * (low + high);
        assert_int_equal(half_from_float(middle), h & 1 ? h + 1 : h);
        assert_int_equal(half_from_float(nextafterf(middle, 0)), h);
        assert_int_equal(half_from_float(nextafterf(middle, 1e9f)), h + 1);
        assert_int_equal(half_from_float(-nextafterf(middle, 1e9f)), (h + 1) | 0x8000);
    }
    assert_int_equal(half_from_float(1e30f), 0x7BFF);
    assert_int_equal(half_from_float(-65520.0f), 0xFBFF);
    assert_true(float_from_half(0x3C00) == 1.0f && float_from_half(0x0001) == 0x1p-24f &&
                float_from_half(0xC000) == -2.0f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bits_come_back),
        cmocka_unit_test(carries_through_long_runs),
        cmocka_unit_test(integers_come_back),
        cmocka_unit_test(a_coin_costs_its_entropy),
        cmocka_unit_test(integers_cost_their_entropy),
        cmocka_unit_test(any_bytes_are_read),
        cmocka_unit_test(cells_come_back),
        cmocka_unit_test(points_are_in_their_cells),
        cmocka_unit_test(floats_come_back),
        cmocka_unit_test(halves_are_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
