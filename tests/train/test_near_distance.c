/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_near_distance.c -- how near to a camera things are drawn. */
#include "run_support.h"

#include "train/near_distance.h"

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
    assert_ok(near_of_scene(&s, all, COUNT, 0.5, &near, NULL));
    assert_true(near >= 2 && near < 2.1f);
    assert_true(near_of_view(near, &def, &views[17]) == 0.1f && near_of_view(near, &def, &views[3]) == near);
    for (size_t i = 5; i < COUNT; i++)
        assert_true(i == 17 || near_of_view(near, &def, &views[i]) > 1.9f);
    assert_true(near_of_view(0.3f, &reference, &views[17]) == 0.3f); /* nothing is asked of the points */
    assert_ok(near_of_scene(&s, all, 10, 0.5, &near, NULL));         /* of few photos, the least */
    assert_true(near == 2);
    assert_ok(near_of_scene(&s, all + 3, 1, 0.5, &near, NULL));
    assert_true(near == 0);
}

/* A step draws its photo from that one's near distance on: as if all had it, and not from that of all. */
static void a_step_has_the_near_distance_of_its_photo(void **state)
{
    (void)state;
    static const struct {
        float of_all;
        double nearest;
    } cases[] = {{0.25f, 0}, {100, 0.5}, {100, 0}};
    static float drawn[3][3 * 24 * 18];
    trainer t;
    const gbt_train_def def = run_def();
    open_ok(&t, tiny, &def);
    assert_true(def.near == 0.5);
    step_view *v = &t.views[0];
    step_photos_pick(&t);
    for (int i = 0; i < 3; i++) {
        step_view_pick(&t, v, 0);
        t.settings.t_near = cases[i].of_all;
        t.scene.views[t.train_views[v->slot]].nearest = cases[i].nearest;
        step_view_run(&t, v);
        if (v->outcome.status != GBT_OK || v->outcome.bad)
            fail_msg("%s", v->outcome.text);
        assert_true(v->frame.rgb.width == 24 && v->frame.rgb.height == 18);
        memcpy(drawn[i], v->frame.rgb.pixels, sizeof drawn[i]);
    }
    assert_memory_equal(drawn[0], drawn[1], sizeof drawn[0]);
    assert_true(memcmp(drawn[1], drawn[2], sizeof drawn[1]) != 0);
    trainer_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_close_up_is_alone),
        cmocka_unit_test(a_step_has_the_near_distance_of_its_photo),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
