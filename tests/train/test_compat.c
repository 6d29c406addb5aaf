/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_compat.c -- each quirk of the reference implementation that docs/compat.md lists: there
   with `compat`, not there without. */
#include "run_support.h"

#include "train/growing.h"

enum { WHOLE = 30000 }; /* steps of the reference's run */

static gbt_train_def def_of(bool compat)
{
    gbt_train_def def = run_def();
    def.compat = compat;
    def.voxel_size = 0.02f;
    return def;
}

/* A run of WHOLE steps in front of which there is no data. */
static trainer long_run(bool compat)
{
    trainer t = {.def = def_of(compat), .pace = pace_of_iterations(WHOLE)};
    t.rules = train_rules_of(&t.def);
    return t;
}

/* Of a whole run the steps, counted from 1, in which something is done. */
typedef struct steps_found {
    size_t count, first, last;
} steps_found;

static steps_found find_steps(trainer *t, bool (*is_done)(const trainer *t))
{
    steps_found found = {0};
    for (t->step = 0; t->step < WHOLE; t->step++)
        if (is_done(t)) {
            found.last = (size_t)t->step + 1;
            found.first = found.count++ == 0 ? found.last : found.first;
        }
    return found;
}

/* 1600, 1700, ... 14900: neither the step at which growth may begin nor that at which it ends. */
static void there_are_134_rounds(void **state)
{
    (void)state;
    trainer t = long_run(true);
    const steps_found rounds = find_steps(&t, growing_is_due);
    assert_int_equal(rounds.count, 134);
    assert_int_equal(rounds.first, 1600);
    assert_int_equal(rounds.last, 14900);
    t = long_run(false);
    assert_int_equal(find_steps(&t, growing_is_due).count, 45);
}

static void statistics_are_of_steps_501_to_14999(void **state)
{
    (void)state;
    trainer t = long_run(true);
    const steps_found steps = find_steps(&t, growing_gathers);
    assert_int_equal(steps.count, 14499);
    assert_int_equal(steps.first, 501);
    assert_int_equal(steps.last, 14999);
}

/* I of the first two rounds: the views of the steps that gathered; of the reference 100 always. */
static void rounds_count_what_was_gathered(void **state)
{
    (void)state;
    static const struct {
        uint64_t steps;
        bool compat, refine_poses;
        float first;
    } cases[] = {{1200, false, false, 52}, /* steps 20 to 71 */
                 {2400, false, false, 100},
                 {1200, false, true, 52}, /* steps 140 to 191 */
                 {WHOLE, true, false, 100}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        trainer t = {.def = def_of(cases[i].compat), .pace = pace_of_iterations(cases[i].steps)};
        t.def.refine_poses = cases[i].refine_poses;
        t.rules = train_rules_of(&t.def);
        float gathered = 0;
        for (int round = 0; round < 2; t.step++) {
            gathered += growing_gathers(&t);
            if (!growing_is_due(&t))
                continue;
            const float interval = growing_interval(&t);
            assert_true(round > 0 || interval == cases[i].first);
            assert_true(interval == (cases[i].compat ? 100 : fminf(fmaxf(gathered, 20), 100)));
            t.round_step = t.step + 1;
            gathered = 0;
            round++;
        }
    }
}

/* Growth to a third of the run ends before step 10,000, though a third is no double. */
static void growth_ends_before_its_last_step(void **state)
{
    (void)state;
    trainer t = long_run(true);
    t.def.grow_until = 1.0 / 3;
    assert_int_equal(find_steps(&t, growing_is_due).last, 9900);
}

/* Rates of the networks of colour and opacity, by the reference's formula at step 1, 1500, ... */
static void rates_count_from_one(void **state)
{
    (void)state;
    static const struct {
        uint64_t step;
        double color, opacity, offset;
    } wanted[] = {{1, 7.9986467e-3, 1.999693e-3, 9.9984651e-3},
                  {1500, 6.207032e-3, 1.5886565e-3, 7.9432823e-3},
                  {15000, 6.3245553e-4, 2e-4, 1e-3},
                  {29999, 5.0008459e-5, 2.000307e-5, 1.0001535e-4}};
    trainer t = long_run(true);
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        t.step = wanted[i].step - 1;
        const learning_rates r = learning_rates_at(
            &(learning_rates_def){.progress = train_rules_progress(&t.rules, &t.pace, t.step),
                                  .uses_own_rates = t.rules.own_rates,
                                  .extent = 2,
                                  .factor = 1,
                                  .end = 1,
                                  .views = 1});
        assert_true(fabs(r.network[DECODER_COLOR] / wanted[i].color - 1) < 1e-6);
        assert_true(fabs(r.network[DECODER_OPACITY] / wanted[i].opacity - 1) < 1e-6);
        assert_true(fabs(r.anchor[ANCHOR_OFFSET] / (2 * wanted[i].offset) - 1) < 1e-6);
    }
}

/* Does a step change the networks? And the offsets of the anchors? */
static void step_and_compare(trainer *t, bool *of_networks, bool *of_anchors)
{
    const size_t params = t->decoder.param_count, offsets = 3 * t->anchors.count * (size_t)t->def.offsets;
    float *before = malloc((params + offsets) * sizeof *before);
    assert_non_null(before);
    memcpy(before, t->decoder.params, params * sizeof *before);
    memcpy(before + params, t->anchors.offset, offsets * sizeof *before);
    step_report r;
    step_ok(t, &r);
    *of_networks = memcmp(before, t->decoder.params, params * sizeof *before) != 0;
    *of_anchors = memcmp(before + params, t->anchors.offset, offsets * sizeof *before) != 0;
    free(before);
}

static void the_last_step_teaches_nothing(void **state)
{
    (void)state;
    for (int compat = 0; compat <= 1; compat++) {
        gbt_train_def def = def_of(compat == 1);
        def.grow = false;
        trainer t;
        open_ok(&t, tiny, &def);
        for (int i = 0; i < STEPS; i++) {
            bool networks, offsets;
            step_and_compare(&t, &networks, &offsets);
            const bool learns = compat == 0 || i + 1 < STEPS;
            if (networks != learns || offsets != learns)
                fail_msg("compat %d, step %d: networks %s, offsets %s", compat, i + 1,
                         networks ? "learn" : "rest", offsets ? "learn" : "rest");
        }
        trainer_free(&t);
    }
}

/* Of the statistics nothing is left that could grow or prune. */
static void anchors_rest_in_a_round(void **state)
{
    (void)state;
    gbt_train_def def = def_of(true);
    def.iterations = 400;
    trainer t;
    step_report r;
    open_ok(&t, tiny, &def);
    for (int i = 0; i < 99; i++)
        step_ok(&t, &r);
    const size_t k = (size_t)t.stats.offset_count;
    memset(t.stats.visit_count, 0, t.stats.count * sizeof(float));
    memset(t.stats.grad_count, 0, t.stats.count * k * sizeof(float));
    assert_true(growing_is_due(&t));
    bool networks, offsets;
    step_and_compare(&t, &networks, &offsets);
    assert_true(networks && !offsets);
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++) /* not kept for the next step */
        for (size_t i = 0; i < t.anchors.count * anchors_width(&t.anchors, f); i++)
            assert_true(t.gradient.anchors.field[f][i] == 0);
    step_and_compare(&t, &networks, &offsets);
    assert_true(networks && offsets);
    trainer_free(&t);
}

static void long_runs_leave_anchors_out(void **state)
{
    (void)state;
    for (int compat = 0; compat <= 1; compat++) {
        gbt_train_def def = def_of(compat == 1);
        def.iterations = 300 * VIEWS * 4; /* steps use one pixel in 4 */
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        step_ok(&t, &r);
        assert_true((t.left_out > 0) == (compat == 0));
        trainer_free(&t);
    }
}

/* The other rules, whose effects are tested where they act; and what they make of settings and scene. */
static void the_other_rules_are_the_references(void **state)
{
    (void)state;
    const gbt_train_def def = def_of(true);
    trainer t;
    open_ok(&t, tiny, &def);
    const train_rules *r = &t.rules;
    assert_true(t.def.offsets == 10 && t.def.scale_factor == 1 && t.def.footprint == 0 &&
                t.def.step_pixels == 0);
    assert_true(!r->features_from_colors && r->raises_until == 0 && !r->limits_first_scale);
    for (size_t i = 0; i < t.anchors.count * ANCHOR_FEATURE_DIM; i++)
        assert_true(t.anchors.feature[i] == 0);
    assert_int_equal(r->voxel, GBT_VOXEL_RULE_SQUARED);
    assert_true(r->ball_radius_min == 1e-6f);
    assert_true(r->integer_division && r->coarse_level_gates && r->at_cell_center);
    assert_true(!r->own_adam_age && r->importance == GROWTH_BY_OPACITY && r->shape_log_max == 0.05f);
    assert_true(!r->thresholds_by_length && !r->grows_at_points && !r->needs_two_views);
    assert_true(!t.decoder.has_distance && !r->distance_where_wide);
    assert_true(isinf(r->step_pixels) && r->splats_until == 0 && !r->loose_rays && r->spread == 0);
    for (int c = 0; c < 3; c++)
        assert_true(t.settings.background[c] == 0);
    trainer_free(&t);
}

/* The loss on how far apart hits are acts by default, with loose rays alone. */
static void hits_are_drawn_together(void **state)
{
    (void)state;
    const gbt_train_def def = def_of(false);
    for (int loose = 0; loose <= 1; loose++) {
        trainer t[2];
        step_report r;
        for (int i = 0; i < 2; i++) {
            open_ok(&t[i], tiny, &def);
            assert_true(t[i].rules.spread > 0);
            t[i].rules.loose_rays = loose == 1;
            t[i].rules.spread *= i;
            step_ok(&t[i], &r);
        }
        const size_t bytes = t[0].decoder.param_count * sizeof(float);
        assert_true((memcmp(t[0].decoder.params, t[1].decoder.params, bytes) != 0) == (loose == 1));
        for (int i = 0; i < 2; i++)
            trainer_free(&t[i]);
    }
}

/* All opacities a little above 0: nothing is drawn, and still all count in the loss's last term. */
static void faint_gaussians_count(void **state)
{
    (void)state;
    for (int compat = 0; compat <= 1; compat++) {
        const gbt_train_def def = def_of(compat == 1);
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        decoder_network networks[DECODER_NETWORKS];
        decoder_networks(&t.decoder, networks);
        const decoder_network *p = &networks[DECODER_OPACITY];
        memset(t.decoder.params + p->begin, 0, (p->end - p->begin) * sizeof(float));
        for (int k = 0; k < t.def.offsets; k++)
            t.decoder.params[p->end - 1 - (size_t)k] = 0.002f; /* below 1/255 */
        t.rules.raises_until = 0;
        for (size_t i = 0; i < t.anchors.count; i++)
            for (size_t c = 3; c < 6; c++)
                t.anchors.scale_log[6 * i + c] = 0;
        step_ok(&t, &r);
        assert_int_equal(r.gaussians, compat == 1 ? r.visible * (size_t)t.def.offsets : 0);
        assert_int_equal(t.views[0].frame.counters.blended, 0);
        assert_true((r.loss - (0.8 * r.l1 + 0.2 * (1 - r.ssim)) > 1e-4) == (compat == 1));
        trainer_free(&t);
    }
}

static void nothing_is_nearer_than_a_fifth(void **state)
{
    (void)state;
    const gbt_train_def def = def_of(true);
    trainer t;
    open_ok(&t, tiny, &def);
    assert_true(t.settings.t_near == 0.2f);
    trainer_free(&t);
}

/* An anchor beside the picture is decoded if its own ellipsoid touches it, not if only its Gaussians do. */
static void anchors_are_seen_by_themselves(void **state)
{
    (void)state;
    for (int compat = 0; compat <= 1; compat++) {
        const gbt_train_def def = def_of(compat == 1);
        trainer t;
        step_report r;
        open_ok(&t, tiny, &def);
        for (size_t i = 0; i < t.anchors.count; i++)
            for (size_t c = 0; c < 6; c++)
                t.anchors.scale_log[6 * i + c] = logf(c < 3 ? 1e-3f : 100.0f);
        step_ok(&t, &r);
        size_t on_screen = 0;
        static const float quat[4] = {1, 0, 0, 0}, scale[3] = {1e-3f, 1e-3f, 1e-3f};
        const screen_view screen = screen_of(&t.views[0].frame.camera, (double)t.settings.t_near);
        for (size_t i = 0; i < t.anchors.count; i++)
            on_screen += screen_touches(&screen, t.anchors.position + 3 * i, quat, scale);
        assert_true(on_screen > 0 && on_screen < t.anchors.count);
        assert_int_equal(r.visible, compat == 1 ? on_screen : t.anchors.count);
        assert_int_equal(t.views[0].frame.by_screen, compat == 1);
        trainer_free(&t);
    }
}

/* Anchors of voxels are whole multiples of v in the world. */
static void voxels_are_where_the_world_puts_them(void **state)
{
    (void)state;
    gbt_train_def def = def_of(true);
    def.init = GBT_INIT_VOXEL;
    trainer t;
    open_ok(&t, tiny, &def);
    for (int k = 0; k < 3; k++)
        assert_true(t.scene.origin[k] == 0);
    for (size_t i = 0; i < 3 * t.anchors.count; i++)
        assert_true(t.anchors.position[i] == rintf(t.anchors.position[i] / def.voxel_size) * def.voxel_size);
    trainer_free(&t);
    def.compat = false;
    open_ok(&t, tiny, &def);
    assert_true(t.scene.origin[0] != 0 || t.scene.origin[1] != 0 || t.scene.origin[2] != 0);
    trainer_free(&t);
}

/* The tiny scene as one of Blender's: photos with an alpha channel, no points. */
static void write_blender(const char *folder)
{
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    char path[PATH_SIZE];
    assert_ok(file_make_folder(folder, NULL));
    snprintf(path, sizeof path, "%s/train", folder);
    assert_ok(file_make_folder(path, NULL));
    snprintf(path, sizeof path, "%s/transforms_train.json", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    const gbt_camera *c = &s.views[0].camera;
    fprintf(file, "{\"camera_angle_x\": %.17g, \"frames\": [", 2 * atan(0.5 * c->width / c->params[0]));
    for (size_t i = 0; i < s.view_count; i++) {
        image photo, with_alpha;
        assert_ok(image_read(s.views[i].path, &photo, NULL));
        assert_ok(image_alloc(&with_alpha, photo.width, photo.height, 4, NULL));
        for (int p = 0; p < photo.width * photo.height; p++) {
            memcpy(with_alpha.pixels + 4 * p, photo.pixels + photo.channels * p, 3 * sizeof(float));
            with_alpha.pixels[4 * p + 3] = p > 0;
        }
        snprintf(path, sizeof path, "%s/train/%zu.png", folder, i);
        assert_ok(image_write(path, &with_alpha, NULL));
        image_free(&with_alpha);
        image_free(&photo);
        fprintf(file, "%s{\"file_path\": \"./train/%zu\", ", i > 0 ? ", " : "", i);
        put_pose(file, &s, i);
    }
    fprintf(file, "]}\n");
    assert_int_equal(fclose(file), 0);
    scene_free(&s);
}

static void scenes_of_blender_lie_on_black(void **state)
{
    (void)state;
    const char *folder = in_folder("blender");
    write_blender(folder);
    for (int compat = 0; compat <= 1; compat++) {
        const gbt_train_def def = def_of(compat == 1);
        trainer t;
        open_ok(&t, folder, &def);
        assert_string_equal(t.scene.source, "blender");
        for (int c = 0; c < 3; c++)
            assert_true(t.settings.background[c] == (compat == 1 ? 0.0f : 1.0f));
        trainer_free(&t);
    }
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(there_are_134_rounds),
        cmocka_unit_test(statistics_are_of_steps_501_to_14999),
        cmocka_unit_test(rounds_count_what_was_gathered),
        cmocka_unit_test(growth_ends_before_its_last_step),
        cmocka_unit_test(rates_count_from_one),
        cmocka_unit_test(the_last_step_teaches_nothing),
        cmocka_unit_test(anchors_rest_in_a_round),
        cmocka_unit_test(long_runs_leave_anchors_out),
        cmocka_unit_test(the_other_rules_are_the_references),
        cmocka_unit_test(hits_are_drawn_together),
        cmocka_unit_test(faint_gaussians_count),
        cmocka_unit_test(nothing_is_nearer_than_a_fifth),
        cmocka_unit_test(anchors_are_seen_by_themselves),
        cmocka_unit_test(voxels_are_where_the_world_puts_them),
        cmocka_unit_test(scenes_of_blender_lie_on_black),
    };
    return cmocka_run_group_tests_name("compat", tests, make_root, folder_remove);
}
