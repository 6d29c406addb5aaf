/* SPDX-License-Identifier: Apache-2.0 */
/* tests/train/test_trainer.c -- training runs: same bits whatever happens on the way, budget, growing, no
   points, hostile surroundings.

   Nothing here depends on a tuned constant. */
#include "run_support.h"

#include <jansson.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/compare.h"
#include "base/cpu.h"
#include "base/image.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "data/photo_check.h"
#include "data/photo_size.h"
#include "io/model_file.h"
#include "quiet.h"
#include "train/adam.h"
#include "train/budget.h"
#include "train/checkpoint.h"
#include "train/config.h"
#include "train/save.h"
#include "train/seed_points.h"
#include "train/step_pixels.h"

/* The run that others are compared with: STEPS steps in one go. */
static const char *straight_run(void)
{
    static bool done = false;
    if (!done) {
        const gbt_train_def def = run_def();
        train_ok(tiny, in_folder("straight"), &def);
        done = true;
    }
    return in_folder("straight/model.gbt");
}

static void resume_ok(const char *run)
{
    gbt_train_def def = gbt_train_def_default();
    def.resume = true;
    def.save_every_seconds = 0;
    train_ok(tiny, run, &def);
}

/* A run in a process of its own, so that it can be signalled. It is this program again: threads do not live
   through a bare fork(). */
static pid_t start_child(const char *run)
{
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0) {
        execl("/proc/self/exe", "test_trainer", "--child", tiny, run, (char *)NULL);
        _exit(99);
    }
    assert_true(child > 0);
    return child;
}

static int child_main(const char *data, const char *run)
{
    be_quiet();
    gbt_train_def def = run_def();
    def.save_every_seconds = 1e-6; /* after every step */
    gbt_error err = {0};
    return gbt_status_exit_code(gbt_train(data, run, &def, &err));
}

static void nap(void) { nanosleep(&(struct timespec){.tv_nsec = 500000}, NULL); }

/* Wait for a checkpoint, signal, wait for the end; the child's status. */
static int signal_once(const char *run, int number)
{
    char checkpoint[PATH_SIZE];
    snprintf(checkpoint, sizeof checkpoint, "%s/checkpoints/last.gbt", run);
    const pid_t child = start_child(run);
    int status = 0;
    for (int i = 0; !file_exists(checkpoint); i++) {
        if (i > 60000 || waitpid(child, &status, WNOHANG) != 0) {
            kill(child, SIGKILL);
            fail_msg("%s: no checkpoint while the run goes on (status %x)", run, (unsigned)status);
        }
        nap();
    }
    kill(child, number);
    assert_int_equal(waitpid(child, &status, 0), child);
    return status;
}

/* On a busy machine the run may be over before the signal gets there: then once more. */
static int signal_when_saved(const char *run, int number)
{
    for (int i = 0; i < 10; i++) {
        const int status = signal_once(run, number);
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
            return status;
        assert_int_equal(remove_tree(run), 0);
    }
    fail_msg("%s: the run always ends before the signal", run);
    return 0;
}

/* ---- the same bits ---- */

static void interrupted_and_resumed_is_straight(void **state)
{
    (void)state;
    straight_run();
    model m;
    assert_ok(model_load(in_folder("straight/model.gbt"), &m, NULL));
    trainer t;
    const gbt_train_def whole = run_def();
    open_ok(&t, tiny, &whole);
    assert_true(m.anchors.count != t.anchors.count); /* it grows, so that there is something to get wrong */
    trainer_free(&t);
    model_free(&m);
    const char *run = in_folder("pieces");
    static const uint64_t stops[] = {1, 2, 29, 30, STEPS - 1}; /* around growing, at the ends */
    for (size_t i = 0; i < sizeof stops / sizeof *stops; i++) {
        gbt_train_def def = run_def();
        def.resume = i > 0;
        def.stop_at_step = stops[i];
        train_fails(tiny, run, &def, GBT_ERR_INTERRUPTED, "saved in");
    }
    resume_ok(run);
    assert_same_file(straight_run(), in_folder("pieces/model.gbt"));
    resume_ok(run); /* a finished run has nothing left to do */
    assert_same_file(straight_run(), in_folder("pieces/model.gbt"));
}

static void extra_checkpoints_change_nothing(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.save_every_seconds = 1e-6;
    train_ok(tiny, in_folder("saves"), &def);
    assert_same_file(straight_run(), in_folder("saves/model.gbt"));
    assert_true(file_exists(in_folder("saves/checkpoints/last.gbt.prev")));
}

/* The copy that was written while steps went on has all that the run had. */
static void resumes_from_a_save_beside_the_steps(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.save_every_seconds = 1e-6;
    def.stop_at_step = 29; /* before anchors grow; it saves, and the copy before it stays */
    train_fails(tiny, in_folder("beside"), &def, GBT_ERR_INTERRUPTED, "after step 29");
    assert_int_equal(remove(in_folder("beside/checkpoints/last.gbt")), 0);
    assert_int_equal(remove(in_folder("beside/model.gbt")), 0);
    resume_ok(in_folder("beside"));
    assert_same_file(straight_run(), in_folder("beside/model.gbt"));
}

/* What steps change beside the anchors is the copy's own. */
static void a_save_has_its_own_exposures_and_poses(void **state)
{
    (void)state;
    static save_in_background save;
    static run_paths paths;
    trainer t;
    step_report r;
    gbt_train_def def = run_def();
    def.exposure = def.refine_poses = true;
    open_ok(&t, tiny, &def);
    for (int i = 0; i < 2; i++)
        step_ok(&t, &r);
    snprintf(paths.checkpoint, sizeof paths.checkpoint, "%s", in_folder("copy.checkpoint"));
    snprintf(paths.exposure, sizeof paths.exposure, "%s", in_folder("copy.exposure.json"));
    snprintf(paths.poses, sizeof paths.poses, "%s", in_folder("copy.poses.json"));
    snprintf(paths.model, sizeof paths.model, "%s", in_folder("copy.gbt"));
    assert_ok(save_begin(&save, &t, &paths, NULL));
    const exposures *e = &t.exposures, *e2 = &save.copy.exposures;
    const poses *p = &t.poses, *p2 = &save.copy.poses;
    const size_t matrices = e->count * AFFINE_NUMBERS * sizeof(float),
                 motions = p->count * POSE_NUMBERS * sizeof(float);
    const struct {
        const void *own, *copied;
        size_t bytes;
    } arrays[] = {
        {e->matrix, e2->matrix, matrices},
        {e->moment1, e2->moment1, matrices},
        {e->moment2, e2->moment2, matrices},
        {e->visits, e2->visits, e->count * sizeof *e->visits},
        {p->moment1, p2->moment1, motions},
        {p->moment2, p2->moment2, motions},
        {p->visits, p2->visits, p->count * sizeof *p->visits},
        {t.scene.views, save.copy.scene.views, t.scene.view_count * sizeof *t.scene.views},
    };
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        assert_true(arrays[i].own != NULL && arrays[i].own != arrays[i].copied);
        assert_memory_equal(arrays[i].own, arrays[i].copied, arrays[i].bytes);
    }
    assert_true(p->packed != p2->packed); /* which is written only now */
    assert_ok(save_finish(&save, NULL));
    trainer_free(&t);
}

static void killed_and_resumed_is_straight(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        const char *run = in_folder("killed%d", i);
        const int status = signal_when_saved(run, SIGKILL);
        assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
        resume_ok(run);
        assert_same_file(straight_run(), in_folder("killed%d/model.gbt", i));
    }
}

/* A kill between the two renames of a save leaves the checkpoint before it only. */
static void resumes_from_the_previous_checkpoint(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.stop_at_step = 20;
    train_fails(tiny, in_folder("previous"), &def, GBT_ERR_INTERRUPTED, "after step 20");
    assert_int_equal(
        rename(in_folder("previous/checkpoints/last.gbt"), in_folder("previous/checkpoints/last.gbt.prev")),
        0);
    resume_ok(in_folder("previous"));
    assert_same_file(straight_run(), in_folder("previous/model.gbt"));
}

static void a_signal_saves_and_ends(void **state)
{
    (void)state;
    static const int numbers[] = {SIGINT, SIGTERM};
    for (int i = 0; i < 2; i++) {
        const int status = signal_when_saved(in_folder("signal%d", i), numbers[i]);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), 130);
        trainer t = {0};
        const gbt_train_def def = run_def();
        gbt_error err = {0};
        assert_ok(trainer_open(&t, tiny, &def, &err));
        assert_ok(checkpoint_load(&t, in_folder("signal%d/checkpoints/last.gbt", i), &err));
        assert_in_range(t.step, 1, STEPS - 1);
        trainer_free(&t);
        resume_ok(in_folder("signal%d", i));
        assert_same_file(straight_run(), in_folder("signal%d/model.gbt", i));
    }
}

/* Hits beyond the memory for them are traced again for the adjoint. */
static void memory_for_hits_changes_no_bits(void **state)
{
    (void)state;
    const gbt_train_def def = run_def();
    trainer t[2];
    for (int i = 0; i < 2; i++) {
        open_ok(&t[i], tiny, &def);
        t[i].views[0].frame.scene.tape_bytes_max = i == 0 ? 0 : 100;
        step_report r;
        for (int step = 0; step < 10; step++)
            step_ok(&t[i], &r);
        assert_int_equal(t[i].views[0].frame.counters.tape_bytes > 100, i == 0);
    }
    assert_memory_equal(t[0].anchors.feature, t[1].anchors.feature,
                        t[0].anchors.count * ANCHOR_FEATURE_DIM * sizeof(float));
    assert_memory_equal(t[0].decoder.params, t[1].decoder.params, t[0].decoder.param_count * sizeof(float));
    for (int i = 0; i < 2; i++)
        trainer_free(&t[i]);
}

static void threads_and_memory_do_not_change_bits(void **state)
{
    (void)state;
    const int before = parallel_threads();
    for (int threads = 1; threads <= 3; threads++) {
        gbt_set_threads(threads);
        const gbt_train_def def = run_def();
        if (threads == 3) /* anchors in files, whose pages are let go of all the time */
            assert_ok(paged_start("/tmp", 1, NULL));
        train_ok(tiny, in_folder("threads%d", threads), &def);
        assert_same_file(straight_run(), in_folder("threads%d/model.gbt", threads));
    }
    gbt_set_threads(before);
}

static void instruction_sets_do_not_change_bits(void **state)
{
    (void)state;
    const cpu_isa before = cpu_best_isa();
    for (cpu_isa isa = CPU_PLAIN; isa < CPU_ISA_COUNT; isa++) {
        if (!cpu_has_isa(isa))
            continue;
        const gbt_train_def def = run_def();
        cpu_limit_isa(isa);
        train_ok(tiny, in_folder("isa%d", (int)isa), &def);
        cpu_limit_isa(before);
        assert_same_file(straight_run(), in_folder("isa%d/model.gbt", (int)isa));
    }
}

static void more_memory_than_allowed(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    gbt_error err = {0};
    def.memory = 1 << 20; /* less than it can be: told before any work */
    assert_int_equal(gbt_train(tiny, in_folder("limit"), &def, &err), GBT_ERR_NO_MEMORY);
    assert_non_null(strstr(err.text, "memory: 1 MiB is too little: "));
    assert_false(file_exists(in_folder("limit/model.gbt")) ||
                 file_exists(in_folder("limit/checkpoints/last.gbt")));

    const size_t other = 400 << 20; /* that somebody else takes in this process */
    char *taken = mem_alloc(other, 1, "test", NULL);
    assert_non_null(taken);
    memset(taken, 1, other);
    assert_int_equal(taken[other / 2], 1);
    mem_free(taken);
    def.memory = 300 << 20;
    err = (gbt_error){0};
    assert_int_equal(gbt_train(tiny, in_folder("limit"), &def, &err), GBT_ERR_NO_MEMORY);
    if (strstr(err.text, "memory: 300 MiB is too little: ") == NULL)
        fail_msg("%s", err.text);
    assert_non_null(strstr(err.text, "at step 1; saved in "));
    resume_ok(in_folder("limit")); /* it was saved, and goes on with more */
    assert_same_file(straight_run(), in_folder("limit/model.gbt"));
}

static void another_seed_changes_bits(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 3;
    static const uint64_t seeds[] = {5, 6};
    for (int i = 0; i < 2; i++) {
        def.seed = seeds[i];
        train_ok(tiny, in_folder("seed%d", i), &def);
    }
    model a, b;
    assert_ok(model_load(in_folder("seed0/model.gbt"), &a, NULL));
    assert_ok(model_load(in_folder("seed1/model.gbt"), &b, NULL));
    assert_int_equal(a.decoder.param_count, b.decoder.param_count);
    assert_true(memcmp(a.decoder.params, b.decoder.params, a.decoder.param_count * sizeof(float)) != 0);
    model_free(&a);
    model_free(&b);
}

/* ---- the budget ---- */

static json_t *read_summary(const char *run)
{
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/train.json", run);
    json_t *summary = json_load_file(path, 0, NULL);
    assert_non_null(summary);
    return summary;
}

static void a_budget_run_can_be_repeated(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 0;
    def.budget_seconds = 1;
    def.eval_at_seconds[0] = 0.3;
    def.eval_at_count = 1;
    train_ok(tiny, in_folder("budget"), &def);

    json_t *summary = read_summary(in_folder("budget"));
    const json_t *parts = json_object_get(summary, "pace"), *held_out = json_object_get(summary, "held_out");
    assert_int_equal(json_array_size(parts), PACE_SEGMENTS);
    char text[512] = "";
    json_int_t sum = 0;
    for (size_t i = 0; i < PACE_SEGMENTS; i++) {
        const json_int_t n = json_integer_value(json_array_get(parts, i));
        if (n < 1) { /* the machine is too slow for a step in each part: nothing to repeat */
            json_decref(summary);
            skip();
        }
        sum += n;
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%lld", i > 0 ? "," : "", (long long)n);
    }
    assert_int_equal(sum, json_integer_value(json_object_get(summary, "iterations")));
    assert_int_equal(json_array_size(held_out), 1);
    assert_true(json_number_value(json_object_get(json_array_get(held_out, 0), "psnr")) > 3);
    assert_true(json_number_value(json_object_get(summary, "train_seconds")) > 0.4);
    json_decref(summary);

    gbt_train_def again = run_def();
    again.iterations = 0;
    again.pace = text;
    train_ok(tiny, in_folder("pace"), &again);
    assert_same_file(in_folder("budget/model.gbt"), in_folder("pace/model.gbt"));
    json_t *repeated = read_summary(in_folder("pace"));
    assert_int_equal(json_integer_value(json_object_get(repeated, "iterations")), sum);
    json_decref(repeated);
}

/* A program with a decimal comma, such as a German one with GTK, writes and reads the same files. */
static void a_decimal_comma_changes_no_file(void **state)
{
    (void)state;
    char command[PATH_SIZE + 100];
    gbt_train_def def = run_def();
    straight_run();
    def.stop_at_step = STEPS / 2;
    train_fails(tiny, in_folder("comma"), &def, GBT_ERR_INTERRUPTED, "stopped");
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 '%s' >/dev/null 2>&1",
             in_folder("de_DE.UTF-8"));
    if (system(command) != 0 || setenv("LOCPATH", in_folder("."), 1) != 0 ||
        setlocale(LC_ALL, "de_DE.UTF-8") == NULL)
        skip();
    resume_ok(in_folder("comma"));
    make_tiny_scene(in_folder("comma_scene"));
    setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
    assert_same_file(straight_run(), in_folder("comma/model.gbt"));
    assert_same_file(in_folder("straight/config"), in_folder("comma/config"));
    assert_same_file(in_folder("tiny/SCENE.md"), in_folder("comma_scene/SCENE.md"));
}

/* Steps take a time of their own, most of it in reading photos, and one for their pixels, twice that where
   rays are exact; one in fifty takes twenty times as long. The parts take equal times all the same. */
static void a_budget_gives_its_parts_equal_times(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 0;
    def.budget_seconds = 2000;
    def.grow = false;
    trainer t;
    open_ok(&t, tiny, &def);
    t.seconds = 0;
    step_speed speed = {0};
    for (int part = 0; part < PACE_SEGMENTS; part++) {
        const double before = t.seconds;
        budget_extend(&t, &speed);
        for (uint64_t i = 0; i < t.pace.steps[part]; i++, t.step++) {
            const double progress = pace_progress(&t.pace, t.step), times = t.step % 50 == 49 ? 20 : 1,
                         of_pixels = times * 0.09 * (progress < SCHEDULE_EXACT_FROM ? 1 : 2);
            const step_report report = {.views_at_once = 1,
                                        .times.trace.wall = of_pixels,
                                        .photo.wall = times * 0.008,
                                        .all.wall = times * 0.01 + of_pixels};
            budget_follow(&speed, &t, t.step, &report);
            t.seconds += report.all.wall;
        }
        if (part > 1) /* in the first nothing is known, in the second not yet how often a step takes long */
            assert_true(fabs(t.seconds - before - def.budget_seconds / PACE_SEGMENTS) <
                        0.15 * def.budget_seconds / PACE_SEGMENTS);
    }
    assert_true(fabs(t.seconds - def.budget_seconds) < 0.01 * def.budget_seconds);
    trainer_free(&t);
}

/* The clock goes on where it stood, so an interrupted budget run does not get its time twice: a run whose
   checkpoint says that its budget is used up takes a step for each part that is left. */
static void a_budget_run_resumes_its_clock(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 0;
    def.budget_seconds = 1e6;
    def.stop_at_step = 10; /* in the first part */
    train_fails(tiny, in_folder("clock"), &def, GBT_ERR_INTERRUPTED, "after step 10");
    def.stop_at_step = 0;
    trainer t;
    open_ok(&t, tiny, &def);
    assert_ok(checkpoint_load(&t, in_folder("clock/checkpoints/last.gbt"), NULL));
    const uint64_t first_part = t.pace.steps[0];
    assert_true(t.seconds > 0);
    t.seconds = 1e6;
    assert_ok(checkpoint_save(&t, in_folder("clock/checkpoints/last.gbt"), NULL));
    trainer_free(&t);
    resume_ok(in_folder("clock"));
    json_t *summary = read_summary(in_folder("clock"));
    assert_int_equal(json_array_size(json_object_get(summary, "pace")), PACE_SEGMENTS);
    assert_true(json_number_value(json_object_get(summary, "train_seconds")) > 1e6);
    assert_int_equal(json_integer_value(json_object_get(summary, "iterations")),
                     first_part + PACE_SEGMENTS - 1);
    json_decref(summary);
}

/* ---- what a step does ---- */

static void assert_rows_agree(const trainer *t)
{
    assert_int_equal(t->gradient.anchors.count, t->anchors.count);
    assert_int_equal(t->moment1.anchors.count, t->anchors.count);
    assert_int_equal(t->moment2.anchors.count, t->anchors.count);
    assert_int_equal(t->stats.count, t->anchors.count);
}

/* Measured: 6.2 dB at the start, 16.1 dB after 160 steps; 4 dB is what a run that learns cannot miss. */
static void training_learns(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.iterations = 160;
    def.step_pixels = 0;
    trainer t;
    open_ok(&t, tiny, &def);
    memset(t.settings.background, 0, sizeof t.settings.background); /* in front of black all that is right has
                                                                       been learnt */
    double before, after, again, first_loss = 0, last_loss = 0;
    assert_ok(held_out_psnr(&t, &before, NULL));
    bool changed = false;
    for (int i = 0; i < 160; i++) {
        const size_t count = t.anchors.count;
        step_report r;
        step_ok(&t, &r);
        assert_false(r.skipped);
        assert_true(isfinite(r.loss) && r.loss > 0 && r.l1 >= 0 && r.ssim <= 1 && r.width == 48 &&
                    r.height == 36);
        assert_rows_agree(&t);
        changed |= t.anchors.count != count;
        first_loss += i < 8 ? r.loss / 8 : 0;
        last_loss += i >= 152 ? r.loss / 8 : 0;
    }
    assert_ok(held_out_psnr(&t, &after, NULL));
    t.views[0].frame.draw.dropout.share = 0.5f; /* as steps of long runs leave it */
    assert_ok(held_out_psnr(&t, &again, NULL));
    assert_true(again == after);
    print_message("held out: %.2f -> %.2f dB, loss %.4f -> %.4f, anchors %zu -> %zu\n", before, after,
                  first_loss, last_loss, t.anchors_initial, t.anchors.count);
    assert_true(after > before + 4);
    assert_true(last_loss < 0.6 * first_loss);
    assert_true(changed);
    trainer_free(&t);
}

static void without_growing_the_anchors_stay(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.grow = false;
    trainer t;
    open_ok(&t, tiny, &def);
    const size_t count = t.anchors.count;
    for (int i = 0; i < STEPS; i++) {
        step_report r;
        step_ok(&t, &r);
        assert_int_equal(t.anchors.count, count);
    }
    trainer_free(&t);
}

static void growth_stops_at_max_anchors(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    trainer t;
    open_ok(&t, tiny, &def);
    const size_t start = t.anchors.count;
    trainer_free(&t);
    def.max_anchors = start + 7;
    open_ok(&t, tiny, &def);
    size_t most = 0;
    for (int i = 0; i < STEPS; i++) {
        step_report r;
        step_ok(&t, &r);
        most = t.anchors.count > most ? t.anchors.count : most;
    }
    assert_int_equal(most, start + 7);
    trainer_free(&t);
}

static bool is_at_point(const trainer *t, size_t anchor)
{
    size_t p = 0;
    while (p < t->scene.points.count &&
           memcmp(t->anchors.position + 3 * anchor, t->scene.points.position + 3 * p, 3 * sizeof(float)) != 0)
        p++;
    return p < t->scene.points.count;
}

static size_t anchors_at_points(const trainer *t)
{
    size_t count = 0;
    for (size_t i = 0; i < t->anchors.count; i++)
        count += is_at_point(t, i);
    return count;
}

enum { FEW_BALLS_STEPS = 320 };

static void open_from_few_balls(trainer *t)
{
    gbt_train_def def = run_def();
    def.init = GBT_INIT_ADAPTIVE;
    def.init_count = 0.1;
    def.iterations = FEW_BALLS_STEPS;
    open_ok(t, tiny, &def);
}

/* A start from a few balls leaves most points without an anchor; early growth comes back to them, later
   growth has Gaussians to go by. */
static void growth_begins_at_the_points(void **state)
{
    (void)state;
    trainer t;
    open_from_few_balls(&t);
    size_t at_points = anchors_at_points(&t);
    assert_true(at_points < t.scene.points.count / 20);
    const uint64_t until = (uint64_t)(SCHEDULE_POINTS_UNTIL * FEW_BALLS_STEPS) + 2;
    while (t.step < until) {
        step_report r;
        step_ok(&t, &r);
    }
    print_message("%zu of %zu anchors at points, %zu at the start\n", anchors_at_points(&t), t.anchors.count,
                  at_points);
    assert_true(anchors_at_points(&t) > at_points + 5);
    at_points = anchors_at_points(&t);
    while (t.step < 2 * until) {
        step_report r;
        step_ok(&t, &r);
    }
    assert_true(anchors_at_points(&t) <= at_points);
    trainer_free(&t);
}

/* How many anchors have grown away from the points, when only two photos teach and the second looks away, or
   not. */
static size_t grown_in_the_open(bool looks_away)
{
    trainer t;
    open_from_few_balls(&t);
    t.train_count = 2;
    double *turn = t.scene.views[t.train_views[1]].camera.rotation;
    for (int k = 0; looks_away && k < 3; k++) {
        turn[k] = -turn[k];
        turn[6 + k] = -turn[6 + k];
    }
    while (t.step < FEW_BALLS_STEPS / 4) {
        step_report r;
        step_ok(&t, &r);
    }
    size_t count = 0;
    for (size_t i = 0; i < t.anchors.count; i++)
        count += t.created[i] > 0 && !is_at_point(&t, i);
    print_message("%zu of %zu anchors are new, and not at points\n", count, t.anchors.count);
    trainer_free(&t);
    return count;
}

/* One photo cannot tell how far off what grows is. */
static void growth_asks_for_two_views(void **state)
{
    (void)state;
    assert_int_equal(grown_in_the_open(true), 0);
    assert_true(grown_in_the_open(false) > 20);
}

/* Adam's first step is one rate long, whatever the gradient. New rows that are corrected by the age of the
   run, as the reference does it and ours for features alone, make one of 0.1 / sqrt(0.001) rates in a long
   run. */
static void new_geometry_begins_at_its_own_pace(void **state)
{
    (void)state;
    trainer t;
    open_from_few_balls(&t);
    step_report r;
    while (t.round_step == 0 || t.created[t.anchors.count - 1] == 0)
        step_ok(&t, &r);
    const size_t n = t.anchors.count, k = (size_t)t.anchors.offset_count;
    size_t old = 0;
    while (t.created[old] == 0)
        old++;
    anchors before = {.offset_count = t.anchors.offset_count};
    assert_ok(anchors_resize(&before, n, NULL));
    memcpy(before.offset, t.anchors.offset, n * 3 * k * sizeof(float));
    memcpy(before.scale_log, t.anchors.scale_log, n * 6 * sizeof(float));
    memcpy(before.feature, t.anchors.feature, n * ANCHOR_FEATURE_DIM * sizeof(float));
    const learning_rates rates =
        learning_rates_at(&(learning_rates_def){.progress = pace_progress(&t.pace, t.step),
                                                .uses_own_rates = true,
                                                .extent = t.extent,
                                                .factor = t.def.learning_rate_factor,
                                                .end = 1,
                                                .views = 1});
    step_ok(&t, &r);
    assert_int_equal(t.anchors.count, n); /* no round: rows are where they were */
    double offset = 0, scale = 0, feature = 0;
    for (size_t i = old * 3 * k; i < n * 3 * k; i++)
        offset = fmax(offset, fabs((double)t.anchors.offset[i] - (double)before.offset[i]));
    for (size_t i = old * 6; i < n * 6; i++)
        scale = fmax(scale, fabs((double)t.anchors.scale_log[i] - (double)before.scale_log[i]));
    for (size_t i = old * ANCHOR_FEATURE_DIM; i < n * ANCHOR_FEATURE_DIM; i++)
        feature = fmax(feature, fabs((double)t.anchors.feature[i] - (double)before.feature[i]));
    const adam_rates by_run = adam_rates_at(rates.anchor[ANCHOR_FEATURE], t.anchor_t);
    const double expected = rates.anchor[ANCHOR_FEATURE] * 0.1 * (double)by_run.correct_m /
                            sqrt(0.001 * (double)by_run.correct_v);
    print_message("%zu new anchors; first steps of %.3f, %.3f and %.3f rates\n", n - old,
                  offset / rates.anchor[ANCHOR_OFFSET], scale / rates.anchor[ANCHOR_SCALE_LOG],
                  feature / rates.anchor[ANCHOR_FEATURE]);
    assert_true(fabs(offset / rates.anchor[ANCHOR_OFFSET] - 1) < 1e-3 &&
                fabs(scale / rates.anchor[ANCHOR_SCALE_LOG] - 1) < 1e-3 &&
                fabs(feature / expected - 1) < 1e-3);
    anchors_free(&before);
    trainer_free(&t);
}

/* One adjust of the reference's kind, in whose step the anchors' Adam groups rest: what moves is the rows
   alone. Every second anchor is made transparent by its statistics, the first candidates are made to grow by
   theirs. Anchors never move, so a position names a row. */
static void moments_follow_their_rows(void **state)
{
    (void)state;
    enum { LAST = 99 };
    gbt_train_def def = run_def();
    def.compat = true;
    def.voxel_size = 0.01f;
    def.iterations = 400;
    trainer t;
    open_ok(&t, tiny, &def);
    step_report r;
    for (int i = 0; i < LAST; i++)
        step_ok(&t, &r);
    const size_t n = t.anchors.count, k = (size_t)t.anchors.offset_count;
    assert_int_equal(n, t.anchors_initial);
    float *position = malloc(3 * n * sizeof *position), *m1 = malloc(n * 3 * k * sizeof *m1),
          *m2 = malloc(n * 6 * sizeof *m2);
    assert_true(position != NULL && m1 != NULL && m2 != NULL);
    memcpy(position, t.anchors.position, 3 * n * sizeof *position);
    memcpy(m1, t.moment1.anchors.offset, n * 3 * k * sizeof *m1);
    memcpy(m2, t.moment2.anchors.scale_log, n * 6 * sizeof *m2);
    for (size_t i = 0; i < n; i++) {
        t.stats.visit_count[i] = t.stats.shown_count[i] = 1e6f;
        t.stats.importance_accum[i] = i % 2 == 0 ? 0.0f : 1e6f;
        for (size_t j = 0; j < k; j++) {
            t.stats.grad_count[i * k + j] = 1e6f;
            t.stats.grad_accum[i * k + j] = i < 20 ? 1e9f : 0.0f;
        }
        t.created[i] = i * 50 / n;
    }
    step_ok(&t, &r);
    assert_rows_agree(&t);
    size_t kept = 0, grown = 0;
    for (size_t row = 0; row < t.anchors.count; row++) {
        size_t from = 0;
        while (from < n &&
               memcmp(position + 3 * from, t.anchors.position + 3 * row, 3 * sizeof *position) != 0)
            from++;
        if (from < n) {
            kept++;
            assert_int_equal(from % 2, 1);
            assert_int_equal(t.created[row], from * 50 / n);
            assert_memory_equal(t.moment1.anchors.offset + row * 3 * k, m1 + from * 3 * k,
                                3 * k * sizeof *m1);
            assert_memory_equal(t.moment2.anchors.scale_log + row * 6, m2 + from * 6, 6 * sizeof *m2);
        } else {
            grown++;
            for (size_t j = 0; j < 3 * k; j++)
                assert_true(t.moment1.anchors.offset[row * 3 * k + j] == 0);
            for (size_t j = 0; j < 6; j++)
                assert_true(t.moment2.anchors.scale_log[row * 6 + j] == 0);
        }
    }
    assert_int_equal(kept, n / 2);
    assert_true(grown > 0);
    for (int i = 0; i < 5; i++) /* and the next steps see consistent rows */
        step_ok(&t, &r);
    free(position);
    free(m1);
    free(m2);
    trainer_free(&t);
}

/* ---- no sparse points ---- */

/* The tiny scene's photos and cameras as a transforms.json, which has no points. */
static void write_transforms(const char *folder)
{
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    assert_ok(file_make_folder(folder, NULL));
    char path[PATH_SIZE];
    snprintf(path, sizeof path, "%s/images", folder);
    assert_int_equal(symlink("../tiny/images", path), 0);
    snprintf(path, sizeof path, "%s/transforms.json", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    const gbt_camera *c = &s.views[0].camera;
    assert_int_equal(c->model, GBT_CAMERA_PINHOLE);
    fprintf(file,
            "{\"w\": %d, \"h\": %d, \"fl_x\": %.17g, \"fl_y\": %.17g, \"cx\": %.17g, \"cy\": %.17g, "
            "\"frames\": [",
            c->width, c->height, c->params[0], c->params[1], c->params[2], c->params[3]);
    for (size_t i = 0; i < s.view_count; i++) {
        fprintf(file, "%s{\"file_path\": \"images/%s\", ", i > 0 ? ", " : "", s.views[i].name);
        put_pose(file, &s, i);
    }
    fprintf(file, "]}\n");
    assert_int_equal(fclose(file), 0);
    scene_free(&s);
}

static void points_are_made_where_there_are_none(void **state)
{
    (void)state;
    const char *folder = in_folder("no_points");
    write_transforms(folder);
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(folder, &split, &s, NULL));
    assert_int_equal(s.points.count, 0);
    size_t views[VIEWS];
    for (size_t i = 0; i < VIEWS; i++)
        views[i] = i;
    scene_points made[3] = {{0}};
    const int before = parallel_threads();
    static const struct {
        int threads;
        uint64_t seed;
    } runs[] = {{1, 5}, {2, 5}, {2, 6}};
    for (int i = 0; i < 3; i++) {
        gbt_set_threads(runs[i].threads);
        photos p;
        assert_ok(photos_open(&p, &s, 1, NULL));
        gbt_error err = {0};
        if (seed_points_make(&p, views, VIEWS, runs[i].seed, &made[i], &err) != GBT_OK)
            fail_msg("%s", err.text);
        photos_close(&p);
    }
    gbt_set_threads(before);
    gbt_error too_few = {0};
    assert_int_equal(seed_points_make(NULL, views, 2, 5, &made[0], &too_few), GBT_ERR_FORMAT);
    assert_non_null(strstr(too_few.text, "and 2 photos to train on (wanted at least 3"));
    assert_true(made[0].count >= 100 && made[0].has_color);
    assert_int_equal(made[0].count, made[1].count);
    assert_memory_equal(made[0].position, made[1].position, 3 * made[0].count * sizeof(float));
    assert_memory_equal(made[0].color, made[1].color, 3 * made[0].count * sizeof(float));
    assert_true(made[0].count != made[2].count ||
                memcmp(made[0].position, made[2].position, 3 * made[0].count * sizeof(float)) != 0);
    for (size_t i = 0; i < 3 * made[0].count; i++)
        assert_true(isfinite(made[0].position[i]) && made[0].color[i] >= 0 && made[0].color[i] <= 1);
    /* Of twice as many views as may be, every second one is read: the others are not there. */
    enum { MANY = 2 * SEED_VIEWS_MOST, ABSENT = VIEWS - 1 };
    static size_t many[MANY];
    for (size_t i = 0; i < MANY; i++)
        many[i] = i % 2 == 0 ? i / 2 % ABSENT : ABSENT;
    char *path = s.views[ABSENT].path;
    s.views[ABSENT].path = (char *)in_folder("absent.png");
    scene_points of_many = {0};
    photos p;
    assert_ok(photos_open(&p, &s, 1, NULL));
    assert_ok(seed_points_make(&p, many, MANY, 5, &of_many, NULL));
    photos_close(&p);
    s.views[ABSENT].path = path;
    assert_true(of_many.count >= 100);
    mem_free(of_many.position);
    mem_free(of_many.color);
    for (int i = 0; i < 3; i++) {
        mem_free(made[i].position);
        mem_free(made[i].color);
    }
    scene_free(&s);

    gbt_train_def def = run_def();
    def.iterations = 4;
    def.max_anchors = 20000;
    train_ok(folder, in_folder("made"), &def);
    def.stop_at_step = 2;
    train_fails(folder, in_folder("made2"), &def, GBT_ERR_INTERRUPTED, "after step 2");
    gbt_train_def on = gbt_train_def_default();
    on.resume = true;
    train_ok(folder, in_folder("made2"), &on);
    assert_same_file(in_folder("made/model.gbt"), in_folder("made2/model.gbt"));
}

/* Smooth noise. */
static float wall_color(double x, double y)
{
    const double u = 4 * x + 100, v = 4 * y + 100;
    const uint64_t i = (uint64_t)u, j = (uint64_t)v;
    const float fx = (float)(u - (double)i), fy = (float)(v - (double)j);
    return (1 - fy) * ((1 - fx) * rng_uniform(9, j, i) + fx * rng_uniform(9, j, i + 1)) +
           fy * ((1 - fx) * rng_uniform(9, j + 1, i) + fx * rng_uniform(9, j + 1, i + 1));
}

enum { WALL_VIEWS = 12, WALL_DISTANCE = 6 };

/* Photos of a wall from a grid of cameras that all look straight at it. */
static void write_wall(void)
{
    enum { WIDTH = 64, HEIGHT = 48, FOCAL = 64 };
    image photo;
    assert_ok(image_alloc(&photo, WIDTH, HEIGHT, 3, NULL));
    assert_ok(file_make_folder(in_folder("wall"), NULL));
    FILE *file = fopen(in_folder("wall/transforms.json"), "w");
    assert_non_null(file);
    fprintf(file, "{\"w\": %d, \"h\": %d, \"fl_x\": %d, \"fl_y\": %d, \"cx\": %d, \"cy\": %d, \"frames\": [",
            WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2);
    for (int view = 0; view < WALL_VIEWS; view++) {
        const double x = 0.3 * (view % 4), y = 0.3 * (view / 4), step = (double)WALL_DISTANCE / FOCAL;
        for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
            photo.pixels[i] = wall_color(x + (i / 3 % WIDTH + 0.5 - WIDTH / 2) * step,
                                         y + (i / 3 / WIDTH + 0.5 - HEIGHT / 2) * step);
        assert_ok(image_write(in_folder("wall/%d.png", view), &photo, NULL));
        fprintf(file,
                "%s{\"file_path\": \"%d.png\", \"transform_matrix\": [[1, 0, 0, %g], [0, -1, 0, %g], "
                "[0, 0, -1, 0], [0, 0, 0, 1]]}",
                view > 0 ? ", " : "", view, x, y);
    }
    fprintf(file, "]}\n");
    assert_int_equal(fclose(file), 0);
    image_free(&photo);
}

/* The spread of these cameras is a fifteenth of the distance. */
static void points_are_made_where_axes_do_not_meet(void **state)
{
    (void)state;
    write_wall();
    scene s;
    photos p;
    scene_points made = {0};
    size_t views[WALL_VIEWS];
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(in_folder("wall"), &split, &s, NULL));
    assert_int_equal(s.view_count, WALL_VIEWS);
    for (size_t i = 0; i < WALL_VIEWS; i++)
        views[i] = i;
    assert_ok(photos_open(&p, &s, 1, NULL));
    assert_ok(seed_points_make(&p, views, WALL_VIEWS, 5, &made, NULL));
    photos_close(&p);
    for (size_t i = 0; i < made.count; i++) /* the cameras stand at z = 0 */
        made.position[i] = made.position[3 * i + 2];
    qsort(made.position, made.count, sizeof *made.position, compare_floats);
    const double depth = (double)made.position[made.count / 2];
    if (!(made.count >= 1000 && fabs(depth / WALL_DISTANCE - 1) < 0.1))
        fail_msg("%zu points, half of them nearer than %g", made.count, depth);
    mem_free(made.position);
    mem_free(made.color);
    scene_free(&s);
}

/* ---- hostile surroundings ---- */

/* Before data are read. */
static void closed_folders_are_told_first(void **state)
{
    (void)state;
    if (geteuid() == 0) /* who may write everywhere */
        skip();
    gbt_train_def def = run_def();
    const char *closed = in_folder("closed/checkpoints");
    assert_ok(file_make_folder(closed, NULL));
    assert_int_equal(chmod(closed, 0555), 0);
    train_fails(in_folder("nowhere"), in_folder("closed"), &def, GBT_ERR_IO, "checkpoints: cannot create");
    assert_int_equal(chmod(closed, 0755), 0);
}

static void data_without_training_photos_is_refused(void **state)
{
    (void)state;
    FILE *list = fopen(in_folder("all.txt"), "w");
    assert_non_null(list);
    scene s;
    const scene_split none = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &none, &s, NULL));
    for (size_t i = 0; i < s.view_count; i++)
        fprintf(list, "%s\n", s.views[i].name);
    fclose(list);
    scene_free(&s);
    char split[PATH_SIZE];
    snprintf(split, sizeof split, "list=%s", in_folder("all.txt"));
    gbt_train_def def = run_def();
    def.eval_split = split;
    train_fails(tiny, in_folder("none"), &def, GBT_ERR_ARGUMENT, "none is left to train on");
    def = run_def();
    train_fails(in_folder("nowhere"), in_folder("none"), &def, GBT_ERR_IO, "nowhere");
    train_fails(NULL, in_folder("without"), &def, GBT_ERR_ARGUMENT, "train: no data given");
    assert_false(file_exists(in_folder("without")));
    char two_lines[PATH_SIZE], long_name[PATH_SIZE * 2 + 1];
    snprintf(two_lines, sizeof two_lines, "%s", in_folder("two\nlines"));
    make_tiny_scene(two_lines); /* no run could be opened again that names this */
    train_fails(two_lines, in_folder("none"), &def, GBT_ERR_ARGUMENT, "data: has a line break");
    memset(long_name, 'x', 2 * PATH_SIZE);
    long_name[2 * PATH_SIZE] = '\0';
    train_fails(long_name, in_folder("none"), &def, GBT_ERR_ARGUMENT, "1024 bytes (wanted at most 1023)");
    def.eval_split = "list=two\nlines";
    train_fails(tiny, in_folder("none"), &def, GBT_ERR_ARGUMENT, "eval_split: has a line break");
    def = run_def();
    def.cookie_ = 0;
    train_fails(tiny, in_folder("none"), &def, GBT_ERR_ARGUMENT, "gbt_train_def_default");
    assert_false(file_exists(in_folder("none/model.gbt")));
}

/* Validation scores training photos, and does not so much as open the held-out ones. */
static void validation_needs_no_held_out_photo(void **state)
{
    (void)state;
    scene s;
    make_tiny_scene(in_folder("validate"));
    assert_ok(scene_load(in_folder("validate"), NULL, &s, NULL));
    size_t held_out = 0;
    for (size_t i = 0; i < s.view_count; i++)
        if (s.views[i].is_test) {
            held_out++;
            FILE *photo = fopen(s.views[i].path, "w");
            assert_true(photo != NULL && fputs("no photo", photo) >= 0 && fclose(photo) == 0);
        }
    const size_t others = s.view_count - held_out;
    scene_free(&s);
    for (int fold = 0; fold < 4; fold++) {
        char split[32];
        snprintf(split, sizeof split, "validate=4:%d", fold);
        gbt_train_def def = run_def();
        def.eval_split = split;
        trainer t;
        step_report r;
        double psnr = 0;
        open_ok(&t, in_folder("validate"), &def);
        assert_int_equal(t.scene.view_count, others);
        assert_int_equal(t.test_count, (others - (size_t)fold + 3) / 4);
        assert_int_equal(t.train_count, others - t.test_count);
        step_ok(&t, &r);
        assert_ok(held_out_psnr(&t, &psnr, NULL));
        assert_true(isfinite(psnr));
        trainer_free(&t);
    }
}

static void a_run_is_overwritten_only_when_asked(void **state)
{
    (void)state;
    static const char *const files[] = {"model.gbt", "config", "log.csv", "checkpoints/last.gbt"};
    file_bytes before[4];
    gbt_train_def def = run_def();
    def.iterations = 3;
    def.stop_at_step = 2;
    train_fails(tiny, in_folder("kept"), &def, GBT_ERR_INTERRUPTED, "after step 2");
    for (int i = 0; i < 4; i++)
        before[i] = read_bytes(in_folder("kept/%s", files[i]));
    def.seed = 6;
    def.stop_at_step = 0;
    train_fails(tiny, in_folder("kept"), &def, GBT_ERR_ARGUMENT, "kept: already holds a run");
    for (int i = 0; i < 4; i++) {
        file_bytes after = read_bytes(in_folder("kept/%s", files[i]));
        assert_int_equal(before[i].count, after.count);
        assert_memory_equal(before[i].data, after.data, after.count);
        mem_free(before[i].data);
        mem_free(after.data);
    }
    /* The checkpoint alone can be resumed, the model alone is a finished run. */
    assert_int_equal(rename(in_folder("kept/model.gbt"), in_folder("kept/aside")), 0);
    train_fails(tiny, in_folder("kept"), &def, GBT_ERR_ARGUMENT, "with `resume`");
    assert_int_equal(
        rename(in_folder("kept/checkpoints/last.gbt"), in_folder("kept/checkpoints/last.gbt.prev")), 0);
    train_fails(tiny, in_folder("kept"), &def, GBT_ERR_ARGUMENT, "with `overwrite`");
    assert_int_equal(unlink(in_folder("kept/checkpoints/last.gbt.prev")), 0);
    assert_int_equal(rename(in_folder("kept/aside"), in_folder("kept/model.gbt")), 0);
    train_fails(tiny, in_folder("kept"), &def, GBT_ERR_ARGUMENT, "already holds a run");

    train_ok(tiny, in_folder("anew"), &def);
    gbt_error err = {0};
    def.overwrite = true;
    train_ok(tiny, in_folder("kept"), &def);
    assert_same_file(in_folder("anew/model.gbt"), in_folder("kept/model.gbt"));
    if (gbt_train_with(tiny, in_folder("kept"),
                       "iterations = 3\nseed = 6\nstep-pixels = 432\noverwrite = 1\n", &err) != GBT_OK)
        fail_msg("%s", err.text);
    assert_same_file(in_folder("anew/model.gbt"), in_folder("kept/model.gbt"));
}

/* Files that a run would replace are refused unless they are a run's; pipes are not replaced. */
static void foreign_files_are_kept(void **state)
{
    (void)state;
    static const char *const names[] = {"config", "report.html", "log.csv", "metrics.json", "poses.json"};
    gbt_train_def def = run_def();
    char says[128];
    def.stop_at_step = 2;
    assert_ok(file_make_folder(in_folder("foreign"), NULL));
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const char *path = in_folder("foreign/%s", names[i]);
        assert_ok(file_write_atomic(path, "theirs", 6, NULL));
        snprintf(says, sizeof says, "foreign/%s: would be replaced, but its folder holds no run", names[i]);
        train_fails(tiny, in_folder("foreign"), &def, GBT_ERR_ARGUMENT, says);
        assert_false(file_exists(in_folder("foreign/checkpoints")));
        file_bytes after = read_bytes(path);
        assert_int_equal(after.count, 6);
        assert_memory_equal(after.data, "theirs", 6);
        mem_free(after.data);
        assert_int_equal(unlink(path), 0);
    }
    assert_ok(file_write_atomic(in_folder("foreign/config"), "theirs", 6, NULL));
    def.overwrite = true;
    train_fails(tiny, in_folder("foreign"), &def, GBT_ERR_INTERRUPTED, "after step 2");
    def.overwrite = false; /* without its checkpoint the folder still says that it was a run */
    assert_int_equal(unlink(in_folder("foreign/checkpoints/last.gbt")), 0);
    assert_int_equal(unlink(in_folder("foreign/model.gbt")), 0);
    train_fails(tiny, in_folder("foreign"), &def, GBT_ERR_INTERRUPTED, "after step 2");
    assert_ok(file_make_folder(in_folder("piped"), NULL));
    assert_int_equal(mkfifo(in_folder("piped/metrics.json"), 0600), 0);
    train_fails(tiny, in_folder("piped"), &def, GBT_ERR_INTERRUPTED, "after step 2");
}

/* A run has read its photos when it starts; one that is resumed reads them again. */
static void a_vanished_photo_is_named(void **state)
{
    (void)state;
    const char *data = in_folder("vanishing"), *run = in_folder("vanished");
    make_tiny_scene(data);
    gbt_train_def def = run_def();
    def.stop_at_step = 3;
    train_fails(data, run, &def, GBT_ERR_INTERRUPTED, "after step 3");
    file_bytes before = read_bytes(in_folder("vanished/checkpoints/last.gbt"));

    trainer t;
    open_ok(&t, data, &def);
    const char *photo = in_folder("vanishing/images/%s", t.scene.views[t.train_views[0]].name);
    assert_int_equal(rename(photo, in_folder("vanishing/aside.png")), 0);
    step_report r;
    for (int i = 0; i < VIEWS; i++)
        step_ok(&t, &r);
    trainer_free(&t);

    gbt_train_def on = gbt_train_def_default();
    on.resume = true;
    train_fails(data, run, &on, GBT_ERR_FORMAT, strrchr(photo, '/') + 1);
    file_bytes after = read_bytes(in_folder("vanished/checkpoints/last.gbt"));
    assert_int_equal(before.count, after.count);
    assert_memory_equal(before.data, after.data, before.count);
    mem_free(before.data);
    mem_free(after.data);
    assert_int_equal(rename(in_folder("vanishing/aside.png"), photo), 0);
    train_ok(data, run, &on);
}

/* A limit on file size stands for the full disk: write() fails half way. */
static void checkpoint_does_not_fit(const char *run, const gbt_train_def *def, size_t bytes)
{
    fflush(NULL);
    struct rlimit limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    const struct rlimit small = {bytes, limit.rlim_max};
    void (*old_action)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    gbt_error err = {0};
    const gbt_status status = gbt_train(tiny, run, def, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    signal(SIGXFSZ, old_action);
    if (status != GBT_ERR_IO || strstr(err.text, "last.gbt") == NULL)
        fail_msg("wanted an error of the checkpoint, got %d: %s", (int)status, err.text);
}

/* The model, which is smaller, is written. */
static void a_full_disk_leaves_the_old_checkpoint(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.stop_at_step = 10;
    train_fails(tiny, in_folder("full"), &def, GBT_ERR_INTERRUPTED, "after step 10");
    const char *last = in_folder("full/checkpoints/last.gbt"), *copy = in_folder("full_copy.gbt");
    file_bytes old = read_bytes(last);
    assert_ok(file_write_atomic(copy, old.data, old.count, NULL));
    mem_free(old.data);
    file_bytes old_model = read_bytes(in_folder("full/model.gbt"));
    mem_free(old_model.data);

    def.resume = true;
    def.stop_at_step = 20;
    checkpoint_does_not_fit(in_folder("full"), &def, (old_model.count + old.count) / 2);

    /* Whole, and under its own name; no half-written file beside it. */
    assert_true(file_exists(last) && is_same_file(last, copy));
    assert_false(file_exists(in_folder("full/checkpoints/.last.gbt.tmp")));
    model m;
    assert_ok(model_load(in_folder("full/model.gbt"), &m, NULL));
    assert_int_equal(m.iterations, 20);
    model_free(&m);
    resume_ok(in_folder("full"));
    assert_same_file(straight_run(), in_folder("full/model.gbt"));
}

/* A disk that has room for the poses, but not for the model that they are of. */
static void poses_stay_with_their_model(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.refine_poses = true;
    def.stop_at_step = 10;
    train_fails(tiny, in_folder("posed"), &def, GBT_ERR_INTERRUPTED, "after step 10");
    copy_file(in_folder("posed/model.gbt"), in_folder("posed_copy.gbt"));
    copy_file(in_folder("posed/poses.json"), in_folder("posed_copy.json"));
    file_bytes large = read_bytes(in_folder("posed/model.gbt")),
               small = read_bytes(in_folder("posed/poses.json"));
    mem_free(large.data);
    mem_free(small.data);
    assert_true(large.count > small.count + 2000);
    def.resume = true;
    def.stop_at_step = 20;
    checkpoint_does_not_fit(in_folder("posed"), &def, (large.count + small.count) / 2);
    assert_same_file(in_folder("posed/model.gbt"), in_folder("posed_copy.gbt"));
    assert_same_file(in_folder("posed/poses.json"), in_folder("posed_copy.json"));
}

/* Beside the steps, at a stop, at the end. */
static void a_save_that_failed_is_made_once_more(void **state)
{
    (void)state;
    static const struct {
        double save_every;
        uint64_t stop_at_step;
    } cases[] = {{1e-6, 0}, {0, STEPS / 2}, {0, 0}};
    for (int i = 0; i < 3; i++) {
        const char *run = in_folder("once%d", i);
        char in_its_way[PATH_SIZE];
        snprintf(in_its_way, sizeof in_its_way, "%s/checkpoints/.last.gbt.tmp", run);
        assert_ok(file_make_folder(in_its_way, NULL));
        gbt_train_def def = run_def();
        def.save_every_seconds = cases[i].save_every;
        def.stop_at_step = cases[i].stop_at_step;
        gbt_listen(remove_at_warning, in_its_way);
        if (def.stop_at_step > 0)
            train_fails(tiny, run, &def, GBT_ERR_INTERRUPTED, "after step 30; saved in ");
        else
            train_ok(tiny, run, &def);
        be_quiet();
        assert_false(file_exists(in_its_way));
        resume_ok(run);
        assert_same_file(straight_run(), in_folder("once%d/model.gbt", i));
    }
}

static void write_file(const char *path, const unsigned char *data, size_t count)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, count, file), count);
    assert_int_equal(fclose(file), 0);
}

static void a_damaged_checkpoint_is_refused(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.stop_at_step = 5;
    train_fails(tiny, in_folder("damaged"), &def, GBT_ERR_INTERRUPTED, "after step 5");
    const char *path = in_folder("damaged/checkpoints/last.gbt");
    file_bytes whole = read_bytes(path);
    gbt_train_def on = gbt_train_def_default();
    on.resume = true;
    static const double cuts[] = {0, 1e-4, 0.01, 0.5, 0.999999}; /* parts of the file that are left */
    for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
        write_file(path, whole.data, (size_t)(cuts[i] * (double)whole.count));
        train_fails(tiny, in_folder("damaged"), &on, GBT_ERR_FORMAT, "last.gbt");
    }
    for (int i = 0; i < 9; i++) {
        const size_t at = (whole.count - 1) * (size_t)i / 8;
        whole.data[at] ^= 0x10;
        write_file(path, whole.data, whole.count);
        whole.data[at] ^= 0x10;
        train_fails(tiny, in_folder("damaged"), &on, GBT_ERR_FORMAT, "last.gbt");
    }
    /* With an older one beside it, that one is used. */
    write_file(in_folder("damaged/checkpoints/last.gbt.prev"), whole.data, whole.count);
    on.stop_at_step = 6;
    train_fails(tiny, in_folder("damaged"), &on, GBT_ERR_INTERRUPTED, "after step 6");
    file_bytes kept = read_bytes(in_folder("damaged/checkpoints/last.gbt.prev")); /* not the damaged one */
    assert_int_equal(kept.count, whole.count);
    assert_memory_equal(kept.data, whole.data, whole.count);
    mem_free(kept.data);
    resume_ok(in_folder("damaged"));
    assert_same_file(straight_run(), in_folder("damaged/model.gbt"));
    mem_free(whole.data);

    train_fails(tiny, in_folder("empty"), &on, GBT_ERR_IO, "empty/checkpoints/last.gbt");
}

/* A kill leaves rows of steps behind that the checkpoint does not know, and perhaps half a row: resuming
   takes them out. */
static void the_log_goes_back_with_the_checkpoint(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.stop_at_step = 5;
    train_fails(tiny, in_folder("log"), &def, GBT_ERR_INTERRUPTED, "after step 5");
    FILE *csv = fopen(in_folder("log/log.csv"), "a");
    assert_non_null(csv);
    fputs("5,0.1\n6,0.2\n700000,0.3\n700001,0.", csv);
    fclose(csv);
    resume_ok(in_folder("log"));
    unsigned char *text = NULL;
    size_t size = 0;
    assert_ok(file_read(in_folder("log/log.csv"), &text, &size, NULL));
    assert_true(strncmp((const char *)text, "step,seconds,", 13) == 0);
    assert_non_null(strstr((const char *)text, "\n5,0.1\n"));
    assert_null(strstr((const char *)text, "\n6,0.2\n"));
    assert_null(strstr((const char *)text, "70000"));
    mem_free(text);
}

static void a_foreign_checkpoint_is_refused(void **state)
{
    (void)state;
    gbt_train_def def = run_def();
    def.stop_at_step = 2;
    train_fails(tiny, in_folder("mine"), &def, GBT_ERR_INTERRUPTED, "after step 2");
    const char *path = in_folder("mine/checkpoints/last.gbt");
    trainer t;
    gbt_error err = {0};

    gbt_train_def other = run_def(); /* other settings */
    other.offsets = 4;
    open_ok(&t, tiny, &other);
    assert_int_equal(checkpoint_load(&t, path, &err), GBT_ERR_FORMAT);
    assert_true(strstr(err.text, path) != NULL);
    trainer_free(&t);

    gbt_make_scene_def scene_def = gbt_make_scene_def_default(); /* other data */
    scene_def.width = 48;
    scene_def.height = 36;
    scene_def.view_count = VIEWS - 1;
    scene_def.points = 150;
    scene_def.samples = 1;
    assert_ok(gbt_make_scene(&scene_def, in_folder("other"), &err));
    gbt_train_def on = gbt_train_def_default();
    on.resume = true;
    train_fails(in_folder("other"), in_folder("mine"), &on, GBT_ERR_FORMAT, "other data");

    err = (gbt_error){0}; /* a model is not a checkpoint */
    open_ok(&t, tiny, &def);
    assert_int_equal(checkpoint_load(&t, in_folder("mine/model.gbt"), &err), GBT_ERR_FORMAT);
    trainer_free(&t);
}

/* ---- schedule and settings ---- */

static void progress_rises_from_0_to_1(void **state)
{
    (void)state;
    static const uint64_t lengths[] = {1, 2, 19, 20, 21, 137, 1000};
    for (size_t l = 0; l < sizeof lengths / sizeof *lengths; l++) {
        const uint64_t n = lengths[l];
        const pace p = pace_of_iterations(n);
        assert_int_equal(pace_total(&p), n);
        double last = -1;
        for (uint64_t step = 0; step < n; step++) {
            const double progress = pace_progress(&p, step);
            assert_true(progress > last && progress >= 0 && progress < 1);
            assert_in_range(pace_segment(&p, step), 0, PACE_SEGMENTS - 1);
            assert_true(p.steps[pace_segment(&p, step)] > 0);
            last = progress;
        }
        assert_true(pace_progress(&p, n) == 1 && pace_progress(&p, n + 1000) == 1);
        assert_int_equal(pace_segment(&p, n), PACE_SEGMENTS);
        if (n >= PACE_SEGMENTS)
            assert_true(pace_progress(&p, 0) == 0);
    }
    pace half = {.steps = {4, 2}, .known = 2}; /* a budget run on its way */
    assert_true(fabs(pace_progress(&half, 2) - 0.5 / PACE_SEGMENTS) < 1e-15);
    assert_true(fabs(pace_progress(&half, 5) - 1.5 / PACE_SEGMENTS) < 1e-15);
    assert_int_equal(pace_segment(&half, 6), 2);
    assert_true(pace_progress(&half, 6) == 2.0 / PACE_SEGMENTS);
}

static void pace_is_read(void **state)
{
    (void)state;
    pace p;
    gbt_error err = {0};
    static const char *const good[] = {
        "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20",
        "1, 2,3 ,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20 ",
        "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20]",
        "[\n    1,\n    2,\n3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,\n    20\n  ]\n"};
    for (size_t k = 0; k < sizeof good / sizeof *good; k++) {
        assert_ok(pace_parse(good[k], &p, &err));
        assert_int_equal(p.known, PACE_SEGMENTS);
        for (int i = 0; i < PACE_SEGMENTS; i++)
            assert_int_equal(p.steps[i], i + 1);
    }
    static const char *const bad[] = {"",
                                      "1",
                                      "1,2",
                                      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21",
                                      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,",
                                      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,x",
                                      "-1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20",
                                      "[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20",
                                      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20]",
                                      "[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20]]",
                                      "[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19]",
                                      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20 1",
                                      "[",
                                      "[]",
                                      " ",
                                      "1,,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20",
                                      "1.5,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20",
                                      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,99999999999999999999"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        err = (gbt_error){0};
        if (pace_parse(bad[i], &p, &err) != GBT_ERR_ARGUMENT || strstr(err.text, "pace") == NULL)
            fail_msg("\"%s\" was taken: %s", bad[i], err.text);
    }
    gbt_train_def def = run_def();
    def.iterations = 0;
    def.pace = "1,2";
    train_fails(tiny, in_folder("bad_pace"), &def, GBT_ERR_ARGUMENT, "pace");
    def.pace = "0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0";
    train_fails(tiny, in_folder("bad_pace"), &def, GBT_ERR_ARGUMENT, "pace: adds up to no step");
    def.pace = "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20";
    def.iterations = 209;
    train_fails(tiny, in_folder("bad_pace"), &def, GBT_ERR_ARGUMENT,
                "iterations: 209, but `pace` adds up to 210");
    trainer t;
    def.iterations = 210;
    open_ok(&t, tiny, &def);
    assert_int_equal(t.pace.steps[19], 20);
    trainer_free(&t);
    def.pace = good[3];
    open_ok(&t, tiny, &def);
    assert_string_equal(t.def.pace, good[0]); /* which the files of the run say */
    trainer_free(&t);
}

static learning_rates rates_at(double progress, bool own, bool geometry_stays, double extent, double end)
{
    return learning_rates_at(&(learning_rates_def){.progress = progress,
                                                   .uses_own_rates = own,
                                                   .geometry_stays = geometry_stays,
                                                   .extent = extent,
                                                   .factor = 1,
                                                   .end = end,
                                                   .views = 1});
}

static void rates_never_rise(void **state)
{
    (void)state;
    double before[6];
    for (int own = 0; own < 2; own++)
        for (int i = 0; i <= 100; i++) { /* positive, finite, and none ever rises */
            const learning_rates r = rates_at(i / 100.0, own, false, 2.0, 1);
            const double now[6] = {r.anchor[ANCHOR_OFFSET],    r.anchor[ANCHOR_FEATURE],
                                   r.anchor[ANCHOR_SCALE_LOG], r.network[DECODER_OPACITY],
                                   r.network[DECODER_SHAPE],   r.network[DECODER_COLOR]};
            for (int k = 0; k < 6; k++) {
                assert_true(isfinite(now[k]) && now[k] > 0);
                assert_true(i == 0 || now[k] <= before[k] * (1 + 1e-12));
                before[k] = now[k];
            }
        }
    assert_true(rates_at(1, true, false, 1, 1).anchor[ANCHOR_FEATURE] <
                0.05 * rates_at(0.9, true, false, 1, 1).anchor[ANCHOR_FEATURE]);
    assert_true(rates_at(1, false, false, 1, 1).anchor[ANCHOR_FEATURE] ==
                rates_at(0.9, false, false, 1, 1).anchor[ANCHOR_FEATURE]);
    assert_true(schedule_rate_end(1) == 1 && schedule_rate_end(4000) == 1 &&
                schedule_rate_end(16000) == 0.5 && schedule_rate_end(1e9) == 0.1);
    assert_true(schedule_left_out(0) == 0 && schedule_left_out(100) == 0 &&
                fabsf(schedule_left_out(300) - 0.2808f) < 1e-4f &&
                fabsf(schedule_left_out(1000) - 0.4988f) < 1e-4f && schedule_left_out(1e9) < 1);
    const learning_rates waits = rates_at(0.05, true, true, 1, 1), learns = rates_at(0.05, true, false, 1, 1);
    assert_true(waits.anchor[ANCHOR_OFFSET] == 0 && waits.anchor[ANCHOR_SCALE_LOG] == 0 &&
                waits.anchor[ANCHOR_FEATURE] > 0 && waits.network[DECODER_SHAPE] > 0);
    assert_true(learns.anchor[ANCHOR_OFFSET] > 0 && learns.anchor[ANCHOR_SCALE_LOG] > 0);
    const learning_rates at_last = rates_at(0.9, true, false, 1, 0.1),
                         flat = rates_at(0.9, true, false, 1, 1);
    assert_true(at_last.anchor[ANCHOR_SCALE_LOG] < 0.13 * flat.anchor[ANCHOR_SCALE_LOG] &&
                at_last.anchor[ANCHOR_OFFSET] == flat.anchor[ANCHOR_OFFSET]);
    for (int i = 0; i <= 100; i++) {
        const learning_rates r = rates_at(i / 100.0, false, false, 2.0, 1);
        assert_true(
            fabs(r.anchor[ANCHOR_OFFSET] / rates_at(i / 100.0, false, false, 1.0, 1).anchor[ANCHOR_OFFSET] -
                 2) < 1e-12);
        assert_true(rates_at(i / 100.0, true, false, 2.0, 1).anchor[ANCHOR_OFFSET] ==
                    rates_at(i / 100.0, true, false, 1.0, 1).anchor[ANCHOR_OFFSET]);
    }
}

/* Every setting: its default is within its range, and reads back from text to the same bits. */
static void settings_are_whole(void **state)
{
    (void)state;
    const gbt_train_def usual = gbt_train_def_default();
    int texts = 0;
    for (size_t i = 0; i < gbt_train_setting_count(); i++) {
        const gbt_train_setting *s = gbt_train_setting_at(i);
        static setting_texts kept;
        char text[SETTING_TEXT_SIZE], again[SETTING_TEXT_SIZE];
        gbt_train_def back = usual;
        gbt_error err = {0};
        texts += s->kind == GBT_SETTING_TEXT;
        if (setting_find(s->name) != s || (s->option != NULL && setting_find(s->option) != s))
            fail_msg("%s: another setting has its name", s->name);
        setting_text(s, &usual, text, sizeof text);
        if (setting_check(s, &usual, &err) != GBT_OK || !setting_read(s, text, &kept, &back))
            fail_msg("%s = %s: %s", s->name, text, err.text);
        setting_text(s, &back, again, sizeof again);
        assert_string_equal(text, again);
        if (s->help == NULL || (s->kind == GBT_SETTING_CHOICE && s->choices == NULL))
            fail_msg("%s: incomplete", s->name);
    }
    assert_int_equal(texts, SETTING_TEXTS);
}

/* No text is taken for another number. */
static void whole_numbers_are_whole(void **state)
{
    (void)state;
    static const struct {
        const char *name, *text;
        double wanted; /* NaN: refused */
    } rows[] = {{"iterations", "40", 40},
                {"iterations", "4e1", 40},
                {"iterations", "40.0", 40},
                {"iterations", "0x20", 32},
                {"iterations", "12.9", NAN},
                {"iterations", "-1", NAN},
                {"seed", "18446744073709551615", 18446744073709551615.0},
                {"seed", "18446744073709551616", NAN},
                {"max-anchors", "2e+06", 2000000},
                {"views", "2", 2},
                {"views", "2.9", NAN},
                {"offsets", "3e10", NAN},
                {"memory", "1000000", 1000000},
                {"memory", "1e6x", NAN}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        static setting_texts kept;
        gbt_train_def def = gbt_train_def_default();
        const gbt_train_setting *s = setting_find(rows[i].name);
        assert_non_null(s);
        const bool is_read = setting_read(s, rows[i].text, &kept, &def);
        char text[SETTING_TEXT_SIZE] = "";
        setting_text(s, &def, text, sizeof text);
        if (is_read == (bool)isnan(rows[i].wanted) ||
            (is_read && fabs(strtod(text, NULL) - rows[i].wanted) > 0))
            fail_msg("%s = %s: read as %s", rows[i].name, rows[i].text, is_read ? text : "nothing");
    }
}

static void settings_out_of_range_are_named(void **state)
{
    (void)state;
    enum { BAD = 9 };
    gbt_train_def bad[BAD];
    for (int i = 0; i < BAD; i++)
        bad[i] = gbt_train_def_default();
    bad[0].init_count = 3;
    bad[1].init = (gbt_init_kind)9;
    bad[2].renderer = GBT_RENDERER_REFERENCE;
    bad[3].scale_factor = 0.001;
    bad[4].max_anchors = 0;
    bad[5].cookie_ = 0;
    bad[6].eval_at_seconds[0] = NAN;
    bad[6].eval_at_count = 1;
    bad[7].eval_at_seconds[0] = 5;
    bad[7].eval_at_seconds[1] = 3;
    bad[7].eval_at_count = 2;
    bad[8].eval_split = NULL;
    static const char *const says[BAD] = {"init_count: 3 (wanted 0 to 1)",
                                          "init: 9 (wanted gb, adaptive, voxel or random)",
                                          "renderer: 3 (wanted trace, raster or per-ray)",
                                          "scale_factor: 0.001 (wanted 0.01 to 100, or 0)",
                                          "max_anchors: 0 (wanted 1 to 1e+08)",
                                          "the def was not made by gbt_train_def_default() of this version",
                                          "eval_at_seconds: nan (wanted increasing times, from 0 on)",
                                          "eval_at_seconds: 3 (wanted increasing times, from 0 on)",
                                          "eval_split: NULL (wanted text)"};
    for (int i = 0; i < BAD; i++) {
        gbt_error err = {0};
        trainer t = {0};
        assert_int_equal(trainer_open(&t, tiny, &bad[i], &err), GBT_ERR_ARGUMENT);
        trainer_free(&t);
        assert_string_equal(err.text, says[i]);
    }
}

static void config_comes_back(void **state)
{
    (void)state;
    gbt_train_def def = gbt_train_def_default();
    def.init = GBT_INIT_VOXEL;
    def.scale_prior = GBT_SCALE_PRIOR_NN;
    def.max_depth = 7;
    def.voxel_size = 0.1f;
    def.offsets = 3;
    def.distance = GBT_DISTANCE_INPUT_OFF;
    def.iterations = 123456789012ull;
    def.budget_seconds = 1 / 3.0;
    def.pace = "1,2,3";
    def.downscale = 1.1;
    def.step_pixels = 1234;
    def.eval_split = "list=a = b.txt";
    def.seed = UINT64_MAX;
    def.max_anchors = 77;
    def.grow = false;
    def.compat = true;
    def.exposure = true;
    def.learning_rate_factor = 0.3;
    char text[CONFIG_TEXT_SIZE], again[CONFIG_TEXT_SIZE];
    config_text(&def, "/some where/= data", text, sizeof text);
    gbt_train_def back = gbt_train_def_default();
    config_strings strings;
    gbt_error err = {0};
    if (config_parse(text, "config", &back, &strings, &err) != GBT_OK)
        fail_msg("%s", err.text);
    config_text(&back, strings.data, again, sizeof again);
    assert_string_equal(text, again);
    assert_true(back.voxel_size == def.voxel_size && back.budget_seconds == def.budget_seconds &&
                back.seed == UINT64_MAX && back.step_pixels == 1234 && !back.grow && back.compat);
    assert_true(back.exposure && back.learning_rate_factor == 0.3);

    def = gbt_train_def_default();
    config_text(&def, "d", text, sizeof text);
    static const char *const shortest[] = {"\nfootprint = 0.1\n", "\nnear = 0.5\n", "\nscale-factor = 0\n"};
    for (size_t i = 0; i < sizeof shortest / sizeof *shortest; i++)
        assert_non_null(strstr(text, shortest[i]));
    back.pace = "1";
    assert_ok(config_parse(text, "config", &back, &strings, &err));
    assert_null(back.pace);

    /* Names of the command line, and one that older files have. */
    assert_ok(config_parse(
        "threshold-factor = 2\nfinal-prune-factor = 3\nbudget = 7\ngrow = false\nstart-level = 2\n", "config",
        &back, &strings, &err));
    assert_true(back.threshold_factor == 2 && back.final_prune_factor == 3 && back.budget_seconds == 7 &&
                !back.grow);

    char folder[900]; /* a deep folder must not make a run that cannot go on */
    memset(folder, 'd', sizeof folder - 1);
    folder[sizeof folder - 1] = '\0';
    config_text(&def, folder, text, sizeof text);
    assert_ok(config_parse(text, "config", &back, &strings, &err));
    assert_string_equal(strings.data, folder);

    static const struct {
        const char *text, *says;
    } bad[] = {
        {"seed = 1\nnonsense\n", "config:2"}, {"seed = x\n", "config:1"}, {"colour = 1\n", "colour"},
        {"offsets = \n", "offsets"},          {"grow=1\n", "config:1"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        err = (gbt_error){0};
        if (config_parse(bad[i].text, "config", &back, &strings, &err) != GBT_ERR_FORMAT ||
            strstr(err.text, bad[i].says) == NULL)
            fail_msg("\"%s\": %s", bad[i].text, err.text);
    }
    static const char *const wild[] = {"max-depth = 1e30\n", "max-depth = nan\n", "offsets = -1e300\n",
                                       "step-pixels = inf\n"};
    for (size_t i = 0; i < sizeof wild / sizeof *wild; i++) { /* whole numbers out of range: refused here or
                                                                 where the def is checked */
        err = (gbt_error){0};
        back = gbt_train_def_default();
        trainer t = {0};
        const bool refused = config_parse(wild[i], "config", &back, &strings, &err) != GBT_OK ||
                             trainer_open(&t, tiny, &back, &err) != GBT_OK;
        trainer_free(&t);
        assert_true(refused);
    }
}

/* ---- photos ---- */

/* Every pixel of every phase is the photo's, seen by the photo's ray. */
static void a_config_ends_with_its_buffer(void **state)
{
    (void)state;
    const gbt_train_def def = gbt_train_def_default();
    char whole[CONFIG_TEXT_SIZE], text[CONFIG_TEXT_SIZE];
    config_text(&def, "data", whole, sizeof whole);
    for (size_t size = 1; size <= strlen(whole) + 1; size++) {
        memset(text, '#', sizeof text);
        config_text(&def, "data", text, size);
        assert_int_equal(strlen(text), size - 1);
        assert_memory_equal(text, whole, size - 1);
        for (size_t i = size; i < sizeof text; i++)
            assert_int_equal(text[i], '#');
    }
}

static void samples_are_pixels_of_the_photo(void **state)
{
    (void)state;
    scene s;
    photos p;
    image full = {0}, got = {0};
    const unsigned char *valid;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    assert_ok(photos_open(&p, &s, 1, NULL));
    const size_t views[] = {2, 0};
    assert_ok(photos_load(&p, views, 2, NULL));
    assert_true(p.full[0] != NULL && p.full[2] != NULL && p.full[1] == NULL);
    assert_ok(photos_get(&p, 0, 0, &full, NULL, NULL));
    const gbt_camera whole = photos_camera(&p, 0, 0);
    size_t seen = 0;
    for (int step = 1; step <= 5; step++)
        for (int first = 0; first < step * step; first++) {
            const photo_sample sample = {.pick = {.first = {first % step, first / step}, .step = step}};
            gbt_camera camera;
            assert_ok(photos_get_sample(&p, 0, &sample, &got, &camera, &valid, NULL));
            assert_null(valid);
            assert_true(got.width == whole.width / step && got.height == whole.height / step);
            assert_true(camera.width == got.width && camera.height == got.height);
            for (int y = 0; y < got.height; y++)
                for (int x = 0; x < got.width; x++, seen++) {
                    const int at[2] = {x * step + sample.pick.first[0], y * step + sample.pick.first[1]};
                    assert_memory_equal(got.pixels + 3 * (y * got.width + x),
                                        full.pixels + 3 * (at[1] * full.width + at[0]), 3 * sizeof(float));
                    double a[3], b[3];
                    assert_true(gbt_camera_unproject(&camera, x + 0.5, y + 0.5, a) &&
                                gbt_camera_unproject(&whole, at[0] + 0.5, at[1] + 0.5, b));
                    for (int c = 0; c < 3; c++)
                        assert_true(fabs(a[c] - b[c]) < 1e-14);
                }
        }
    assert_int_equal(seen, 4 * 48 * 36 + 45 * 35); /* each once: 48 and 36 are multiples of 1 to 4 */
    const size_t bad[] = {1, 0};
    mem_free(p.full[0]);
    p.full[0] = NULL;
    char *missing = s.views[0].path;
    s.views[0].path = (char *)"/nowhere/photo.png";
    gbt_error err = {0};
    assert_int_equal(photos_load(&p, bad, 2, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "/nowhere/photo.png"));
    s.views[0].path = missing;
    image_free(&full);
    image_free(&got);
    photos_close(&p);
    scene_free(&s);
}

/* The pixels of `part` are those of `whole` from (x0, y0) on, `apart` pixels from each other. */
static bool is_from(const image *part, const image *whole, int x0, int y0, int apart)
{
    for (int y = 0; y < part->height; y++)
        for (int x = 0; x < part->width; x++)
            if (memcmp(part->pixels + 3 * (y * part->width + x),
                       whole->pixels + 3 * ((y0 + apart * y) * whole->width + x0 + apart * x),
                       3 * sizeof(float)) != 0)
                return false;
    return true;
}

static step_view *pick_ok(trainer *t)
{
    step_photos_pick(t);
    step_view_pick(t, &t->views[0], 0);
    if (t->views[0].outcome.status != GBT_OK)
        fail_msg("%s", t->views[0].outcome.text);
    return &t->views[0];
}

/* A step of four views is four looks at photos, here of one pixel in 4. */
static void steps_leave_out_by_looks(void **state)
{
    (void)state;
    for (int views = 1; views <= 4; views += 3) {
        trainer t;
        step_report report;
        gbt_train_def def = run_def();
        def.views = views;
        def.iterations = 5600 / (uint64_t)views;
        open_ok(&t, tiny, &def);
        step_ok(&t, &report);
        const float wanted = schedule_left_out(5600 / (double)t.train_count / 4); /* of every second pixel */
        assert_true(wanted > 0 && t.left_out == wanted);
        trainer_free(&t);
    }
}

/* Of every second pixel in both directions, all four that may be the first come. */
static void picked_pixels_begin_anywhere(void **state)
{
    (void)state;
    trainer t;
    image whole = {0};
    int seen[4] = {0};
    gbt_train_def def = run_def();
    def.iterations = 1000;
    open_ok(&t, tiny, &def);
    for (; t.step < 10 * t.train_count; t.step++) {
        const step_view *v = pick_ok(&t);
        assert_int_equal(v->frame.draw.pixel_step, 2);
        assert_true(v->photo.width == 24 && v->photo.height == 18);
        assert_ok(photos_get(&t.photos, t.train_views[v->slot], 0, &whole, NULL, NULL));
        int found = 0;
        for (int i = 0; i < 4; i++)
            if (is_from(&v->photo, &whole, i % 2, i / 2, 2)) {
                found++;
                seen[i]++;
            }
        assert_int_equal(found, 1);
    }
    for (int i = 0; i < 4; i++)
        assert_true(seen[i] > 0);
    image_free(&whole);
    trainer_free(&t);
}

/* Photos for which there is no memory are read again, and are the same. */
static void photos_keep_to_their_memory(void **state)
{
    (void)state;
    scene s;
    photos small, large;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    assert_ok(photos_open(&small, &s, 1, NULL));
    assert_ok(photos_open(&large, &s, 1, NULL));
    small.bytes_max = 2 * 3 * 48 * 36 + 100;
    small.decoded_max = 1; /* one after another */
    const size_t views[] = {4, 2, 0, 1};
    assert_ok(photos_load(&small, views, 4, NULL));
    image a = {0}, b = {0};
    for (size_t i = 0; i < 40; i++) {
        const size_t view = i * 7 % VIEWS;
        assert_ok(photos_get(&small, view, 0, &a, NULL, NULL));
        assert_ok(photos_get(&large, view, 0, &b, NULL, NULL));
        assert_memory_equal(a.pixels, b.pixels, 3 * 48 * 36 * sizeof(float));
        size_t kept = 0;
        for (size_t v = 0; v < VIEWS; v++)
            kept += small.full[v] != NULL;
        assert_true(kept <= 3 && small.full[4] != NULL && small.full[2] != NULL);
    }
    for (size_t i = 0; i < 20; i++) { /* made smaller, they are photos too */
        const size_t view = i * 7 % VIEWS;
        assert_ok(photos_get(&small, view, 1, &a, NULL, NULL));
        assert_ok(photos_get(&large, view, 1, &b, NULL, NULL));
        assert_memory_equal(a.pixels, b.pixels, 3 * 24 * 18 * sizeof(float));
    }
    assert_int_equal(large.bytes, VIEWS * 3 * 48 * 36);

    /* Whether held-out photos can be read does not depend on the memory for those that are kept. */
    const size_t missing[] = {1, 5};
    char *path = s.views[5].path;
    s.views[5].path = (char *)"/nowhere/photo.png";
    small.bytes_max = 0;
    assert_int_equal(photos_try(&small, missing, 2, NULL), GBT_ERR_IO);
    s.views[5].path = path;
    assert_ok(photos_try(&small, missing, 2, NULL));
    image_free(&a);
    image_free(&b);
    photos_close(&small);
    photos_close(&large);
    scene_free(&s);
}

/* A step looks at about as many pixels whatever the photo's size, and at all of a small one. */
static void steps_keep_to_their_pixels(void **state)
{
    (void)state;
    const gbt_train_def def = gbt_train_def_default();
    const train_rules rules = train_rules_of(&def);
    int last = 1;
    for (int width = 3; width < 12000; width += width / 10 + 1) {
        const gbt_camera camera = {.width = width, .height = width * 2 / 3};
        const double all = (double)width * camera.height, pixels = step_pixel_count(&camera, &rules);
        const int spacing = step_spacing(&camera, rules.step_pixels);
        assert_in_range(spacing, last, width / 2);
        last = spacing;
        assert_true(fabs(pixels * spacing * spacing - all) < 1e-9 * all);
        if (all < 2.25 * rules.step_pixels)
            assert_int_equal(spacing, 1);
        else
            assert_true(pixels > 0.56 * rules.step_pixels && pixels < 1.57 * rules.step_pixels);
    }
    const gbt_camera narrow = {.width = 3, .height = 1000000};
    assert_int_equal(step_spacing(&narrow, rules.step_pixels), 3);
    gbt_train_def compat = def;
    compat.compat = true;
    const train_rules reference = train_rules_of(&compat);
    const gbt_camera large = {.width = 6000, .height = 4000};
    assert_int_equal(step_spacing(&large, reference.step_pixels), 1);
    const gbt_train_def all = {.step_pixels = 0};
    const train_rules of_all = train_rules_of(&all);
    assert_int_equal(step_spacing(&large, of_all.step_pixels), 1);
}

static double downscale_to(const scene *s, double width)
{
    double downscale = 0;
    assert_ok(photos_downscale_to(s, width, &downscale, NULL));
    return downscale;
}

static double usual_downscale(const scene *s, bool limits_width)
{
    double downscale = 0;
    assert_ok(photos_usual_downscale(s, limits_width, &downscale, NULL));
    return downscale;
}

static void wide_photos_get_a_usual_width(void **state)
{
    (void)state;
    scene_view views[3] = {
        {.camera = {.width = 800}}, {.camera = {.width = 4000}}, {.camera = {.width = 3200}}};
    scene s = {.views = views, .view_count = 3};
    assert_true(usual_downscale(&s, true) == 2 && usual_downscale(&s, false) == 1);
    assert_true(downscale_to(&s, 2400) == 3200.0 / 2400 && downscale_to(&s, 4000) == 1);
    views[1].camera.width = 1600;
    assert_true(usual_downscale(&s, true) == 1);
    views[2].camera.width = 100;
    assert_true(usual_downscale(&s, true) == 1);
    image photo; /* of a smaller copy, whose cameras say the size of the originals */
    assert_ok(image_alloc(&photo, 20, 15, 3, NULL));
    for (int i = 0; i < 3; i++) {
        views[i].path = (char *)in_folder(i == 2 ? "small.exr" : "small.png");
        views[i].camera.width = 100;
    }
    assert_ok(image_write(views[0].path, &photo, NULL));
    assert_ok(image_write(views[2].path, &photo, NULL));
    image_free(&photo);
    assert_true(usual_downscale(&s, true) == 5 && usual_downscale(&s, false) == 5);
    photo_check check;
    photo_check_all(&s, &check);
    assert_true(!s.views[0].is_exr && s.views[2].is_exr);
    assert_int_equal(unlink(views[0].path), 0);
    assert_true(usual_downscale(&s, true) == 5); /* headers are read once */
    trainer t;
    const gbt_train_def def = run_def();
    open_ok(&t, tiny, &def);
    assert_true(t.def.downscale == 1);
    trainer_free(&t);
}

static void quantize(image *im)
{
    for (size_t i = 0; i < (size_t)im->width * (size_t)im->height * 3; i++)
        im->pixels[i] = floorf(im->pixels[i] * 255 + 0.5f) / 255;
}

static void photos_are_the_resized_reference(void **state)
{
    (void)state;
    scene s;
    const scene_split split = {.kind = SCENE_SPLIT_NONE};
    assert_ok(scene_load(tiny, &split, &s, NULL));
    static const double downscales[] = {1, 1.5, 3};
    for (size_t d = 0; d < 3; d++) {
        photos p;
        assert_ok(photos_open(&p, &s, downscales[d], NULL));
        image got = {0};
        static const int levels[] = {2, 2, 0, 1, 6, 0};
        for (size_t l = 0; l < sizeof levels / sizeof *levels; l++)
            for (size_t v = 0; v < 3; v++) {
                const int level = levels[l];
                const double divide = downscales[d] * exp2(level);
                const int width = (int)fmax(1, floor(48 / divide + 0.5)),
                          height = (int)fmax(1, floor(36 / divide + 0.5));
                const gbt_camera camera = photos_camera(&p, v, level), full_camera = photos_camera(&p, v, 0);
                assert_int_equal(camera.width, width);
                assert_int_equal(camera.height, height);
                assert_ok(photos_get(&p, v, level, &got, NULL, NULL));
                assert_true(got.width == width && got.height == height && got.channels == 3);
                image full, want;
                assert_ok(scene_read_photo(&s.views[v], full_camera.width, full_camera.height, &full, NULL));
                quantize(&full);
                assert_ok(photo_resize(&full, width, height, &want, NULL));
                for (size_t i = 0; i < (size_t)width * (size_t)height * 3; i++)
                    if (!(fabsf(got.pixels[i] - want.pixels[i]) < 1e-6f))
                        fail_msg("downscale %g level %d value %zu: wanted %.9g, got %.9g", downscales[d],
                                 level, i, (double)want.pixels[i], (double)got.pixels[i]);
                image_free(&full);
                image_free(&want);
                for (size_t other = 0; other < VIEWS; other++) /* those asked for are kept */
                    assert_true((p.full[other] == NULL) == (l == 0 ? other > v : other > 2));
            }
        image_free(&got);
        photos_close(&p);
    }
    scene_free(&s);
}

/* ---- no memory ---- */

static void every_allocation_may_fail(void **state)
{
    (void)state;
    const gbt_train_def def = run_def();
    trainer *t = calloc(1, sizeof *t);
    assert_non_null(t);
    long opened = -1, stepped = -1;
    for (long n = 0; opened < 0; n += n < 40 ? 1 : 7) {
        *t = (trainer){0};
        gbt_error err = {0};
        mem_fail_after(n);
        const gbt_status status = trainer_open(t, tiny, &def, &err);
        mem_fail_after(-1);
        if (status == GBT_OK)
            opened = n;
        else if (status != GBT_ERR_NO_MEMORY || err.text[0] == '\0')
            fail_msg("open, allocation %ld: status %d, %s", n, (int)status, err.text);
        if (status != GBT_OK)
            trainer_free(t);
        assert_true(n < 100000);
    }
    /* Step after step with everything fresh: first the step's own allocations, then (adjusts) those of
       growing. */
    for (long n = 0; stepped < 0; n += n < 40 ? 1 : 5) {
        gbt_error err = {0};
        step_report r;
        mem_fail_after(n);
        const gbt_status status = trainer_step(t, &r, &err);
        mem_fail_after(-1);
        if (status == GBT_OK)
            stepped = n;
        else if (status != GBT_ERR_NO_MEMORY || err.text[0] == '\0')
            fail_msg("step, allocation %ld: status %d, %s", n, (int)status, err.text);
        trainer_free(t);
        if (status != GBT_OK)
            open_ok(t, tiny, &def);
    }
    /* The step that grows: from a checkpoint-like state, so only the number of the allocation differs. */
    for (long n = 0; n < 40; n += 3) {
        open_ok(t, tiny, &def);
        gbt_status status = GBT_OK;
        gbt_error err = {0};
        step_report r;
        for (int i = 0; i < STEPS / 4; i++)
            step_ok(t, &r);
        mem_fail_after(n);
        for (int i = 0; i < 4 && status == GBT_OK; i++)
            status = trainer_step(t, &r, &err);
        mem_fail_after(-1);
        if (status != GBT_OK && status != GBT_ERR_NO_MEMORY)
            fail_msg("growing step, allocation %ld: status %d, %s", n, (int)status, err.text);
        trainer_free(t);
    }
    print_message("open: at most %ld allocations, step: %ld\n", opened, stepped);
    assert_true(opened > 10 && stepped > 5);
    free(t);
}

int main(int argc, char **argv)
{
    if (argc == 4 && strcmp(argv[1], "--child") == 0)
        return child_main(argv[2], argv[3]);
    be_quiet();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(progress_rises_from_0_to_1),
        cmocka_unit_test(pace_is_read),
        cmocka_unit_test(rates_never_rise),
        cmocka_unit_test(settings_are_whole),
        cmocka_unit_test(whole_numbers_are_whole),
        cmocka_unit_test(settings_out_of_range_are_named),
        cmocka_unit_test(config_comes_back),
        cmocka_unit_test(a_config_ends_with_its_buffer),
        cmocka_unit_test(samples_are_pixels_of_the_photo),
        cmocka_unit_test(steps_leave_out_by_looks),
        cmocka_unit_test(picked_pixels_begin_anywhere),
        cmocka_unit_test(photos_keep_to_their_memory),
        cmocka_unit_test(steps_keep_to_their_pixels),
        cmocka_unit_test(wide_photos_get_a_usual_width),
        cmocka_unit_test(photos_are_the_resized_reference),
        cmocka_unit_test(interrupted_and_resumed_is_straight),
        cmocka_unit_test(extra_checkpoints_change_nothing),
        cmocka_unit_test(resumes_from_a_save_beside_the_steps),
        cmocka_unit_test(a_save_has_its_own_exposures_and_poses),
        cmocka_unit_test(killed_and_resumed_is_straight),
        cmocka_unit_test(resumes_from_the_previous_checkpoint),
        cmocka_unit_test(a_signal_saves_and_ends),
        cmocka_unit_test(memory_for_hits_changes_no_bits),
        cmocka_unit_test(threads_and_memory_do_not_change_bits),
        cmocka_unit_test(instruction_sets_do_not_change_bits),
        cmocka_unit_test(more_memory_than_allowed),
        cmocka_unit_test(another_seed_changes_bits),
        cmocka_unit_test(a_budget_run_can_be_repeated),
        cmocka_unit_test(a_decimal_comma_changes_no_file),
        cmocka_unit_test(a_budget_gives_its_parts_equal_times),
        cmocka_unit_test(a_budget_run_resumes_its_clock),
        cmocka_unit_test(training_learns),
        cmocka_unit_test(without_growing_the_anchors_stay),
        cmocka_unit_test(growth_stops_at_max_anchors),
        cmocka_unit_test(growth_begins_at_the_points),
        cmocka_unit_test(growth_asks_for_two_views),
        cmocka_unit_test(new_geometry_begins_at_its_own_pace),
        cmocka_unit_test(moments_follow_their_rows),
        cmocka_unit_test(points_are_made_where_there_are_none),
        cmocka_unit_test(points_are_made_where_axes_do_not_meet),
        cmocka_unit_test(closed_folders_are_told_first),
        cmocka_unit_test(data_without_training_photos_is_refused),
        cmocka_unit_test(validation_needs_no_held_out_photo),
        cmocka_unit_test(a_run_is_overwritten_only_when_asked),
        cmocka_unit_test(foreign_files_are_kept),
        cmocka_unit_test(a_vanished_photo_is_named),
        cmocka_unit_test(a_full_disk_leaves_the_old_checkpoint),
        cmocka_unit_test(poses_stay_with_their_model),
        cmocka_unit_test(a_save_that_failed_is_made_once_more),
        cmocka_unit_test(a_damaged_checkpoint_is_refused),
        cmocka_unit_test(the_log_goes_back_with_the_checkpoint),
        cmocka_unit_test(a_foreign_checkpoint_is_refused),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return _cmocka_run_group_tests("trainer", tests, sizeof tests / sizeof *tests, make_root, folder_remove);
}
