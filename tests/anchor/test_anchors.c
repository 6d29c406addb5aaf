/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/test_anchors.c -- memory of anchors, sizes and first values of the networks. */
#include "fixture.h"

static void sizes_of_the_networks(void **state) /* scaffold-gs: 1482, 3462, 2142 for K = 10 without distance;
                                                   one input more adds 32 each */
{
    (void)state;
    const size_t expected[3] = {1482, 3462, 2142};
    for (int dist = 0; dist <= 1; dist++) {
        decoder d;
        assert_ok(decoder_init(&d, 10, dist == 1, 7, NULL));
        decoder_network networks[3];
        decoder_networks(&d, networks);
        size_t at = 0;
        for (int p = 0; p < 3; p++) {
            assert_int_equal(networks[p].begin, at);
            at += expected[p] + (dist == 1 ? 32 : 0);
            assert_int_equal(networks[p].end, at);
        }
        assert_int_equal(d.param_count, at);
        assert_int_equal(at, dist == 1 ? 7182 : 7086);
        decoder_free(&d);
        assert_null(d.params);
    }
}

static void first_values_fill_their_interval(void **state)
{
    (void)state;
    for (int dist = 0; dist <= 1; dist++) {
        decoder d, again, other;
        assert_ok(decoder_init(&d, 10, dist == 1, 3, NULL));
        assert_ok(decoder_init(&again, 10, dist == 1, 3, NULL));
        assert_ok(decoder_init(&other, 10, dist == 1, 4, NULL));
        assert_memory_equal(d.params, again.params, d.param_count * sizeof(float));
        assert_memory_not_equal(d.params, other.params, d.param_count * sizeof(float));
        decoder_network networks[3];
        decoder_networks(&d, networks);
        const size_t in = dist == 1 ? 36 : 35;
        for (int p = 0; p < 3; p++) {
            const size_t first_layer = networks[p].begin + 32 * (in + 1);
            const size_t bounds_begin[2] = {networks[p].begin, first_layer},
                         bounds_end[2] = {first_layer, networks[p].end};
            const double bound[2] = {dist == 1 ? 0.16666667 : 0.16903085, 0.17677670};
            const size_t at[4] = {0, 32 * (in + 1) - 1, 32 * (in + 1),
                                  networks[p].end - networks[p].begin - 1}; /* ends of both layers */
            for (int i = 0; i < 4; i++) {
                const double want = (2.0 * (double)rng_uniform(3, (uint64_t)p, at[i]) - 1.0) * bound[i / 2];
                assert_true(fabs((double)d.params[networks[p].begin + at[i]] - want) < 1e-6 * fabs(want));
            }
            for (int layer = 0; layer < 2; layer++) {
                double low = 1, high = -1, sum = 0;
                for (size_t i = bounds_begin[layer]; i < bounds_end[layer]; i++) {
                    low = fmin(low, (double)d.params[i]);
                    high = fmax(high, (double)d.params[i]);
                    sum += (double)d.params[i];
                }
                const double count = (double)(bounds_end[layer] - bounds_begin[layer]);
                assert_true(high <= bound[layer] && low >= -bound[layer]);
                assert_true(high > 0.97 * bound[layer] && low < -0.97 * bound[layer]);
                assert_true(fabs(sum / count) < 4 * bound[layer] / sqrt(3 * count)); /* 4 standard errors */
            }
        }
        decoder_free(&d);
        decoder_free(&again);
        decoder_free(&other);
    }
}

static void resizing_keeps_rows_and_clears_new_ones(void **state)
{
    (void)state;
    anchors a = random_anchors(5, 3, 1);
    const float kept = a.offset[4 * 9 + 8], kept_feature = a.feature[2 * 32 + 31];
    assert_ok(anchors_resize(&a, 200, NULL));
    assert_int_equal(a.count, 200);
    assert_true(a.offset[4 * 9 + 8] == kept && a.feature[2 * 32 + 31] == kept_feature);
    for (size_t i = 5 * 6; i < 200 * 6; i++)
        assert_true(a.scale_log[i] == 0.0f);
    a.scale_log[3 * 6] = 9.0f;
    assert_ok(anchors_resize(&a, 3, NULL));
    assert_ok(anchors_resize(&a, 4, NULL)); /* a row that comes back is empty */
    assert_true(a.scale_log[3 * 6] == 0.0f && a.feature[2 * 32 + 31] == kept_feature);
    assert_ok(anchors_resize(&a, 0, NULL));
    anchors_free(&a);
    assert_int_equal(a.count, 0);
}

static void wrong_offset_counts_are_refused(void **state)
{
    (void)state;
    const int wrong[] = {-1, 0, ANCHOR_MAX_OFFSETS + 1};
    for (size_t i = 0; i < 3; i++) {
        gbt_error err = {0};
        anchors a = {.offset_count = wrong[i]};
        assert_int_equal(anchors_resize(&a, 1, &err), GBT_ERR_ARGUMENT);
        assert_string_not_equal(err.text, "");
        decoder d;
        assert_int_equal(decoder_init(&d, wrong[i], false, 0, NULL), GBT_ERR_ARGUMENT);
        assert_null(d.params);
    }
    anchors a = {.offset_count = ANCHOR_MAX_OFFSETS};
    assert_ok(anchors_resize(&a, 1, NULL));
    anchors_free(&a);
}

static void no_memory_changes_nothing(void **state)
{
    (void)state;
    anchors a = random_anchors(5, 2, 1);
    const float *before = a.feature;
    for (long n = 0; n < 4; n++) {
        gbt_error err = {0};
        mem_fail_after(n);
        assert_int_equal(anchors_resize(&a, 100, &err), GBT_ERR_NO_MEMORY);
        mem_fail_after(-1);
        assert_true(a.count == 5 && a.feature == before);
        assert_string_not_equal(err.text, "");
    }
    anchors_free(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_of_the_networks),
        cmocka_unit_test(first_values_fill_their_interval),
        cmocka_unit_test(resizing_keeps_rows_and_clears_new_ones),
        cmocka_unit_test(wrong_offset_counts_are_refused),
        cmocka_unit_test(no_memory_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
