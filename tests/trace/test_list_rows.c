/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/test_list_rows.c -- few depths are sorted as many are; the steps that the adjoint over lists
   takes are bounded, and it gives the same with too many of them; it goes back as far as forward has, and no
   less would do. */
#include "base/near.h"
#include "base/rng.h"
#include "test_support.h"

#define SIMD16_PLAIN
#define KERNEL_NAME list_kernel_of_test
#include "trace/list_kernel.inc.h"

/* A tape of all rows, with how far each goes back. */
static void write_tape(const packet_hits *rows, tape_entry *entry)
{
    list_scratch scratch = {0};
    packet_hits forward = {0};
    assert_true(reserve_rows_of_list(&scratch, rows->count, false, &forward));
    forward.count = rows->count;
    for (int i = 0; i < (int)rows->count; i++) {
        const vfloat16 alpha = row_load(rows->alpha, i);
        forward.order[i] = forward.tape_index[i] = (uint32_t)i;
        row_store(forward.t, i, row_load(rows->t, i));
        row_store(forward.alpha, i, alpha);
        entry[i] = (tape_entry){0, (uint16_t)vmask16_bits(vfloat16_lt(vfloat16_set1(0), alpha)), 0};
    }
    insert_rows(&forward);
    write_steps_back(&forward, entry, 0, rows->count);
    assert_false(forward.crowded);
    list_scratch_free(&scratch);
}

static void insert_all_again(packet_hits *rows, const tape_entry *entry)
{
    insertion s = start_insertion(rows);
    for (int i = 0; i < (int)rows->count; i++)
        insert_again(rows, &s, entry, i, row_load(rows->t, i), row_load(rows->alpha, i));
    end_insertion(rows, &s);
}

/* The largest relative error of T in front of a hit and of what lies behind one, against sums ray by ray. */
static double error_of_rows(const packet_hits *rows)
{
    double worst = 0;
    for (int lane = 0; lane < PACKET_LANES; lane++)
        for (int i = 0; i < (int)rows->count; i++) {
            double T = 1, behind = 1;
            const int at = i * PACKET_LANES + lane;
            for (int k = 0; k < (int)rows->count; k++) {
                const int other = k * PACKET_LANES + lane;
                if (k != i && rows->alpha[other] > 0) {
                    const bool front =
                        rows->t[other] < rows->t[at] || (rows->t[other] == rows->t[at] && k < i);
                    T *= front ? 1 - (double)rows->alpha[other] : 1;
                    behind += front ? 0 : (double)rows->term[other];
                }
            }
            if (rows->alpha[at] > 0)
                worst = fmax(worst, fmax(fabs((double)rows->T_front[at] / T - 1),
                                         fabs((double)rows->behind[at] / behind - 1)));
        }
    return worst;
}

/* Rows of rays that differ in their order, some of them without a hit. */
static void rows_go_back_as_far_as_the_tape_says(void **state)
{
    (void)state;
    enum { COUNT = 90 };
    tile_gaussian gaussian = {.color = {1, 0.5f, 0.25f}};
    const used_list used = {.gaussian = &gaussian, .count = 1};
    const vfloat16 one = vfloat16_set1(1), d_rgb[3] = {one, one, one};
    tape_entry entry[COUNT + 1];
    list_scratch scratch = {0};
    packet_hits rows = {0};
    assert_true(reserve_rows_of_list(&scratch, COUNT, true, &rows));
    rows.count = COUNT;
    for (int seed = 0; seed < 10; seed++) {
        int farthest = 0;
        for (int i = 0; i < COUNT * PACKET_LANES; i++) {
            const float u = rng_uniform((uint64_t)seed, 0, (uint64_t)i),
                        v = rng_uniform((uint64_t)seed, 1, (uint64_t)i);
            rows.t[i] = floorf(20 + (float)(i / PACKET_LANES) + 6 * u * u); /* many are equal */
            rows.alpha[i] = v < 0.4f ? 0 : 0.2f * v;
        }
        for (int i = 0; i < COUNT; i++)
            rows.order[i] = (uint32_t)i, rows.number[i] = 0;
        write_tape(&rows, entry);
        insert_all_again(&rows, entry);
        assert_true(collect_behind(&rows, &used, d_rgb, one));
        assert_true(error_of_rows(&rows) < 2e-5);
        for (int i = 0; i < COUNT; i++)
            farthest = entry[i].packet > entry[farthest].packet ? i : farthest;
        assert_true(entry[farthest].packet >> TAPE_BACK > 3);
        entry[farthest].packet -= 1 << TAPE_BACK;
        insert_all_again(&rows, entry);
        assert_true(error_of_rows(&rows) > 1e-3);
    }
    list_scratch_free(&scratch);
}

/* The last row is the nearest on one ray: each of the others would step on past all that follow. */
static void steps_on_are_bounded(void **state)
{
    (void)state;
    enum { COUNT = 500, LANE = 9 };
    tile_gaussian gaussian = {.color = {1, 0.5f, 0.25f}};
    const used_list used = {.gaussian = &gaussian, .count = 1};
    const vfloat16 one = vfloat16_set1(1), d_rgb[3] = {one, one, one};
    tape_entry entry[COUNT + 1];
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
        write_tape(&rows, entry);
        insert_all_again(&rows, entry);
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
                                       cmocka_unit_test(rows_go_back_as_far_as_the_tape_says),
                                       cmocka_unit_test(steps_on_are_bounded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
