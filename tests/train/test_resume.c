/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_resume.c -- going on: a finished run to another length, the run's own data, what is
   refused; a run that was overwritten does not come back. */
#include "run_support.h"

#include <jansson.h>

#include "base/parallel.h"
#include "io/container.h"
#include "io/model_file.h"
#include "quiet.h"
#include "train/checkpoint.h"

static gbt_train_def resume_def(uint64_t iterations, double budget_seconds)
{
    gbt_train_def def = gbt_train_def_default();
    def.resume = true;
    def.save_every_seconds = 0;
    def.iterations = iterations;
    def.budget_seconds = budget_seconds;
    return def;
}

static double number_of(const char *run, const char *name)
{
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/train.json", run);
    json_t *summary = json_load_file(path, 0, NULL);
    assert_non_null(summary);
    const double value = json_number_value(json_object_get(summary, name));
    json_decref(summary);
    return value;
}

/* The last row of log.csv. */
static void last_row(const char *run, double *step, double *progress, double *loss)
{
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/log.csv", run);
    file_bytes log = read_bytes(path);
    const char *end = (const char *)log.data + log.count - 1;
    while (end > (const char *)log.data && end[-1] != '\n')
        end--;
    assert_int_equal(sscanf(end, "%lf,%*f,%lf,%*f,%*f,%lf", step, progress, loss), 3);
    mem_free(log.data);
}

static void a_finished_run_goes_on(void **state)
{
    (void)state;
    const int before = parallel_threads();
    double step, progress, loss[2];
    for (int i = 0; i < 2; i++) {
        gbt_set_threads(i + 1);
        const char *run = in_folder("further%d", i);
        gbt_train_def def = run_def(), on = resume_def(2 * STEPS, 0);
        def.compat = true; /* losses on random backgrounds could not be compared */
        train_ok(tiny, run, &def);
        last_row(run, &step, &progress, &loss[0]);
        assert_true(step == STEPS && progress == 1);
        train_ok(tiny, run, &on);
        last_row(run, &step, &progress, &loss[1]);
        assert_true(step == 2 * STEPS && progress == 1);
        assert_true(loss[1] > 0 && loss[1] < loss[0]);
        assert_true(number_of(run, "iterations") == 2 * STEPS);
    }
    gbt_set_threads(before);
    assert_same_file(in_folder("further0/model.gbt"), in_folder("further1/model.gbt"));
    model m;
    assert_ok(model_load(in_folder("further0/model.gbt"), &m, NULL));
    assert_int_equal(m.iterations, 2 * STEPS);
    assert_non_null(strstr(m.config, "\niterations = 120\n"));
    model_free(&m);
}

/* At the first step all lengths are alike: a run that was to be three times as long is from there on the
   straight one. */
static void the_new_length_decides(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    train_ok(tiny, in_folder("straight"), &def);
    def.iterations = 3 * STEPS;
    def.stop_at_step = 1;
    train_fails(tiny, in_folder("stretched"), &def, GBT_ERR_INTERRUPTED, "after step 1");
    const gbt_train_def on = resume_def(STEPS, 0);
    train_ok(tiny, in_folder("stretched"), &on);
    assert_same_file(in_folder("straight/model.gbt"), in_folder("stretched/model.gbt"));
}

static void a_run_goes_on_for_a_time(void **state)
{
    (void)state;
    const char *run = in_folder("timed");
    const gbt_train_def def = run_def();
    train_ok(tiny, run, &def);
    for (int i = 1; i <= 2; i++) { /* from a number of steps, and from a budget */
        const double spent = number_of(run, "train_seconds");
        const gbt_train_def on = resume_def(0, spent + 0.5);
        train_ok(tiny, run, &on);
        assert_true(number_of(run, "train_seconds") >= spent);
        const gbt_train_def shorter = resume_def(0, 1e-3);
        train_fails(tiny, run, &shorter, GBT_ERR_ARGUMENT, "seconds of training were asked for");
    }
    assert_true(number_of(run, "iterations") > STEPS);
    const gbt_train_def steps =
        resume_def((uint64_t)number_of(run, "iterations") + 5, 0); /* and back to a number of steps */
    train_ok(tiny, run, &steps);
    assert_true(number_of(run, "iterations") == (double)steps.iterations);
}

static void a_length_that_has_passed_is_refused(void **state)
{
    (void)state;
    const char *run = in_folder("passed");
    const gbt_train_def def = run_def(), shorter = resume_def(STEPS - 1, 0);
    train_ok(tiny, run, &def);
    file_bytes model_bytes = read_bytes(in_folder("passed/model.gbt")),
               config = read_bytes(in_folder("passed/config"));
    train_fails(tiny, run, &shorter, GBT_ERR_ARGUMENT, "wanted more than the 60 that it has done");
    file_bytes model_after = read_bytes(in_folder("passed/model.gbt")),
               config_after = read_bytes(in_folder("passed/config"));
    assert_int_equal(model_bytes.count, model_after.count);
    assert_memory_equal(model_bytes.data, model_after.data, model_bytes.count);
    assert_int_equal(config.count, config_after.count);
    assert_memory_equal(config.data, config_after.data, config.count);
    mem_free(model_bytes.data);
    mem_free(config.data);
    mem_free(model_after.data);
    mem_free(config_after.data);
}

/* What the run took to train is still told when it is resumed at its end. */
static void nothing_left_changes_nothing(void **state)
{
    (void)state;
    const char *run = in_folder("whole");
    const gbt_train_def def = run_def(), on = resume_def(0, 0), same = resume_def(STEPS, 0);
    train_ok(tiny, run, &def);
    file_bytes summary = read_bytes(in_folder("whole/train.json")),
               log = read_bytes(in_folder("whole/log.csv"));
    train_ok(tiny, run, &on);
    train_ok(tiny, run, &same);
    file_bytes summary_after = read_bytes(in_folder("whole/train.json")),
               log_after = read_bytes(in_folder("whole/log.csv"));
    assert_int_equal(summary.count, summary_after.count);
    assert_memory_equal(summary.data, summary_after.data, summary.count);
    assert_int_equal(log.count, log_after.count);
    assert_memory_equal(log.data, log_after.data, log.count);
    mem_free(summary.data);
    mem_free(log.data);
    mem_free(summary_after.data);
    mem_free(log_after.data);
    /* A kill may come after the checkpoint and before the summary. */
    assert_int_equal(remove(in_folder("whole/train.json")), 0);
    train_ok(tiny, run, &on);
    assert_true(number_of(run, "iterations") == STEPS);
}

static void the_run_knows_its_data(void **state)
{
    (void)state;
    char here[PATH_SIZE];
    assert_non_null(getcwd(here, sizeof here));
    gbt_train_def def = run_def();
    train_ok(tiny, in_folder("named"), &def);
    def.stop_at_step = 5;
    train_fails(tiny, in_folder("own"), &def, GBT_ERR_INTERRUPTED, "after step 5");
    assert_int_equal(chdir("/"), 0);
    const gbt_train_def on = resume_def(0, 0);
    train_ok(NULL, in_folder("own"), &on);
    assert_int_equal(chdir(here), 0);
    assert_same_file(in_folder("named/model.gbt"), in_folder("own/model.gbt"));
}

static void other_data_are_refused(void **state)
{
    (void)state;
    gbt_train_def def = run_def(), on = resume_def(0, 0);
    def.stop_at_step = 5;
    train_fails(tiny, in_folder("first"), &def, GBT_ERR_INTERRUPTED, "after step 5");
    /* As many photos and points, from other places. */
    gbt_make_scene_def scene_def = gbt_make_scene_def_default();
    scene_def.name = "terrain";
    scene_def.width = 48;
    scene_def.height = 36;
    scene_def.view_count = VIEWS;
    scene_def.points = 150;
    scene_def.samples = 1;
    gbt_error err = {0};
    assert_ok(gbt_make_scene(&scene_def, in_folder("elsewhere"), &err));
    train_fails(in_folder("elsewhere"), in_folder("first"), &on, GBT_ERR_FORMAT, "other data");
    train_ok(tiny, in_folder("first"), &on);
    train_fails(tiny, in_folder("no run"), &on, GBT_ERR_IO, "holds no run to resume");
    assert_false(file_exists(in_folder("no run")));
    on.overwrite = true;
    train_fails(tiny, in_folder("first"), &on, GBT_ERR_ARGUMENT, "wanted one of the two");
}

/* The sections of a container, but the one of this name. */
static void copy_without(const char *from, const char *to, const char *name)
{
    container c;
    container_writer w = {0};
    assert_ok(container_load(from, &c, NULL));
    for (size_t i = 0; i < c.count; i++) {
        const container_section *s = &c.sections[i];
        if (strcmp(s->name, name) != 0)
            container_add(&w, s->name, s->dtype, s->dim_count, s->dims, s->data);
    }
    assert_int_equal(w.count + 1, c.count);
    assert_ok(container_save(&w, to, NULL));
    container_writer_free(&w);
    container_free(&c);
}

static void refuses_checkpoint(trainer *t, const char *path, const char *says)
{
    gbt_error err = {0};
    assert_int_equal(checkpoint_load(t, path, &err), GBT_ERR_FORMAT);
    if (strstr(err.text, says) == NULL)
        fail_msg("wanted \"%s\", got: %s", says, err.text);
}

static void other_splits_and_points_are_refused(void **state)
{
    (void)state;
    trainer t;
    const gbt_train_def def = run_def();
    static const char *const sections[] = {"views",  "split", "geometry", "points",
                                           "photos", "masks", "in_row",   "anchors.born"};
    char path[PATH_SIZE], part[PATH_SIZE];
    snprintf(path, sizeof path, "%s", in_folder("data.gbt"));
    snprintf(part, sizeof part, "%s", in_folder("part.gbt"));
    open_ok(&t, tiny, &def);
    assert_ok(checkpoint_save(&t, path, NULL));
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++) {
        char says[64];
        snprintf(says, sizeof says, "section %s is missing", sections[i]);
        copy_without(path, part, sections[i]);
        refuses_checkpoint(&t, part, says);
    }
    scene_view *view = &t.scene.views[1];
    float *color = &t.scene.points.color[4];
    view->is_test = !view->is_test;
    refuses_checkpoint(&t, path, "other photos held out");
    view->is_test = !view->is_test;
    const float own_color = *color;
    *color = 1 - own_color;
    refuses_checkpoint(&t, path, "other colours or tracks of the sparse points");
    *color = own_color;
    view->nearest += 1;
    refuses_checkpoint(&t, path, "other colours or tracks of the sparse points");
    view->nearest -= 1;
    assert_ok(checkpoint_load(&t, path, NULL));
    trainer_free(&t);
}

/* Run and data go elsewhere together, and the run that goes on there ends before it has saved: here, because
   log.csv cannot be written. */
static void a_run_that_was_moved_keeps_its_data(void **state)
{
    (void)state;
    gbt_train_def def = run_def(), on = resume_def(0, 0);
    make_tiny_scene(in_folder("before/data"));
    def.stop_at_step = 5;
    train_fails(in_folder("before/data"), in_folder("before/run"), &def, GBT_ERR_INTERRUPTED, "after step 5");
    assert_int_equal(rename(in_folder("before"), in_folder("behind")), 0);
    assert_int_equal(rename(in_folder("behind/run/log.csv"), in_folder("behind/aside")), 0);
    assert_ok(file_make_folder(in_folder("behind/run/log.csv"), NULL));
    train_fails(NULL, in_folder("behind/run"), &on, GBT_ERR_IO, "log.csv");
    assert_int_equal(rmdir(in_folder("behind/run/log.csv")), 0);
    assert_int_equal(rename(in_folder("behind/aside"), in_folder("behind/run/log.csv")), 0);
    train_ok(NULL, in_folder("behind/run"), &on);
    assert_true(number_of(in_folder("behind/run"), "iterations") == STEPS);
}

/* Its colours are learned, are in the model, and have their moments in a checkpoint. */
static void a_learned_sky_goes_on(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.background = GBT_BACKGROUND_SKY;
    train_ok(tiny, in_folder("sky"), &def);
    def.stop_at_step = STEPS / 2;
    train_fails(tiny, in_folder("sky_in_two"), &def, GBT_ERR_INTERRUPTED, "after step 30");
    const gbt_train_def on = resume_def(STEPS, 0);
    train_ok(tiny, in_folder("sky_in_two"), &on);
    assert_same_file(in_folder("sky/model.gbt"), in_folder("sky_in_two/model.gbt"));
    model m;
    assert_ok(model_load(in_folder("sky/model.gbt"), &m, NULL));
    assert_true(m.sky.varies);
    double size = 0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < SH_COUNT - 1; i++)
            size += fabs((double)m.sky.harmonic[i][k]);
    assert_true(size > 0.01);
    model_free(&m);
}

static void keep_warnings(const gbt_event *event, void *context)
{
    char *kept = context;
    if (event->kind == GBT_EVENT_WARNING)
        snprintf(kept + strlen(kept), PATH_SIZE - strlen(kept), "%s\n", event->text);
}

/* With both, the pace is what counts; also when the run is gone on with by the same options. A run without a
   pace takes none, so there the budget counts. */
static void a_pace_wins_over_a_budget(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 0;
    def.budget_seconds = 1e-3;
    def.pace = "3,3,3,3,3,3,3,3,3,3,3,3,3,3,3,3,3,3,3,3";
    train_ok(tiny, in_folder("by pace"), &def);
    def.stop_at_step = 30;
    train_fails(tiny, in_folder("by pace in two"), &def, GBT_ERR_INTERRUPTED, "after step 30");
    gbt_train_def on = resume_def(0, def.budget_seconds);
    on.pace = def.pace;
    train_ok(tiny, in_folder("by pace in two"), &on);
    assert_same_file(in_folder("by pace/model.gbt"), in_folder("by pace in two/model.gbt"));
    def = run_def();
    train_ok(tiny, in_folder("by steps"), &def);
    on.budget_seconds = number_of(in_folder("by steps"), "train_seconds") + 0.1;
    train_ok(tiny, in_folder("by steps"), &on);
    assert_true(number_of(in_folder("by steps"), "iterations") > STEPS);
}

static void a_budget_that_reading_takes_is_told(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    char warnings[PATH_SIZE] = "";
    gbt_listen(keep_warnings, warnings);
    train_ok(tiny, in_folder("enough"), &def);
    assert_string_equal(warnings, "");
    def.iterations = 0;
    def.budget_seconds = 1e-4;
    train_ok(tiny, in_folder("too little"), &def);
    be_quiet();
    if (strncmp(warnings, "budget: reading the data took ", 30) != 0 ||
        strstr(warnings, " of 0.0001 s (wanted a budget of at least ") == NULL)
        fail_msg("%s", warnings);
}

/* Neither is in the file of a run that left it alone. */
static void what_a_run_left_alone_stays(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    train_ok(tiny, in_folder("plain"), &def);
    def.stop_at_step = STEPS / 2;
    train_fails(tiny, in_folder("asked"), &def, GBT_ERR_INTERRUPTED, "after step 30");
    gbt_train_def on = resume_def(STEPS, 0);
    on.views = 4;
    on.background = GBT_BACKGROUND_SKY;
    on.refine_poses = true;
    char warnings[PATH_SIZE] = "";
    gbt_listen(keep_warnings, warnings);
    train_ok(tiny, in_folder("asked"), &on);
    be_quiet();
    assert_string_equal(warnings, "a run is resumed with its own settings: views = 1, not 4\n"
                                  "a run is resumed with its own settings: background = constant, not sky\n"
                                  "a run is resumed with its own settings: refine-poses = 0, not 1\n");
    assert_same_file(in_folder("plain/model.gbt"), in_folder("asked/model.gbt"));
}

/* What becomes of the list that was named, and where the run is gone on with, decides nothing. */
static void a_list_of_held_out_photos_is_the_runs_own(void **state)
{
    (void)state;
    char split[PATH_SIZE], wanted[PATH_SIZE];
    snprintf(split, sizeof split, "validate=3,list=%s", in_folder("held.txt"));
    snprintf(wanted, sizeof wanted, "\neval-split = validate=3,list=%s\n", in_folder("list/held-out.txt"));
    write_text(in_folder("held.txt"), "0001.png\r\n\n0004.png");
    gbt_train_def def = run_def();
    def.eval_split = split;
    train_ok(tiny, in_folder("list straight"), &def);
    def.stop_at_step = STEPS / 2;
    train_fails(tiny, in_folder("list"), &def, GBT_ERR_INTERRUPTED, "after step 30");
    assert_same_file(in_folder("held.txt"), in_folder("list/held-out.txt"));
    write_text(in_folder("held.txt"), "0002.png\n");
    const gbt_train_def on = resume_def(0, 0);
    train_ok(tiny, in_folder("list"), &on);
    assert_same_file(in_folder("list straight/model.gbt"), in_folder("list/model.gbt"));
    file_bytes config = read_bytes(in_folder("list/config"));
    assert_non_null(strstr((const char *)config.data, wanted));
    mem_free(config.data);
    /* A run of an older version has none. */
    assert_int_equal(remove(in_folder("list/held-out.txt")), 0);
    write_text(in_folder("held.txt"), "0001.png\n0004.png\n");
    train_ok(tiny, in_folder("list"), &on);
    assert_same_file(in_folder("held.txt"), in_folder("list/held-out.txt"));
    assert_same_file(in_folder("list straight/model.gbt"), in_folder("list/model.gbt"));
}

/* However the new run ends: here, before its first checkpoint. */
static void an_overwritten_run_is_gone(void **state)
{
    (void)state;
    static const char *const old[] = {"checkpoints/last.gbt",
                                      "checkpoints/last.gbt.prev",
                                      "model.gbt",
                                      "held-out.txt",
                                      "poses.json",
                                      "exposure.json",
                                      "train.json",
                                      "metrics.json",
                                      "report.html",
                                      "renders/test/0.png",
                                      "events.out.tfevents.0.train"};
    enum { OLD = sizeof old / sizeof *old };
    gbt_train_def def = run_def(), on = resume_def(0, 0);
    def.refine_poses = true;
    train_ok(tiny, in_folder("lost"), &def);
    assert_ok(file_make_folder(in_folder("lost/renders/test"), NULL));
    for (int i = 0; i < OLD; i++)
        if (!file_exists(in_folder("lost/%s", old[i])))
            write_text(in_folder("lost/%s", old[i]), "old");
    write_text(in_folder("lost/notes.txt"), "old");
    def = run_def();
    def.overwrite = true;
    train_fails(in_folder("no data"), in_folder("lost"), &def, GBT_ERR_IO, "no data");
    for (int i = 0; i < OLD; i++)
        assert_true(file_exists(in_folder("lost/%s", old[i])));
    assert_int_equal(remove(in_folder("lost/log.csv")), 0); /* cannot be written where a folder is */
    assert_ok(file_make_folder(in_folder("lost/log.csv"), NULL));
    train_fails(tiny, in_folder("lost"), &def, GBT_ERR_IO, "log.csv");
    for (int i = 0; i < OLD; i++)
        assert_false(file_exists(in_folder("lost/%s", old[i])));
    assert_true(file_exists(in_folder("lost/notes.txt")));
    train_fails(tiny, in_folder("lost"), &on, GBT_ERR_IO, "holds no run to resume");
    /* Where there was no run, files of such names are somebody else's. */
    write_text(in_folder("lost/report.html"), "mine");
    write_text(in_folder("lost/renders/test/0.png"), "mine");
    assert_int_equal(rmdir(in_folder("lost/log.csv")), 0);
    train_ok(tiny, in_folder("lost"), &def);
    assert_true(file_exists(in_folder("lost/report.html")) &&
                file_exists(in_folder("lost/renders/test/0.png")));
}

int main(void)
{
    be_quiet();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_finished_run_goes_on),
        cmocka_unit_test(the_new_length_decides),
        cmocka_unit_test(a_run_goes_on_for_a_time),
        cmocka_unit_test(a_length_that_has_passed_is_refused),
        cmocka_unit_test(nothing_left_changes_nothing),
        cmocka_unit_test(the_run_knows_its_data),
        cmocka_unit_test(other_data_are_refused),
        cmocka_unit_test(other_splits_and_points_are_refused),
        cmocka_unit_test(a_run_that_was_moved_keeps_its_data),
        cmocka_unit_test(a_pace_wins_over_a_budget),
        cmocka_unit_test(a_budget_that_reading_takes_is_told),
        cmocka_unit_test(a_learned_sky_goes_on),
        cmocka_unit_test(what_a_run_left_alone_stays),
        cmocka_unit_test(an_overwritten_run_is_gone),
        cmocka_unit_test(a_list_of_held_out_photos_is_the_runs_own),
    };
    return cmocka_run_group_tests_name("resume", tests, make_root, folder_remove);
}
