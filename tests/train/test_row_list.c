/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_row_list.c -- sums of numbered rows: against plain arrays that are added in the order of
 * the tree, and in parts. */
#include "test_support.h"

#include <stdbool.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "train/row_list.h"

enum { LISTS = 8, NUMBERS = 5000, WIDTH = 7 };

/* About every third row, with values whose sum depends on the order. */
static void make_list(uint64_t seed, row_list *out, float dense[NUMBERS][WIDTH])
{
    assert_ok(row_list_resize(out, NUMBERS, WIDTH, NULL));
    size_t count = 0;
    for (uint32_t n = 0; n < NUMBERS; n++) {
        uint32_t words[4];
        rng_philox(seed, 7, n, words);
        const bool has = words[0] % 3 == 0 && n / 1024 != seed % 5; /* some blocks are empty */
        row_word *row = row_list_row(out, count);
        row[0].number = n;
        for (int i = 0; i < WIDTH; i++) {
            dense[n][i] = has ? (float)(words[1 + (unsigned)i % 3] >> 8) * 1e-3f - 5000.0f : 0.0f;
            row[1 + i].value = dense[n][i];
        }
        count += has;
    }
    out->count = count;
}

static float tree_sum(float (*const *dense)[WIDTH], size_t list, size_t size, size_t n, int i)
{
    if (size == 1)
        return dense[list][n][i];
    return tree_sum(dense, list, size / 2, n, i) + tree_sum(dense, list + size / 2, size / 2, n, i);
}

typedef struct made_lists {
    row_list lists[LISTS];
    const row_list *pointers[LISTS];
    float (*dense[LISTS])[WIDTH];
} made_lists;

static void make_lists(made_lists *m)
{
    memset(m, 0, sizeof *m);
    for (int i = 0; i < LISTS; i++) {
        m->dense[i] = mem_calloc(NUMBERS, sizeof *m->dense[i], "test", NULL);
        assert_non_null(m->dense[i]);
        make_list((uint64_t)i, &m->lists[i], m->dense[i]);
        m->pointers[i] = &m->lists[i];
    }
}

static void free_lists(made_lists *m)
{
    for (int i = 0; i < LISTS; i++) {
        mem_free(m->dense[i]);
        row_list_free(&m->lists[i]);
    }
}

static void rows_add_up_in_the_order_of_the_tree(void **state)
{
    (void)state;
    made_lists m;
    make_lists(&m);
    for (size_t count = 1; count <= LISTS; count *= 2)
        for (int threads = 1; threads <= 3; threads += 2) {
            row_list sum = {0};
            parallel_set_threads(threads);
            assert_ok(row_list_sum(m.pointers, count, &sum, NULL));
            size_t next = 0;
            for (uint32_t n = 0; n < NUMBERS; n++) {
                bool any = false;
                for (size_t l = 0; l < count; l++) {
                    const size_t at = row_list_find(&m.lists[l], n);
                    any |= at < m.lists[l].count && row_list_row(&m.lists[l], at)->number == n;
                }
                if (!any)
                    continue;
                const row_word *row = row_list_row(&sum, next++);
                assert_int_equal(row->number, n);
                for (int i = 0; i < WIDTH; i++)
                    assert_true(row[1 + i].value == tree_sum(m.dense, 0, count, n, i));
            }
            assert_int_equal(sum.count, next);
            row_list_free(&sum);
        }
    free_lists(&m);
}

/* As on several processes: each adds up a block of the lists, then the sums are added up. */
static void parts_of_the_tree_give_the_same_bits(void **state)
{
    (void)state;
    made_lists m;
    make_lists(&m);
    row_list whole = {0};
    assert_ok(row_list_sum(m.pointers, LISTS, &whole, NULL));
    for (size_t parts = 2; parts <= LISTS; parts *= 2) {
        row_list part[LISTS] = {{0}}, sum = {0};
        const row_list *pointers[LISTS];
        for (size_t p = 0; p < parts; p++) {
            assert_ok(row_list_sum(m.pointers + p * (LISTS / parts), LISTS / parts, &part[p], NULL));
            pointers[p] = &part[p];
        }
        assert_ok(row_list_sum(pointers, parts, &sum, NULL));
        assert_int_equal(sum.count, whole.count);
        assert_memory_equal(sum.words, whole.words, sum.count * (1 + WIDTH) * sizeof *sum.words);
        for (size_t p = 0; p < parts; p++)
            row_list_free(&part[p]);
        row_list_free(&sum);
    }
    row_list_free(&whole);
    free_lists(&m);
}

static void lists_may_be_empty(void **state)
{
    (void)state;
    row_list a = {0}, b = {0}, sum = {0};
    const row_list *lists[2] = {&a, &b};
    assert_ok(row_list_resize(&a, 0, WIDTH, NULL));
    assert_ok(row_list_resize(&b, 1, WIDTH, NULL));
    memset(b.words, 0, (1 + WIDTH) * sizeof *b.words);
    b.words[0].number = 4000000000u;
    b.words[1].value = 3;
    assert_int_equal(row_list_find(&a, 5), 0);
    assert_int_equal(row_list_find(&b, 4000000000u), 0);
    b.words[0].number = 70000;
    assert_ok(row_list_sum(lists, 2, &sum, NULL));
    assert_int_equal(sum.count, 1);
    assert_memory_equal(sum.words, b.words, (1 + WIDTH) * sizeof *b.words);
    b.count = 0;
    assert_ok(row_list_sum(lists, 2, &sum, NULL));
    assert_int_equal(sum.count, 0);
    row_list *const all[] = {&a, &b, &sum};
    for (int i = 0; i < 3; i++)
        row_list_free(all[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_add_up_in_the_order_of_the_tree),
        cmocka_unit_test(parts_of_the_tree_give_the_same_bits),
        cmocka_unit_test(lists_may_be_empty),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
