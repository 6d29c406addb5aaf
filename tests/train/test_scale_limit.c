/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_scale_limit.c -- no Gaussian becomes wider than the distance to the cameras lets it. */
#include "run_support.h"

/* By the definition, camera after camera. */
static double nearest_camera(const trainer *t, size_t anchor)
{
    double least = HUGE_VAL;
    for (size_t v = 0; v < t->train_count; v++) {
        double d = 0;
        for (size_t k = 0; k < 3; k++)
            d += pow((double)t->anchors.position[3 * anchor + k] -
                         t->scene.views[t->train_views[v]].camera.center[k],
                     2);
        least = fmin(least, sqrt(d));
    }
    return least;
}

static double widest_share(const trainer *t)
{
    double most = 0;
    for (size_t i = 0; i < t->anchors.count; i++)
        for (size_t k = 0; k < 6; k++)
            most = fmax(most, exp((double)t->anchors.scale_log[6 * i + k]) / nearest_camera(t, i));
    return most;
}

/* Rates that let every scale run away. With growth, anchors and their bounds change together. */
static void run_wild(trainer *t, bool compat, bool grows)
{
    gbt_train_def def = run_def();
    def.iterations = 200;
    def.compat = compat;
    def.grow = grows;
    def.threshold_factor = 0.1;
    def.learning_rate_factor = grows ? 3 : 1000;
    step_report r;
    open_ok(t, tiny, &def);
    const size_t start = t->anchors.count;
    for (int i = 0; i < (grows ? 60 : 5); i++)
        step_ok(t, &r);
    assert_true(grows == (t->anchors.count != start));
}

static void gaussians_are_not_wider_than_far(void **state)
{
    (void)state;
    for (int grows = 0; grows < 2; grows++) {
        trainer t;
        run_wild(&t, false, grows);
        const double share = widest_share(&t);
        assert_true(share <= t.rules.widest * (1 + 1e-5));
        assert_true(grows || share >= t.rules.widest * (1 - 1e-5));
        trainer_free(&t);
    }
}

/* The reference has a bound in scene units in its rounds alone (test_compat). */
static void the_reference_has_no_such_bound(void **state)
{
    (void)state;
    trainer t;
    run_wild(&t, true, false);
    assert_true(widest_share(&t) > 1);
    trainer_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gaussians_are_not_wider_than_far),
        cmocka_unit_test(the_reference_has_no_such_bound),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
