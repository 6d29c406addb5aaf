/* SPDX-License-Identifier: Apache-2.0 */
/* train/run.c -- a whole training run: the loop around the steps, its folder, its clock, its signals. */
#include <string.h>

#include "base/clock.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "base/plain_numbers.h"
#include "base/stop_signal.h"
#include "base/vec.h"
#include "cluster/cluster.h"
#include "train/align.h"
#include "train/budget.h"
#include "train/checkpoint.h"
#include "train/config.h"
#include "train/held_out.h"
#include "train/old_run.h"
#include "train/pose_file.h"
#include "train/resume.h"
#include "train/run_data.h"
#include "train/run_log.h"
#include "train/run_split.h"
#include "train/save.h"
#include "train/trainer.h"

void gbt_set_threads(int threads) { parallel_set_threads(threads); }

gbt_status gbt_set_memory(size_t bytes, const char *folder, gbt_error *err)
{
    paged_stop();
    return bytes > 0 ? paged_start(folder, bytes / 8 * 5, err) : GBT_OK; /* the rest is for memory that cannot
                                                                            be paged out */
}

gbt_status gbt_hold_run(const char *run, int *hold, gbt_error *err)
{
    int lock = -1;
    GBT_TRY(cluster_follow(cluster_leads() ? file_lock_folder(run, &lock, err) : GBT_OK, err));
    *hold = lock;
    return GBT_OK;
}

void gbt_release_run(int hold)
{
    if (hold >= 0)
        file_unlock_folder(hold);
}

/* ---- the run's folder ---- */

static gbt_status name_paths(const char *run, run_paths *p, gbt_error *err)
{
    char checkpoints[RUN_PATH_SIZE];
    GBT_TRY(file_join(checkpoints, sizeof checkpoints, run, "checkpoints", err));
    GBT_TRY(file_join(p->model, sizeof p->model, run, "model.gbt", err));
    GBT_TRY(file_join(p->config, sizeof p->config, run, "config", err));
    GBT_TRY(file_join(p->log, sizeof p->log, run, "log.csv", err));
    GBT_TRY(file_join(p->events, sizeof p->events, run, EVENTS_TRAIN_NAME, err));
    GBT_TRY(file_join(p->json, sizeof p->json, run, "train.json", err));
    GBT_TRY(file_join(p->exposure, sizeof p->exposure, run, "exposure.json", err));
    GBT_TRY(file_join(p->poses, sizeof p->poses, run, POSE_FILE_NAME, err));
    GBT_TRY(file_join(p->checkpoint, sizeof p->checkpoint, checkpoints, "last.gbt", err));
    return file_join(p->checkpoint_previous, sizeof p->checkpoint_previous, checkpoints, "last.gbt.prev",
                     err);
}

static gbt_status open_folder(const char *run, const gbt_train_def *def, const run_paths *p, gbt_error *err)
{
    char checkpoints[RUN_PATH_SIZE];
    GBT_TRY(file_join(checkpoints, sizeof checkpoints, run, "checkpoints", err));
    const char *const held[] = {p->checkpoint, p->checkpoint_previous, p->model};
    file_kind kinds[3];
    for (int i = 0; i < 3; i++)
        GBT_TRY(file_look(held[i], &kinds[i], err));
    const bool has_checkpoint = kinds[0] != FILE_NONE || kinds[1] != FILE_NONE;
    if (def->resume && !has_checkpoint)
        return base_fail(err, GBT_ERR_IO, "%.1000s: holds no run to resume (there is no %.1000s)", run,
                         p->checkpoint);
    if (!def->resume && !def->overwrite && (kinds[2] != FILE_NONE || has_checkpoint))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%.1000s: already holds a run (continue it with `resume`, replace it with "
                         "`overwrite`, or choose another folder)",
                         run);
    if (!def->resume && !def->overwrite)
        GBT_TRY(old_run_check_foreign(run, err));
    GBT_TRY(file_make_folder(checkpoints, err));
    GBT_TRY(file_check_folder_creatable(run, err));
    return file_check_folder_creatable(checkpoints, err);
}

/* ---- the loop ---- */

/* At the end of a run: align the held-out photos, and report how far the poses moved. */
static gbt_status finish_poses(trainer *t, gbt_error *err)
{
    double angle, distance;
    GBT_TRY(align_held_out(t, err));
    t->poses.held_out_aligned = true;
    GBT_TRY(poses_moved(&t->poses, &t->scene, t->train_views, t->train_count, &angle, &distance, err));
    log_info("%s: poses moved by %.2g degrees and %.2g scene units (the median photo); %zu held-out photos "
             "are scored from where the scene fits them best",
             t->scene.folder, angle * (180 / PI), distance, t->test_count);
    return GBT_OK;
}

static gbt_status evaluate_in_passing(trainer *t, run_log *log, gbt_error *err)
{
    double psnr;
    GBT_TRY(held_out_psnr(t, &psnr, err));
    run_log_evaluation(log, t, psnr);
    return GBT_OK;
}

/* What the first process does between steps. */
typedef struct run_clock {
    step_speed measured;
    double begin, offset, paused, last_save; /* seconds; offset: training time before the run was resumed */
    int next_eval;
    save_in_background *saving;
} run_clock;

static run_clock clock_start(const trainer *t, const run_log *log, save_in_background *saving)
{
    run_clock c = {.begin = clock_wall(), .offset = t->seconds, .last_save = t->seconds, .saving = saving};
    const double *at = t->def.eval_at_seconds,
                 scored = log->evaluated_count > 0 ? log->evaluated_seconds[log->evaluated_count - 1] : 0;
    while (c.next_eval < t->def.eval_at_count && at[c.next_eval] <= t->seconds)
        c.next_eval++;
    if (c.next_eval > 0 && t->step == 0)
        log_warn("eval_at: nothing can be scored before the first step, at %.1f s; times skipped: %d",
                 t->seconds, c.next_eval);
    else if (c.next_eval > 0 && at[c.next_eval - 1] > scored)
        c.next_eval--; /* a signal came before or during that evaluation */
    return c;
}

/* A run over its memory limit is saved and ends; it can be resumed with more memory. */
static gbt_status check_memory(trainer *t, const run_paths *paths, gbt_error *err)
{
    const size_t peak = t->def.memory > 0 ? mem_peak_bytes() : 0;
    if (peak <= t->def.memory)
        return GBT_OK;
    GBT_TRY(save_surely(t, paths, err));
    return base_fail(
        err, GBT_ERR_NO_MEMORY,
        "memory: %zu MiB is too little: %zu anchors and a view needed %zu MiB at step %llu; saved in %s",
        t->def.memory >> 20, t->anchors.count, (peak >> 20) + 1, (unsigned long long)t->step,
        paths->checkpoint);
}

/* Failures caused by the data (an unreadable photo, non-finite steps): what was learned so far is still
   good. */
static bool is_of_data(gbt_status status) { return status == GBT_ERR_FORMAT || status == GBT_ERR_IO; }

/* End a failed run; it is saved first if the data caused the failure. */
static gbt_status end_failed(trainer *t, const run_paths *paths, save_in_background *saving,
                             gbt_status status, const gbt_error *why, gbt_error *err)
{
    if (is_of_data(status) && t->step > 0 && cluster_leads()) {
        save_finish(saving, NULL);
        if (save_surely(t, paths, NULL) == GBT_OK)
            return base_fail(err, status, "%s; saved in %s", why->text, paths->checkpoint);
    }
    return base_fail(err, status, "%s", why->text);
}

/* Wait for a background save. False when it failed; then the present state must be saved. */
static bool end_saving(save_in_background *saving)
{
    gbt_error why = {0};
    const bool fine = save_finish(saving, &why) == GBT_OK;
    if (!fine)
        log_warn("%s; saving once more", why.text);
    return fine;
}

/* Log, evaluate, save, stop: whatever is due after a step. */
static gbt_status follow_step(trainer *t, const step_report *report, run_clock *c, const run_paths *paths,
                              run_log *log, gbt_error *err)
{
    const gbt_train_def *def = &t->def;
    if (!report->skipped)
        budget_follow(&c->measured, t, t->step - 1, report);
    t->seconds = c->offset + clock_wall() - c->begin - c->paused;
    run_log_step(log, t, report);
    const bool failed = !save_is_under_way(c->saving) && !end_saving(c->saving);
    GBT_TRY(check_memory(t, paths, err));

    bool stop = stop_signal_seen();
    if (!stop && c->next_eval < def->eval_at_count && t->seconds >= def->eval_at_seconds[c->next_eval]) {
        const double before = clock_wall();
        gbt_error why = {0};
        const gbt_status status = evaluate_in_passing(t, log, &why);
        stop = status == GBT_ERR_INTERRUPTED; /* saved below */
        if (status != GBT_OK && !stop)
            return end_failed(t, paths, c->saving, status, &why, err);
        c->paused += clock_wall() - before;
        c->next_eval++;
    }
    stop = stop || (def->stop_at_step > 0 && t->step >= def->stop_at_step);
    const bool due = def->save_every_seconds > 0 && t->seconds - c->last_save >= def->save_every_seconds &&
                     !save_is_under_way(c->saving);
    if (stop || due || failed) {
        end_saving(c->saving);
        const bool at_once = stop || failed || def->memory > 0; /* no background save under a memory limit: it
                                                                   needs a copy */
        GBT_TRY(at_once ? save_surely(t, paths, err) : save_begin(c->saving, t, paths, err));
        c->last_save = t->seconds;
        if (stop)
            return base_fail(err, GBT_ERR_INTERRUPTED,
                             "stopped after step %llu; saved in %s (resume continues)",
                             (unsigned long long)t->step, paths->checkpoint);
    }
    return GBT_OK;
}

static gbt_status run_steps(trainer *t, const run_paths *paths, save_in_background *saving, run_log *log,
                            gbt_error *err)
{
    run_clock c = clock_start(t, log, saving);
    for (;;) {
        if (pace_segment(&t->pace, t->step) >= t->pace.known) {
            if (t->pace.known >= PACE_SEGMENTS)
                return GBT_OK;
            if (cluster_leads())
                budget_extend(t, &c.measured);
            cluster_broadcast(&t->pace, sizeof t->pace);
            continue;
        }
        step_report report;
        gbt_error why = {0};
        gbt_status status = trainer_step(t, &report, &why);
        if (status != GBT_OK) {
            end_failed(t, paths, saving, status, &why, err);
            return is_of_data(status) ? cluster_follow(status, err) : status; /* every process sees other
                                                                                 failures by itself */
        }
        paged_check();
        status = cluster_leads() ? follow_step(t, &report, &c, paths, log, err) : GBT_OK;
        GBT_TRY(cluster_follow(status, err));
    }
}

static gbt_status open_trainer(trainer *t, const char *data, const char *run, const run_paths *paths,
                               const gbt_train_def *def, config_strings *strings, gbt_error *err)
{
    const double begin = clock_wall();
    if (def->memory > 0 && !cluster_leads()) /* the first process has already done so */
        GBT_TRY(gbt_set_memory(def->memory, run, err));
    if (def->resume)
        GBT_TRY(resume_open(t, data, run, paths->checkpoint, paths->checkpoint_previous, def, strings, err));
    else
        GBT_TRY(trainer_open(t, data, def, err));
    for (size_t i = 0; i < t->view_count; i++) /* 0 means no limit here, too */
        t->views[i].frame.scene.tape_bytes_max = def->memory / 8 / t->view_count;
    if (t->step > 0)
        return GBT_OK;
    t->seconds = clock_wall() - begin; /* loading counts */
    if (t->pace.known < PACE_SEGMENTS && t->seconds > t->def.budget_seconds / 2)
        log_warn("budget: reading the data took %.3g of %.3g s (wanted a budget of at least %.3g s)",
                 t->seconds, t->def.budget_seconds, 2 * t->seconds);
    return GBT_OK;
}

/* Check that all processes have read the same data and the same checkpoint, since each reads them by
   itself. */
static gbt_status check_same_start(const trainer *t, gbt_error *err)
{
    struct {
        uint64_t data[CHECKPOINT_DATA_HASHES], step, anchors, round_step;
    } own = {.step = t->step, .anchors = t->anchors.count, .round_step = t->round_step}, first;
    checkpoint_hash_data(t, own.data);
    first = own;
    cluster_broadcast(&first, sizeof first);
    const char *other = checkpoint_data_difference(own.data, first.data);
    gbt_status status = GBT_OK;
    if (other != NULL)
        status = base_fail(err, GBT_ERR_FORMAT, "process %d reads other data than process 0 (%.1000s has %s)",
                           gbt_cluster_rank(), t->scene.folder, other);
    else if (own.step != first.step || own.anchors != first.anchors || own.round_step != first.round_step)
        status = base_fail(err, GBT_ERR_FORMAT,
                           "process %d resumes from another checkpoint (step %llu with %llu anchors, not "
                           "%llu with %llu)",
                           gbt_cluster_rank(), (unsigned long long)own.step, (unsigned long long)own.anchors,
                           (unsigned long long)first.step, (unsigned long long)first.anchors);
    return cluster_agree(status, err);
}

static gbt_status write_settings(const trainer *t, const char *run, const run_paths *paths, gbt_error *err)
{
    char config[CONFIG_TEXT_SIZE], split[RUN_SPLIT_TEXT_SIZE];
    gbt_train_def def = t->def;
    GBT_TRY(run_data_save(run, t->scene.folder, err)); /* first: old_run_check_foreign() */
    GBT_TRY(run_split_save(run, &t->scene, err));
    GBT_TRY(run_split_text(run, def.eval_split, split, err));
    if (strlen(split) < SETTING_TEXT_SIZE)
        def.eval_split = split;
    config_text(&def, t->scene.folder, config, sizeof config);
    return file_write_atomic(paths->config, config, strlen(config), err);
}

/* Save everything before the held-out photos are aligned, because alignment takes time and can be
   interrupted. */
static gbt_status finish(trainer *t, const run_paths *paths, save_in_background *saving, run_log *log,
                         gbt_error *err)
{
    end_saving(saving);
    GBT_TRY(save_surely(t, paths, err));
    if (log->all.steps > 0 || !run_log_is_of_step(paths->json, t->step))
        GBT_TRY(run_log_summary(log, t, paths->json, err));
    if (t->poses.count > 0) {
        GBT_TRY(finish_poses(t, err));
        GBT_TRY(save_surely(t, paths, err));
    }
    return stop_signal_seen()
               ? base_fail(err, GBT_ERR_INTERRUPTED,
                           "stopped after the last step; saved in %s (resume continues)", paths->checkpoint)
               : GBT_OK;
}

static bool holds_run(const run_paths *paths)
{
    return file_exists(paths->checkpoint) || file_exists(paths->checkpoint_previous) ||
           file_exists(paths->model);
}

/* Write the files that a run has before its first step. */
static gbt_status begin_files(trainer *t, const char *run, const run_paths *paths, const gbt_train_def *def,
                              const config_strings *strings, gbt_error *err)
{
    if (def->overwrite && holds_run(paths))
        GBT_TRY(old_run_remove(run, err));
    /* data_places must describe the data set that checkpoint and model name, also if this run ends before it
       has saved. */
    if (def->resume && strcmp(strings->data, t->scene.folder) != 0)
        GBT_TRY(save_surely(t, paths, err));
    return write_settings(t, run, paths, err);
}

/* Train in a locked folder. Only the first process writes files and messages. */
static gbt_status run_in_folder(trainer *t, const char *data, const char *run, const run_paths *paths,
                                const gbt_train_def *def, config_strings *strings, gbt_error *err)
{
    GBT_TRY(cluster_agree(open_trainer(t, data, run, paths, def, strings, err), err));
    GBT_TRY(check_same_start(t, err));
    run_log log = {0};
    gbt_status status = GBT_OK;
    save_in_background *saving = mem_calloc(1, sizeof *saving, "checkpoint", err);
    GBT_TRY(cluster_agree(saving != NULL ? GBT_OK : GBT_ERR_NO_MEMORY, err));
    if (cluster_leads()) {
        status = begin_files(t, run, paths, def, strings, err);
        if (status == GBT_OK)
            status = run_log_open(&log, t, paths->log, paths->events, err);
    }
    status = cluster_follow(status, err);
    if (status == GBT_OK)
        status = run_steps(t, paths, saving, &log, err);
    if (status == GBT_OK)
        status = cluster_follow(cluster_leads() ? finish(t, paths, saving, &log, err) : GBT_OK, err);
    save_finish(saving, NULL); /* only still running after a failure */
    mem_free(saving);
    if (cluster_leads())
        run_log_close(&log);
    return status;
}

static gbt_status check_data(const char *data, const gbt_train_def *def, gbt_error *err)
{
    GBT_TRY(config_check(def, data, err));
    return scene_need(data, err);
}

/* Create and lock the folder before any work, so that a run that could not be written does not start. */
static gbt_status run_with_folder(trainer *t, const char *data, const char *run, const gbt_train_def *def,
                                  config_strings *strings, gbt_error *err)
{
    if (data == NULL && !def->resume)
        return base_fail(err, GBT_ERR_ARGUMENT, "train: no data given (wanted a data set folder, or resume)");
    run_paths paths;
    int lock = 0;
    gbt_status status = name_paths(run, &paths, err);
    if (status == GBT_OK && cluster_leads() && !def->resume) /* before any folder is made */
        status = check_data(data, def, err);
    if (status == GBT_OK && cluster_leads())
        status = open_folder(run, def, &paths, err);
    const bool opened = status == GBT_OK && cluster_leads();
    if (opened)
        status = file_lock_folder(run, &lock, err);
    const bool locked = opened && status == GBT_OK;
    if (locked && def->memory > 0)
        status = gbt_set_memory(def->memory, run, err);
    if (locked && status == GBT_OK && def->resume) /* it reads checkpoints, so it needs the lock */
        status = resume_mend(paths.checkpoint, paths.checkpoint_previous, err);
    status = cluster_follow(status, err);
    if (status == GBT_OK)
        status = run_in_folder(t, data, run, &paths, def, strings, err);
    if (def->memory > 0)
        paged_stop();
    if (locked)
        file_unlock_folder(lock);
    return status;
}

gbt_status gbt_train(const char *data, const char *run, const gbt_train_def *def, gbt_error *err)
{
    PLAIN_NUMBERS;
    trainer *t = mem_calloc(1, sizeof *t, "trainer", err);
    config_strings *strings = mem_calloc(1, sizeof *strings, "settings", err);
    stop_signal_catch();
    gbt_status status =
        t == NULL || strings == NULL ? GBT_ERR_NO_MEMORY : run_with_folder(t, data, run, def, strings, err);
    stop_signal_release();
    if (t != NULL)
        trainer_free(t);
    mem_free(t);
    mem_free(strings);
    return status;
}

gbt_status gbt_train_with(const char *data, const char *run, const char *settings, gbt_error *err)
{
    PLAIN_NUMBERS;
    gbt_train_def def = gbt_train_def_default();
    config_strings strings;
    GBT_TRY(config_parse(settings, "settings", &def, &strings, err));
    return gbt_train(data, run, &def, err);
}
