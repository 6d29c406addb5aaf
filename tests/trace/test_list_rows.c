/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_list_rows.c -- few depths are sorted as many are; the steps that the adjoint over lists
   takes are bounded, and it gives the same with too many of them. */
#include "base/near.h"
#include "base/rng.h"
#include "test_support.h"

#define SIMD16_PLAIN
#define KERNEL_NAME list_kernel_of_test
#include "trace/list_kernel.inc.h"

/* The last row is the nearest on one ray: each of the others would step on past all that follow. */
static void steps_on_are_bounded(void **state)
{
    (void)state;
    enum { COUNT = 500, LANE = 9 };
    tile_gaussian gaussian = {.color = {1, 0.5f, 0.25f}};
    const used_list used = {.gaussian = &gaussian, .count = 1};
    const vfloat16 one = vfloat16_set1(1), d_rgb[3] = {one, one, one};
    list_scratch scratch = {0};
    packet_hits rows = {0};
    assert_true(reserve_rows_of_list(&scratch, COUNT, true, &rows));
    for (int late = 0; late < 2; late++) {
        rows.count = COUNT;
        for (int i = 0; i < COUNT; i++) {
            rows.order[i] = (uint32_t)i;
            rows.number[i] = 0;
            row_store(rows.t, i, vfloat16_set1(10 + (float)i));
            row_store(rows.alpha, i, vfloat16_set1(0.001f + 1e-6f * (float)i));
        }
        if (late)
            rows.t[(COUNT - 1) * PACKET_LANES + LANE] = 1;
        insert_rows(&rows);
        assert_false(rows.crowded);
        const bool few = collect_behind(&rows, &used, d_rgb, one);
        assert_true(few == !late && rows.steps <= 50 * COUNT + 1024);
        if (!few)
            assert_true(collect_behind_by_ray(&rows, &used, d_rgb, one, &scratch));
        for (int lane = 0; lane < PACKET_LANES; lane++) {
            double behind = 1;
            for (int k = COUNT; k-- > 0;) { /* from the farthest on */
                const bool turned = late && lane == LANE;
                const int at = (turned ? (k + COUNT - 1) % COUNT : k) * PACKET_LANES + lane;
                assert_near((double)rows.behind[at], behind, 5e-5 * behind);
                behind += (double)rows.term[at];
            }
        }
    }
    list_scratch_free(&scratch);
}

/* Depths of which few or many are equal, some 0, large or infinite. */
static void few_depths_are_sorted_as_many(void **state)
{
    (void)state;
    enum { MOST = 300 };
    static _Alignas(64) float key[MOST + 16];
    static uint64_t few[MOST], from[MOST], to[MOST];
    for (size_t count = 0; count <= MOST; count++) {
        for (size_t i = 0; i < count; i++) {
            const float u = rng_uniform(count, 0, i);
            key[i] = u < 0.1f ? 0 : u < 0.15f ? FLT_MAX : u < 0.2f ? INFINITY : u < 0.6f ? floorf(20 * u) : u;
        }
        const uint64_t *many = sort_list(key, count, from, to);
        rank_rows(key, count, few);
        for (size_t i = 0; i < count; i++) {
            assert_int_equal((uint32_t)few[i], (uint32_t)many[i]);
            assert_true(i == 0 || (few[i] >> 32 == few[i - 1] >> 32) == (many[i] >> 32 == many[i - 1] >> 32));
        }
        const uint64_t *either = sort_depths(key, count, from, to);
        for (size_t i = 0; i < count; i++)
            assert_int_equal((uint32_t)either[i], (uint32_t)few[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(few_depths_are_sorted_as_many),
                                       cmocka_unit_test(steps_on_are_bounded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
