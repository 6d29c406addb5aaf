/* SPDX-License-Identifier: Apache-2.0 */
/* tests/pose/test_known.c -- COLMAP's poses of a procedural scene against the true ones. Skipped without
   COLMAP. */
#include "data/scene.h"
#include "folder.h"
#include "gbtrace/make_scene.h"
#include "gbtrace/pose.h"

enum { VIEWS = 48, PHOTOS = 12 };

/* The first photos of the scene: neighbours, 7.5 degrees apart, from two rings. */
static void take_photos(void)
{
    gbt_error err = {0};
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.name = "courtyard";
    def.width = 480;
    def.height = 360;
    def.view_count = VIEWS;
    def.samples = 4;
    def.points = 200;
    assert_ok(gbt_make_scene(&def, in_folder("scene"), &err));
    assert_ok(file_make_folder(in_folder("the photos"), &err));
    for (int i = 0; i < PHOTOS; i++) {
        const char *from = in_folder("scene/images/%04d.png", i);
        assert_int_equal(link(from, in_folder("the photos/%04d.png", i)), 0);
    }
}

/* With rotations A and B from our world and from the true one to the camera: B^T A, from our world to the
   true one. */
static void turn_between(const gbt_camera *ours, const gbt_camera *truth, double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            out[3 * i + k] = 0;
            for (int c = 0; c < 3; c++)
                out[3 * i + k] += truth->rotation[3 * c + i] * ours->rotation[3 * c + k];
        }
}

static double degrees_between(const double a[9], const double b[9])
{
    double trace = 0;
    for (int i = 0; i < 9; i++)
        trace += a[i] * b[i];
    return 57.29577951308232 * acos(fmin(1, fmax(-1, (trace - 1) / 2)));
}

static const scene_view *view_of(const scene *s, const char *name)
{
    for (size_t i = 0; i < s->view_count; i++)
        if (strcmp(s->views[i].name, name) == 0)
            return &s->views[i];
    return NULL;
}

static void compare(const scene *ours, const scene *truth)
{
    double turn[9], mean_ours[3] = {0}, mean_truth[3] = {0}, spread_ours = 0, spread_truth = 0,
                    worst_turn = 0, worst_place = 0;
    turn_between(&ours->views[0].camera, &view_of(truth, ours->views[0].name)->camera, turn);
    for (size_t i = 0; i < ours->view_count; i++)
        for (int k = 0; k < 3; k++) {
            mean_ours[k] += ours->views[i].camera.center[k] / (double)ours->view_count;
            mean_truth[k] += view_of(truth, ours->views[i].name)->camera.center[k] / (double)ours->view_count;
        }
    for (size_t i = 0; i < ours->view_count; i++)
        for (int k = 0; k < 3; k++) {
            spread_ours += pow(ours->views[i].camera.center[k] - mean_ours[k], 2);
            spread_truth += pow(view_of(truth, ours->views[i].name)->camera.center[k] - mean_truth[k], 2);
        }
    for (size_t i = 0; i < ours->view_count; i++) {
        const gbt_camera *a = &ours->views[i].camera, *b = &view_of(truth, ours->views[i].name)->camera;
        double now[9], off = 0;
        turn_between(a, b, now);
        worst_turn = fmax(worst_turn, degrees_between(now, turn));
        for (int k = 0; k < 3; k++) {
            double moved = 0;
            for (int c = 0; c < 3; c++)
                moved += turn[3 * k + c] * (a->center[c] - mean_ours[c]);
            off += pow(sqrt(spread_truth / spread_ours) * moved - (b->center[k] - mean_truth[k]), 2);
        }
        worst_place = fmax(worst_place, sqrt(off / (spread_truth / (double)ours->view_count)));
    }
    printf("largest errors: %.3f degrees; %.4f of the cameras' spread\n", worst_turn, worst_place);
    assert_true(worst_turn < 1);
    assert_true(worst_place < 0.05);
}

static gbt_status find(const gbt_pose_def *def)
{
    gbt_error err = {0};
    const gbt_status status = gbt_pose(in_folder("the photos"), def, in_folder("the data"), stdout, &err);
    if (status != GBT_OK)
        print_message("%s\n", err.text);
    return status;
}

static void test_poses_of_a_known_scene(void **state)
{
    (void)state;
    if (system("command -v colmap >/dev/null") != 0) {
        print_message("skipped: colmap is not installed (Debian: colmap)\n");
        skip();
    }
    gbt_error err = {0};
    scene ours, truth;
    gbt_pose_def def = gbt_pose_def_default();
    def.camera_model = GBT_POSE_CAMERA_PINHOLE;
    take_photos();
    assert_ok(find(&def));
    assert_ok(scene_load(in_folder("the data"), NULL, &ours, &err));
    assert_ok(scene_load(in_folder("scene"), NULL, &truth, &err));
    assert_int_equal(ours.view_count, PHOTOS);
    compare(&ours, &truth);
    scene_free(&ours);
    scene_free(&truth);
    /* Once finished, the same call says the same again, without COLMAP. */
    assert_int_equal(setenv("PATH", "/nothing", 1), 0);
    assert_ok(find(&def));
    assert_ok(gbt_pose(in_folder("the photos"), &def, in_folder("the data"), NULL, &err)); /* to nobody */
    def.camera_model = GBT_POSE_CAMERA_OPENCV;
    assert_int_equal(find(&def), GBT_ERR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_poses_of_a_known_scene)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
