/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_rolling.c -- photos of cameras that move while they are read out are learned by their own
   rays, and scored by them. */
#include "run_support.h"

#include <jansson.h>

#include "base/near.h"
#include "gbtrace/evaluate.h"

enum { ROLLING_STEPS = 300 };

static void make_rolling_scene(const char *folder)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.lens = GBT_MAKE_SCENE_ROLLING;
    def.width = 80;
    def.height = 60;
    def.view_count = 24;
    def.points = 600;
    def.samples = 4;
    assert_ok(gbt_make_scene(&def, folder, NULL));
}

static gbt_train_def rolling_def(void)
{
    gbt_train_def def = run_def();
    def.step_pixels = 0;
    def.iterations = ROLLING_STEPS;
    return def;
}

/* Held-out PSNR; `still`: as if every photo had been taken at once, in the middle of its time. */
static double trained(const char *data, bool still)
{
    trainer t;
    const gbt_train_def def = rolling_def();
    double psnr = 0;
    open_ok(&t, data, &def);
    for (size_t i = 0; i < t.scene.view_count; i++) {
        assert_int_equal(t.scene.views[i].camera.shutter, GBT_CAMERA_SHUTTER_ROWS);
        if (still)
            t.scene.views[i].camera.shutter = GBT_CAMERA_SHUTTER_GLOBAL;
    }
    step_report report;
    for (int i = 0; i < ROLLING_STEPS; i++)
        step_ok(&t, &report);
    assert_ok(held_out_psnr(&t, &psnr, NULL));
    trainer_free(&t);
    return psnr;
}

static void motion_is_followed(void **state)
{
    (void)state;
    make_rolling_scene(in_folder("rolling"));
    const double own = trained(in_folder("rolling"), false), still = trained(in_folder("rolling"), true);
    print_message("%.2f dB by their own rays, %.2f dB as if they stood still\n", own, still);
    assert_true(own > still + 1);
    const gbt_train_def def = rolling_def();
    const gbt_evaluate_def score = gbt_evaluate_def_default();
    train_ok(in_folder("rolling"), in_folder("run"), &def);
    assert_ok(gbt_evaluate(in_folder("run"), &score, NULL));
    json_t *metrics = json_load_file(in_folder("run/metrics.json"), 0, NULL);
    assert_near(json_number_value(json_object_get(metrics, "psnr")), own, 0.01); /* of 8-bit images */
    json_decref(metrics);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(motion_is_followed)};
    return cmocka_run_group_tests_name("rolling shutters", tests, make_root, folder_remove);
}
