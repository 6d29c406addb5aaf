/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_poses.c -- poses that are learned: they come back where they were disturbed, all of them
   do not drift, a run goes on with them, and whoever opens the run sees from there. */
#include "run_support.h"

#include <pthread.h>
#include <signal.h>

#include "base/rng.h"
#include "base/vec.h"
#include "gbtrace/progress.h"
#include "run/loaded_run.h"
#include "train/align.h"
#include "train/checkpoint.h"
#include "train/pose_file.h"

/* The small turn from one camera to another, in world axes: the antisymmetric part of A^T B. */
static void turn_between(const gbt_camera *from, const gbt_camera *to, double axis[3])
{
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        double ab = 0, ba = 0;
        for (int row = 0; row < 3; row++) {
            ab += to->rotation[3 * row + a] * from->rotation[3 * row + b];
            ba += to->rotation[3 * row + b] * from->rotation[3 * row + a];
        }
        axis[k] = 0.5 * (ba - ab);
    }
}

/* ---- the optimizer ---- */

static void the_mean_stays(void **state)
{
    (void)state;
    trainer t;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    open_ok(&t, tiny, &def);
    assert_int_equal(t.poses.count, t.train_count);
    for (uint64_t i = 0; i < 200; i++) {
        double gradient[POSE_NUMBERS];
        for (int k = 0; k < POSE_NUMBERS; k++)
            gradient[k] = 1 + rng_normal(1, i, (uint64_t)k); /* always to one side */
        poses_step(&t.poses, &t.scene, t.train_views, i % t.train_count, gradient, 1e-4);
    }
    double way[3] = {0}, turn[3] = {0}, longest = 0, largest = 0;
    for (size_t i = 0; i < t.train_count; i++) {
        const gbt_camera *now = &t.scene.views[t.train_views[i]].camera,
                         *given = &t.poses.given[t.train_views[i]];
        double move[3], axis[3];
        for (int k = 0; k < 3; k++)
            move[k] = now->center[k] - given->center[k];
        turn_between(given, now, axis);
        longest = fmax(longest, dvec_length(move));
        largest = fmax(largest, dvec_length(axis));
        for (int k = 0; k < 3; k++) {
            way[k] += move[k] / (double)t.train_count;
            turn[k] += axis[k] / (double)t.train_count;
        }
    }
    print_message("moved by up to %.2e, mean %.1e; turned by up to %.2e, mean %.1e\n", longest,
                  dvec_length(way), largest, dvec_length(turn));
    assert_true(dvec_length(way) < 1e-3 * longest && dvec_length(turn) < 1e-2 * largest);
    trainer_free(&t);
}

/* ---- a scene whose poses are wrong ---- */

/* Mean angle, in degrees, between where the photos are and where they were, when all are turned by the mean
   of the training photos, which is held where it is. */
static double error_of(const trainer *t, const gbt_camera *truth, bool test)
{
    double mean[3] = {0}, sum = 0;
    for (size_t i = 0; i < t->train_count; i++) {
        const size_t v = t->train_views[i];
        double turn[3];
        turn_between(&truth[v], &t->scene.views[v].camera, turn);
        for (int k = 0; k < 3; k++)
            mean[k] += turn[k] / (double)t->train_count;
    }
    for (size_t v = 0; v < t->scene.view_count; v++) {
        double turn[3];
        turn_between(&truth[v], &t->scene.views[v].camera, turn);
        for (int k = 0; k < 3; k++)
            turn[k] -= mean[k];
        sum += t->scene.views[v].is_test == test ? dvec_length(turn) : 0;
    }
    return sum / (double)(test ? t->test_count : t->train_count) * 57.29577951308232;
}

/* More photos, and larger ones: of few, any poses explain what is in them. */
static const char *many_photos(void)
{
    gbt_make_scene_def def = gbt_make_scene_def_default();
    def.width = 80;
    def.height = 60;
    def.view_count = 24;
    def.points = 600;
    def.samples = 4;
    assert_ok(gbt_make_scene(&def, in_folder("many"), NULL));
    return in_folder("many");
}

static void disturbed_poses_come_back(void **state)
{
    (void)state;
    enum { MOST = 24 };
    trainer t;
    gbt_camera truth[MOST];
    gbt_train_def def = run_def();
    def.refine_poses = true;
    def.iterations = 1200;
    open_ok(&t, many_photos(), &def);
    assert_true(t.scene.view_count <= MOST);
    for (size_t i = 0; i < t.scene.view_count; i++) {
        double motion[POSE_NUMBERS] = {0};
        truth[i] = t.scene.views[i].camera;
        for (int k = 3; k < POSE_NUMBERS; k++)
            motion[k] = 0.012 * rng_normal(9, i, (uint64_t)k);
        t.scene.views[i].camera = t.poses.given[i] = gbt_camera_moved(&truth[i], motion);
    }
    const double before = error_of(&t, truth, false), test_before = error_of(&t, truth, true);
    step_report report;
    const size_t anchors_first = t.anchors.count;
    const float scale_first = t.anchors.scale_log[0];
    for (uint64_t i = 0; i < def.iterations; i++) {
        step_ok(&t, &report);
        const double progress = pace_progress(&t.pace, i);
        if (progress < SCHEDULE_POSES_SETTLED)
            assert_true(t.anchors.scale_log[0] == scale_first && t.anchors.offset[0] == 0 && t.began == 0 &&
                        t.anchor_t == i + 1);
        else
            assert_true(t.began == def.iterations / 10 && t.anchor_t == i + 1 - t.began);
        if (progress < SCHEDULE_POSES_SETTLED + SCHEDULE_ADJUST_FROM)
            assert_int_equal(t.anchors.count, anchors_first);
    }
    assert_true(t.anchors.count != anchors_first);
    assert_ok(align_held_out(&t, NULL));
    const double after = error_of(&t, truth, false), test_after = error_of(&t, truth, true);
    print_message("training photos turned by %.2f degrees, then %.2f; held-out ones by %.2f, then %.2f\n",
                  before, after, test_before, test_after);
    assert_true(after < 0.5 * before && test_after < 0.7 * test_before);
    trainer_free(&t);
}

static void the_model_begins_again(void **state)
{
    (void)state;
    trainer t, fresh;
    step_report report;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    open_ok(&t, tiny, &def);
    open_ok(&fresh, tiny, &def);
    const size_t features = t.anchors.count * ANCHOR_FEATURE_DIM * sizeof(float),
                 networks = t.decoder.param_count * sizeof(float);
    for (int i = 0; i < STEPS / 20; i++)
        step_ok(&t, &report);
    assert_true(memcmp(t.anchors.feature, fresh.anchors.feature, features) != 0);
    assert_true(memcmp(t.decoder.params, fresh.decoder.params, networks) != 0);
    assert_ok(trainer_begin_again(&t, NULL));
    assert_int_equal(t.anchor_t, 0);
    assert_memory_equal(t.anchors.feature, fresh.anchors.feature, features);
    assert_memory_equal(t.decoder.params, fresh.decoder.params, networks);
    const learnables *const moments[] = {&t.moment1, &t.moment2}, *const none[] = {&fresh.moment1,
                                                                                   &fresh.moment2};
    for (int i = 0; i < 2; i++) {
        assert_memory_equal(moments[i]->networks, none[i]->networks, networks);
        assert_memory_equal(moments[i]->anchors.feature, none[i]->anchors.feature, features);
    }
    trainer_free(&t);
    trainer_free(&fresh);
}

/* A longer run does not discard what it has learned when it comes to where it would have begun. */
static void a_longer_run_does_not_begin_again(void **state)
{
    (void)state;
    trainer t;
    step_report report;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    open_ok(&t, tiny, &def);
    for (int i = 0; i < STEPS; i++)
        step_ok(&t, &report);
    const uint64_t began = t.began, anchor_t = t.anchor_t;
    assert_int_equal(began, STEPS / 10);
    t.pace = pace_of_iterations(11 * STEPS);
    for (int i = 0; i < STEPS; i++)
        step_ok(&t, &report);
    assert_true(t.began == began && t.anchor_t == anchor_t + STEPS);
    trainer_free(&t);
}

/* ---- runs ---- */

static void a_run_goes_on_with_its_poses(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    train_ok(tiny, in_folder("whole"), &def);
    def.stop_at_step = STEPS / 2;
    train_fails(tiny, in_folder("parts"), &def, GBT_ERR_INTERRUPTED, "stopped");
    def.stop_at_step = 0;
    def.resume = true;
    train_ok(NULL, in_folder("parts"), &def);
    const char *const files[] = {"model.gbt", "poses.json"};
    for (int i = 0; i < 2; i++) {
        const file_bytes a = read_bytes(in_folder("whole/%s", files[i])),
                         b = read_bytes(in_folder("parts/%s", files[i]));
        assert_int_equal(a.count, b.count);
        assert_memory_equal(a.data, b.data, a.count);
        mem_free(a.data);
        mem_free(b.data);
    }
    /* And when it is finished: held-out photos are aligned at the end again. */
    trainer t;
    bool aligned;
    def.iterations = 2 * STEPS;
    def.stop_at_step = STEPS + 1;
    train_fails(NULL, in_folder("parts"), &def, GBT_ERR_INTERRUPTED, "stopped");
    open_ok(&t, tiny, &def);
    assert_ok(pose_file_read(in_folder("parts/poses.json"), &t.scene, &aligned, NULL));
    assert_false(aligned);
    for (size_t i = 0; i < t.scene.view_count; i++)
        for (int k = 0; k < 3 && t.scene.views[i].is_test; k++)
            assert_true(fabs(t.scene.views[i].camera.center[k] - t.poses.given[i].center[k]) < 1e-12);
    trainer_free(&t);
}

/* What is saved on the way says that held-out photos are not aligned. */
static void scoring_leaves_no_pose_behind(void **state)
{
    (void)state;
    trainer t;
    step_report report;
    double psnr;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    open_ok(&t, tiny, &def);
    for (int i = 0; i < STEPS / 2; i++)
        step_ok(&t, &report);
    assert_ok(held_out_psnr(&t, &psnr, NULL));
    assert_true(isfinite(psnr) && t.test_count > 0);
    for (size_t i = 0; i < t.scene.view_count; i++)
        assert_true(t.scene.views[i].is_test ==
                    (memcmp(&t.scene.views[i].camera, &t.poses.given[i], sizeof(gbt_camera)) == 0));
    trainer_free(&t);
}

static void *signal_soon(void *unused)
{
    (void)unused;
    usleep(30000);
    kill(getpid(), SIGTERM);
    return NULL;
}

static void start_signal(const gbt_event *event, void *thread)
{
    if (event->kind == GBT_EVENT_MESSAGE && strstr(event->text, "photos to train on") != NULL)
        assert_int_equal(pthread_create(thread, NULL, signal_soon, NULL), 0);
}

/* Aligning makes the score take some hundred times as long as the step before it, so the signal comes while
   it is made; on a very slow machine before it, with the same end. */
static void a_score_that_a_signal_stops_is_made_later(void **state)
{
    (void)state;
    const char *run = in_folder("unscored"), *last = in_folder("unscored/checkpoints/last.gbt");
    pthread_t thread;
    trainer t;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    def.eval_split = "every=2";
    def.stop_at_step = STEPS / 2;
    train_fails(tiny, run, &def, GBT_ERR_INTERRUPTED, "after step 30");
    open_ok(&t, tiny, &def);
    assert_ok(checkpoint_load(&t, last, NULL));
    def.resume = true;
    def.stop_at_step = 0;
    def.eval_at_seconds[0] = t.seconds + 1e-9;
    def.eval_at_count = 1;
    trainer_free(&t);
    signal(SIGTERM, SIG_IGN); /* should it come too late */
    gbt_listen(start_signal, &thread);
    train_fails(NULL, run, &def, GBT_ERR_INTERRUPTED, "after step 31; saved in ");
    gbt_listen(NULL, NULL);
    assert_int_equal(pthread_join(thread, NULL), 0);
    signal(SIGTERM, SIG_DFL);
    train_ok(NULL, run, &def);
    const file_bytes summary = read_bytes(in_folder("unscored/train.json"));
    assert_non_null(strstr((const char *)summary.data, "\"step\": 32,"));
    mem_free(summary.data);
}

/* A signal as soon as the run has been summed up, which is when held-out photos are aligned. */
static void *signal_at_summary(void *path)
{
    while (!file_exists(path))
        usleep(200);
    kill(getpid(), SIGTERM);
    return NULL;
}

static void held_out_photos_are_aligned_after_a_signal(void **state)
{
    (void)state;
    pthread_t thread;
    char summary[PATH_SIZE];
    snprintf(summary, sizeof summary, "%s", in_folder("stopped/train.json"));
    gbt_train_def def = run_def();
    def.refine_poses = true;
    def.eval_split = "every=2";
    train_ok(tiny, in_folder("unstopped"), &def);
    signal(SIGTERM, SIG_IGN); /* should it come too late */
    assert_int_equal(pthread_create(&thread, NULL, signal_at_summary, summary), 0);
    train_fails(tiny, in_folder("stopped"), &def, GBT_ERR_INTERRUPTED, "resume continues");
    assert_int_equal(pthread_join(thread, NULL), 0);
    signal(SIGTERM, SIG_DFL);
    file_bytes before = read_bytes(summary);
    def.resume = true;
    train_ok(NULL, in_folder("stopped"), &def);
    assert_same_file(in_folder("unstopped/model.gbt"), in_folder("stopped/model.gbt"));
    assert_same_file(in_folder("unstopped/poses.json"), in_folder("stopped/poses.json"));
    file_bytes after = read_bytes(summary);
    assert_int_equal(before.count, after.count);
    assert_memory_equal(before.data, after.data, before.count);
    mem_free(before.data);
    mem_free(after.data);
}

/* Poses differ from those of the data set, and whoever opens the run has them; with other data that has its
   own, not. */
static void whoever_opens_the_run_has_them(void **state)
{
    (void)state;
    static loaded_run run, of_data;
    assert_ok(loaded_run_open(in_folder("whole"), NULL, 0, &run, NULL));
    make_tiny_scene(in_folder("again"));
    assert_ok(loaded_run_open(in_folder("whole"), in_folder("again"), 0, &of_data, NULL));
    double moved = 0;
    for (size_t i = 0; i < run.scene.view_count; i++)
        for (int k = 0; k < 3; k++)
            moved = fmax(moved,
                         fabs(run.scene.views[i].camera.center[k] - of_data.scene.views[i].camera.center[k]));
    assert_true(moved > 1e-6 && moved < 0.1);
    loaded_run_close(&run);
    loaded_run_close(&of_data);
}

static void what_is_no_pose_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } cases[] = {
        {"{", "poses.json:1"},
        {"{\"photos\": 3}", "wanted an array"},
        {"{\"photos\": [{\"name\": \"a\", \"center\": [0, 0, 0]}]}", "photo 0: no pose"},
        {"{\"photos\": [{\"name\": \"a\", \"center\": [0, 0, 0], \"rotation\": [2, 0, 0, 0, 1, 0, 0, 0, "
         "1]}]}",
         "photo 0: no pose"},
        {"{\"photos\": [{\"name\": \"a\", \"center\": [0, 0], \"rotation\": [1, 0, 0, 0, 1, 0, 0, 0, 1]}]}",
         "photo 0: no pose"},
    };
    scene s;
    bool aligned;
    assert_ok(scene_load(tiny, NULL, &s, NULL));
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        gbt_error err = {0};
        write_text(in_folder("poses.json"), cases[i].text);
        assert_int_equal(pose_file_read(in_folder("poses.json"), &s, &aligned, &err), GBT_ERR_FORMAT);
        if (strstr(err.text, cases[i].says) == NULL)
            fail_msg("wanted \"%s\", got: %s", cases[i].says, err.text);
    }
    assert_ok(pose_file_write(&s, false, in_folder("poses.json"), NULL));
    gbt_camera first = s.views[0].camera;
    s.views[0].camera.center[1] += 1;
    assert_ok(pose_file_read(in_folder("poses.json"), &s, &aligned, NULL));
    assert_false(aligned);
    for (int k = 0; k < 3; k++)
        assert_true(fabs(s.views[0].camera.center[k] - first.center[k]) < 1e-12);
    s.views[0].name[0] = '\xdf'; /* names of other encodings than UTF-8 stay different */
    s.views[1].name[0] = '\xe4';
    snprintf(s.views[1].name + 1, strlen(s.views[1].name), "%s", s.views[0].name + 1);
    const gbt_camera second = s.views[1].camera;
    assert_ok(pose_file_write(&s, true, in_folder("poses.json"), NULL));
    s.views[0].camera.center[1] += 1;
    s.views[1].camera.center[1] += 1;
    assert_ok(pose_file_read(in_folder("poses.json"), &s, &aligned, NULL));
    assert_true(aligned);
    for (int k = 0; k < 3; k++)
        assert_true(fabs(s.views[0].camera.center[k] - first.center[k]) < 1e-12 &&
                    fabs(s.views[1].camera.center[k] - second.center[k]) < 1e-12);
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_mean_stays),
        cmocka_unit_test(disturbed_poses_come_back),
        cmocka_unit_test(the_model_begins_again),
        cmocka_unit_test(a_longer_run_does_not_begin_again),
        cmocka_unit_test(a_run_goes_on_with_its_poses),
        cmocka_unit_test(scoring_leaves_no_pose_behind),
        cmocka_unit_test(a_score_that_a_signal_stops_is_made_later),
        cmocka_unit_test(held_out_photos_are_aligned_after_a_signal),
        cmocka_unit_test(whoever_opens_the_run_has_them),
        cmocka_unit_test(what_is_no_pose_is_refused),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
