/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_step_views.c -- several views a step: which photos, the mean of their gradients, the sum
   of their statistics, the same bits for every number of threads. */
#include "run_support.h"

#include "gbtrace/train.h"
#include "train/adam.h"
#include "train/growing.h"
#include "train/step_rows.h"

/* Every photo once an epoch, whatever the number of views: those of a step are those of as many steps. */
static void photos_come_in_the_same_order(void **state)
{
    (void)state;
    size_t alone[16];
    for (int views = 1; views <= 4; views *= 2) {
        gbt_train_def def = run_def();
        def.views = views;
        trainer t;
        open_ok(&t, tiny, &def);
        for (int n = 0; n < 16; n += views) {
            step_photos_pick(&t);
            for (int i = 0; i < views; i++) {
                if (views == 1)
                    alone[n] = t.slots[0];
                assert_int_equal(t.slots[i], alone[n + i]);
            }
            t.step++;
        }
        trainer_free(&t);
    }
}

static void run_view(trainer *t, size_t i)
{
    step_view_pick(t, &t->views[i], i);
    step_view_run(t, &t->views[i]);
    if (t->views[i].outcome.status != GBT_OK)
        fail_msg("%s", t->views[i].outcome.text);
}

/* The trainer's gradient is the mean of what each view says alone, added as a tree; statistics are the sum.
 */
static void a_step_learns_from_the_mean(void **state)
{
    (void)state;
    enum { V = 4 };
    gbt_train_def def = run_def();
    def.views = V;
    trainer t;
    step_report r;
    open_ok(&t, tiny, &def);
    while (!growing_gathers(&t))
        step_ok(&t, &r);
    step_photos_pick(&t);
    const size_t n = t.anchors.count * ANCHOR_FEATURE_DIM, rows = t.anchors.count;
    float *feature[V], *visits[V], *networks[V];
    for (size_t i = 0; i < V; i++) {
        run_view(&t, i);
        feature[i] = mem_calloc(n, sizeof(float), "test", NULL);
        visits[i] = mem_calloc(rows, sizeof(float), "test", NULL);
        networks[i] = mem_calloc(t.decoder.param_count, sizeof(float), "test", NULL);
        const step_view *v = &t.views[i];
        assert_int_equal(v->gradient.anchors.count, v->frame.visible_count);
        for (size_t row = 0; row < v->frame.visible_count; row++) {
            memcpy(feature[i] + v->frame.visible[row] * (size_t)ANCHOR_FEATURE_DIM,
                   v->gradient.anchors.feature + row * ANCHOR_FEATURE_DIM,
                   ANCHOR_FEATURE_DIM * sizeof(float));
            visits[i][v->frame.visible[row]] = v->stats.visit_count[row];
        }
        memcpy(networks[i], v->gradient.networks, t.decoder.param_count * sizeof(float));
    }
    float *before = mem_calloc(rows, sizeof(float), "test", NULL);
    memcpy(before, t.stats.visit_count, rows * sizeof(float));
    step_report report = {0};
    assert_ok(step_rows_add_up(&t, &report, NULL));
    size_t seen = 0;
    for (size_t i = 0; i < n; i++) {
        const float sum = (feature[0][i] + feature[1][i]) + (feature[2][i] + feature[3][i]);
        assert_true(t.gradient.anchors.feature[i] == sum / V);
        seen += sum != 0;
    }
    assert_true(seen > 0);
    for (size_t i = 0; i < t.decoder.param_count; i++)
        assert_true(t.gradient.networks[i] ==
                    ((networks[0][i] + networks[1][i]) + (networks[2][i] + networks[3][i])) / V);
    for (size_t i = 0; i < rows; i++)
        assert_true(t.stats.visit_count[i] ==
                    before[i] + visits[0][i] + visits[1][i] + visits[2][i] + visits[3][i]);
    for (size_t i = 0; i < V; i++) {
        mem_free(feature[i]);
        mem_free(visits[i]);
        mem_free(networks[i]);
    }
    mem_free(before);
    trainer_free(&t);
}

/* Both kinds of steps, growth and exposures included. */
static void threads_do_not_matter(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.views = 2;
    def.exposure = true;
    for (int threads = 1; threads <= 3; threads += 2) {
        gbt_set_threads(threads);
        train_ok(tiny, in_folder("threads-%d", threads), &def);
    }
    assert_same_file(in_folder("threads-1/model.gbt"), in_folder("threads-3/model.gbt"));
    def.views = 1;
    train_ok(tiny, in_folder("alone"), &def);
    assert_false(is_same_file(in_folder("threads-1/model.gbt"), in_folder("alone/model.gbt")));
}

/* V steps of one view forget as much as one step of V. */
static void moments_forget_by_views(void **state)
{
    (void)state;
    const adam_rates one = adam_rates_at(1, 8), four = adam_rates_of_views(1, 2, 4);
    assert_true(one.beta1 == 0.9f && one.new1 == 0.1f && one.beta2 == 0.999f && one.new2 == 0.001f);
    assert_true(fabsf(four.beta1 - 0.6561f) < 1e-6f && fabsf(four.beta2 - 0.996006f) < 1e-6f);
    assert_true(four.correct_m == one.correct_m && four.correct_v == one.correct_v);
}

/* Adam's first step is one rate long. With V views a step is sqrt(V) of those of one view, what photos have
   of their own is as in V steps, and a run of n steps is as long as one of V n. */
static void rates_follow_the_views(void **state)
{
    (void)state;
    enum { V = 4, LENGTH = 4000 };
    gbt_train_def def = run_def();
    def.views = V;
    def.iterations = LENGTH;
    def.grow = false;
    def.exposure = def.refine_poses = true;
    trainer t;
    step_report r;
    open_ok(&t, tiny, &def);
    for (t.step = LENGTH / 2; t.step * V % t.train_count != 0;) /* an epoch begins: V photos */
        t.step++;
    const double progress = pace_progress(&t.pace, t.step), step = 1.0 / (V * LENGTH);
    const learning_rates rates = learning_rates_at(&(learning_rates_def){.progress = progress,
                                                                         .uses_own_rates = true,
                                                                         .extent = t.extent,
                                                                         .factor = 2,
                                                                         .end = schedule_rate_end(V * LENGTH),
                                                                         .views = V});
    const size_t offsets = t.anchors.count * 3 * (size_t)t.anchors.offset_count, scales = t.anchors.count * 6;
    float *offset = mem_alloc(offsets, sizeof *offset, "test", NULL),
          *scale = mem_alloc(scales, sizeof *scale, "test", NULL);
    memcpy(offset, t.anchors.offset, offsets * sizeof *offset);
    memcpy(scale, t.anchors.scale_log, scales * sizeof *scale);
    step_ok(&t, &r);
    double way[4] = {0};
    for (size_t i = 0; i < offsets; i++)
        way[0] = fmax(way[0], fabs((double)t.anchors.offset[i] - (double)offset[i]));
    for (size_t i = 0; i < scales; i++) /* upward: a limit may move them down */
        way[1] = fmax(way[1], (double)t.anchors.scale_log[i] - (double)scale[i]);
    bool seen[VIEWS] = {false};
    for (int i = 0; i < V; i++)
        seen[t.slots[i]] = true;
    size_t other = 0; /* moved only by what holds the mean of all */
    while (seen[other])
        other++;
    assert_true(other < t.train_count);
    const float *a = t.exposures.matrix + t.slots[0] * AFFINE_NUMBERS,
                *b = t.exposures.matrix + other * AFFINE_NUMBERS;
    for (int k = 0; k < AFFINE_NUMBERS; k++)
        way[2] = fmax(way[2], fabs((double)a[k] - (double)b[k]));
    const size_t views[2] = {t.train_views[t.slots[0]], t.train_views[other]};
    double move[2][3];
    for (int k = 0; k < 6; k++)
        move[k / 3][k % 3] =
            t.scene.views[views[k / 3]].camera.center[k % 3] - t.poses.given[views[k / 3]].center[k % 3];
    for (int k = 0; k < 3; k++)
        way[3] += (move[0][k] - move[1][k]) * (move[0][k] - move[1][k]) / 3;
    way[3] = sqrt(way[3]) / t.poses.unit;
    const double wanted[4] = {rates.anchor[ANCHOR_OFFSET], rates.anchor[ANCHOR_SCALE_LOG],
                              exposures_rate(t.train_count, progress, step),
                              poses_rate(t.train_count, progress, step)};
    for (int i = 0; i < 4; i++)
        if (!(fabs(way[i] / wanted[i] - 1) < 0.01))
            fail_msg("%d: moved by %g, wanted %g", i, way[i], wanted[i]);
    mem_free(offset);
    mem_free(scale);
    trainer_free(&t);
}

/* A round judges by views: 40 of them since the one before, in a run of 16,000. */
static void rounds_count_views(void **state)
{
    (void)state;
    static const struct {
        float visits, importance;
        bool stays;
    } cases[] = {{24, 0, true}, {33, 5e-7f, false}, {33, 9e-7f, true}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        gbt_train_def def = run_def();
        def.views = 4;
        def.iterations = 4000;
        trainer t;
        open_ok(&t, tiny, &def);
        t.round_step = 390;
        t.step = 399;
        const size_t n = t.anchors.count;
        for (size_t i = 0; i < n; i++) {
            t.stats.visit_count[i] = t.stats.shown_count[i] = cases[c].visits;
            t.stats.importance_accum[i] = cases[c].visits * cases[c].importance;
        }
        assert_ok(growing_round(&t, NULL));
        assert_int_equal(t.anchors.count, cases[c].stays ? n : 1); /* one stays always */
        trainer_free(&t);
    }
}

static void views_are_a_power_of_two(void **state)
{
    (void)state;
    static const int bad[] = {0, 3, 65, -1};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        gbt_train_def def = run_def();
        gbt_error err = {0};
        def.views = bad[i];
        assert_int_equal(gbt_train(tiny, in_folder("refused"), &def, &err), GBT_ERR_ARGUMENT);
        assert_true(strncmp(err.text, "views: ", 7) == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(photos_come_in_the_same_order), cmocka_unit_test(a_step_learns_from_the_mean),
        cmocka_unit_test(threads_do_not_matter),         cmocka_unit_test(moments_forget_by_views),
        cmocka_unit_test(rates_follow_the_views),        cmocka_unit_test(rounds_count_views),
        cmocka_unit_test(views_are_a_power_of_two),
    };
    return cmocka_run_group_tests(tests, make_root, folder_remove);
}
