/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_opaque.c -- are surfaces opaque, whatever lies behind them? */
#include "run_support.h"

#include "train/schedule.h"

/* T in the mean over the rays of the first photo: how much of a white background is seen. */
static double mean_through(trainer *t)
{
    frame *f = &t->views[0].frame;
    const gbt_camera *camera = &t->scene.views[t->train_views[0]].camera;
    double sum[2] = {0, 0};
    for (int white = 0; white < 2; white++) {
        trace_settings settings = t->settings;
        for (int c = 0; c < 3; c++)
            settings.background[c] = (float)white;
        assert_ok(frame_render(f, frame_neural(&t->anchors, &t->decoder), camera, &settings, false, NULL));
        const size_t values = (size_t)f->rgb.width * (size_t)f->rgb.height * 3;
        for (size_t i = 0; i < values; i++)
            sum[white] += (double)f->rgb.pixels[i] / (double)values;
    }
    return sum[1] - sum[0];
}

/* With one background throughout, the part of a surface that has its colour is left to it. */
static void surfaces_become_opaque(void **state)
{
    (void)state;
    double through[2];
    for (int opaque = 0; opaque < 2; opaque++) {
        gbt_train_def def = run_def();
        def.iterations = 600;
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        assert_true(t.rules.opaque_from == SCHEDULE_OPAQUE_FROM);
        if (!opaque)
            t.rules.opaque_from = HUGE_VAL;
        while (t.step < def.iterations)
            step_ok(&t, &r);
        through[opaque] = mean_through(&t);
        trainer_free(&t);
    }
    print_message("mean T: %.4f with one background, %.4f with many\n", through[0], through[1]);
    assert_true(through[1] < 0.5 * through[0]);
}

/* What is learned stays, and so does the reference's. */
static void a_background_that_means_something_stays(void **state)
{
    (void)state;
    for (int compat = 0; compat < 2; compat++) {
        gbt_train_def def = run_def();
        def.compat = compat;
        def.background = compat ? GBT_BACKGROUND_CONSTANT : GBT_BACKGROUND_SKY;
        trainer t;
        open_ok(&t, tiny, &def);
        assert_true(t.rules.opaque_from > 1);
        trainer_free(&t);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(surfaces_become_opaque),
        cmocka_unit_test(a_background_that_means_something_stays),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
