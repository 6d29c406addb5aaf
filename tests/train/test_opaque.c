/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_opaque.c -- are surfaces opaque, whatever lies behind them? */
#include "run_support.h"

#include "base/near.h"
#include "train/horizon.h"
#include "train/schedule.h"

/* T in the mean over the rays of the first photo: how much of a white background is seen. */
static double mean_through(trainer *t)
{
    frame *f = &t->views[0].frame;
    const gbt_camera *camera = &t->scene.views[t->train_views[0]].camera;
    double sum[2] = {0, 0};
    for (int white = 0; white < 2; white++) {
        trace_settings settings = t->settings;
        settings.sky.varies = false;
        for (int c = 0; c < 3; c++)
            settings.background[c] = (float)white;
        assert_ok(frame_render(f, frame_neural(&t->anchors, &t->decoder), camera, &settings, false, NULL));
        const size_t values = (size_t)f->rgb.width * (size_t)f->rgb.height * 3;
        for (size_t i = 0; i < values; i++)
            sum[white] += (double)f->rgb.pixels[i] / (double)values;
    }
    return sum[1] - sum[0];
}

/* With one background throughout, the part of a surface that has its colour is left to it; below the horizon
   of a sky likewise. */
static void surfaces_become_opaque(void **state)
{
    double through[2];
    for (int opaque = 0; opaque < 2; opaque++) {
        gbt_train_def def = run_def();
        def.iterations = 600;
        def.background = *(const gbt_background *)*state;
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

static void the_references_background_stays(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.compat = true;
    trainer t;
    open_ok(&t, tiny, &def);
    assert_true(t.rules.opaque_from > 1);
    trainer_free(&t);
}

/* Where photos agree about what is up, a sky ends at the horizon; otherwise it is all around, and as it is
   what the photos show it stays. */
static void a_sky_has_a_horizon_where_up_is_known(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.background = GBT_BACKGROUND_SKY;
    trainer t;
    open_ok(&t, tiny, &def);
    const sky *s = &t.settings.sky;
    assert_true(s->varies && s->has_horizon && t.rules.opaque_from == SCHEDULE_OPAQUE_FROM);
    double length = 0;
    for (int k = 0; k < 3; k++) {
        length += (double)s->up[k] * (double)s->up[k];
        assert_true(s->ground[k] == t.settings.background[k]);
    }
    assert_near(length, 1, 1e-6);
    for (size_t v = 0; v < t.train_count; v++) {
        double *down = t.scene.views[t.train_views[v]].camera.rotation + 3, along = 0;
        for (int k = 0; k < 3; k++)
            along += down[k] * (double)s->up[k];
        assert_true(along < -0.5); /* they look down at most 60 degrees */
        for (int k = 0; k < 3; k++)
            down[k] *= v % 2 == 0 ? 1 : -1; /* every second camera was held upside down */
    }
    float up[3];
    assert_false(horizon_find(&t.scene, t.train_views, t.train_count, up));
    trainer_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(surfaces_become_opaque, &(gbt_background){GBT_BACKGROUND_CONSTANT}),
        cmocka_unit_test_prestate(surfaces_become_opaque, &(gbt_background){GBT_BACKGROUND_SKY}),
        cmocka_unit_test(the_references_background_stays),
        cmocka_unit_test(a_sky_has_a_horizon_where_up_is_known),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
