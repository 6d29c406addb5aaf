/* SPDX-License-Identifier: Apache-2.0 */
/* tests/base/test_sky.c -- colours by direction: sixteen at a time, one, and in double; cut, and constant. */
#include <math.h>

#include "base/rng.h"
#include "base/sky.h"
#include "test_support.h"

static const float color[3] = {0.25f, 0.5f, 0.75f};

static sky random_sky(float size, bool has_horizon)
{
    sky s = {
        .varies = true, .has_horizon = has_horizon, .up = {0.6f, 0, -0.8f}, .ground = {0.125f, 0.875f, 0.5f}};
    for (int k = 0; k < 3 * SKY_HARMONICS; k++)
        s.harmonic[k / 3][k % 3] = size * (float)rng_normal(3, 1, (uint64_t)k);
    return s;
}

static void random_directions(uint64_t stream, float dir[3][SKY_LANES])
{
    for (int lane = 0; lane < SKY_LANES; lane++) {
        double d[3], square = 0;
        for (int k = 0; k < 3; k++) {
            d[k] = rng_normal(4, stream, (uint64_t)(3 * lane + k));
            square += d[k] * d[k];
        }
        for (int k = 0; k < 3; k++)
            dir[k][lane] = (float)(d[k] / sqrt(square));
    }
}

static void lanes_are_one_and_exact(void **state)
{
    (void)state;
    double worst = 0;
    size_t cut = 0;
    for (uint64_t round = 0; round < 200; round++) {
        const sky s = random_sky(round % 2 == 0 ? 0.05f : 0.5f, round % 4 >= 2);
        float dir[3][SKY_LANES], out[3][SKY_LANES];
        random_directions(round, dir);
        sky_colors(&s, color, dir, out);
        for (int lane = 0; lane < SKY_LANES; lane++) {
            const float one[3] = {dir[0][lane], dir[1][lane], dir[2][lane]};
            float single[3];
            double exact[3];
            sky_color(&s, color, one, single);
            sky_color_exact(&s, color, (const double[3]){(double)one[0], (double)one[1], (double)one[2]},
                            exact);
            for (int c = 0; c < 3; c++) {
                assert_true(single[c] == out[c][lane]);
                assert_true(single[c] >= 0 && single[c] <= 1);
                worst = fmax(worst, fabs((double)single[c] - exact[c]));
                cut += single[c] == 0 || single[c] == 1;
            }
        }
    }
    print_message("float against double: %.1e; %zu colours cut\n", worst, cut);
    assert_true(worst < 3e-6 && cut > 0);
}

static void the_basis_is_what_is_summed(void **state)
{
    (void)state;
    const sky s = random_sky(0.02f, false);
    const float dir[3] = {0.6f, -0.48f, 0.64f};
    float y[SH_COUNT], out[3];
    sky_basis(&s, dir, y);
    sky_color(&s, color, dir, out);
    assert_true(y[0] == 1);
    for (int c = 0; c < 3; c++) {
        float sum = color[c] * y[0];
        for (int k = 1; k < SH_COUNT; k++)
            sum += s.harmonic[k - 1][c] * y[k];
        assert_true(fabsf(sum - out[c]) < 1e-6f);
    }
}

/* Below the horizon the ground's colour alone, from 5.7 degrees on the sky's alone, between them a mixture,
   of which the basis is the sky's part. */
static void the_sky_is_above_the_horizon(void **state)
{
    (void)state;
    const sky with = random_sky(0.02f, true), all_around = random_sky(0.02f, false);
    const float heights[] = {-1, -0.3f, 0, 0.05f, 0.1f, 0.7f, 1}, shares[] = {0, 0, 0, 0.5f, 1, 1, 1};
    for (int i = 0; i < 7; i++) {
        const float h = heights[i], across = sqrtf(1 - h * h);
        const float dir[3] = {h * with.up[0], across, h * with.up[2]};
        float mixed[3], alone[3], y[SH_COUNT], y_alone[SH_COUNT];
        sky_color(&with, color, dir, mixed);
        sky_color(&all_around, color, dir, alone);
        sky_basis(&with, dir, y);
        sky_basis(&all_around, dir, y_alone);
        for (int c = 0; c < 3; c++)
            assert_true(fabsf(mixed[c] - (with.ground[c] + shares[i] * (alone[c] - with.ground[c]))) < 1e-6f);
        for (int k = 0; k < SH_COUNT; k++)
            assert_true(fabsf(y[k] - shares[i] * y_alone[k]) < 1e-6f);
    }
}

static void a_constant_one_is_left_as_it_is(void **state)
{
    (void)state;
    sky s = random_sky(0.3f, true);
    s.varies = false;
    const float bright[3] = {-1, 0.3f, 7}, dir[3] = {0, 0, 1};
    float out[3];
    double exact[3];
    sky_color(&s, bright, dir, out);
    sky_color_exact(&s, bright, (const double[3]){0, 0, 1}, exact);
    for (int c = 0; c < 3; c++)
        assert_true(out[c] == bright[c] && exact[c] == (double)bright[c]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lanes_are_one_and_exact),
        cmocka_unit_test(the_basis_is_what_is_summed),
        cmocka_unit_test(the_sky_is_above_the_horizon),
        cmocka_unit_test(a_constant_one_is_left_as_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
