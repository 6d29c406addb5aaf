/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_near.c -- how near to a camera things are drawn. */
#include "run_support.h"

#include "train/near.h"

/* One close-up among many photos has its own near distance, and the others keep theirs. */
static void a_close_up_is_alone(void **state)
{
    (void)state;
    enum { COUNT = 40 };
    scene_view views[COUNT] = {{0}};
    size_t all[COUNT];
    for (size_t i = 0; i < COUNT; i++) {
        views[i].nearest = 4 + 0.01 * (double)i;
        all[i] = i;
    }
    views[17].nearest = 0.2;
    views[3].nearest = 0; /* unknown */
    const scene s = {.views = views, .view_count = COUNT};
    gbt_train_def def = gbt_train_def_default(), reference = def;
    def.near = 0.5;
    reference.compat = true;
    float near;
    assert_ok(scene_near(&s, all, COUNT, 0.5, &near, NULL));
    assert_true(near >= 2 && near < 2.1f);
    assert_true(view_near(near, &def, &views[17]) == 0.1f && view_near(near, &def, &views[3]) == near);
    for (size_t i = 5; i < COUNT; i++)
        assert_true(i == 17 || view_near(near, &def, &views[i]) > 1.9f);
    assert_true(view_near(0.3f, &reference, &views[17]) == 0.3f); /* nothing is asked of the points */
    assert_ok(scene_near(&s, all, 10, 0.5, &near, NULL));         /* of few photos, the least */
    assert_true(near == 2);
    assert_ok(scene_near(&s, all + 3, 1, 0.5, &near, NULL));
    assert_true(near == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_close_up_is_alone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
