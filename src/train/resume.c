/* SPDX-License-Identifier: Apache-2.0 */
/* train/resume.c -- continue a run from its checkpoint. */
#include "train/resume.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "train/checkpoint.h"
#include "train/def.h"
#include "train/run_data.h"
#include "train/run_split.h"

gbt_status resume_mend(const char *latest, const char *previous, gbt_error *err)
{
    char config[CONFIG_TEXT_SIZE];
    gbt_error why = {0};
    if (!file_exists(latest) || !file_exists(previous) ||
        checkpoint_config(latest, config, sizeof config, &why) != GBT_ERR_FORMAT ||
        checkpoint_config(previous, config, sizeof config, NULL) != GBT_OK)
        return GBT_OK; /* resume_open() reports the error, if there is one */
    log_warn("%s; going on from %s", why.text, previous);
    if (rename(previous, latest) != 0)
        return base_fail(err, GBT_ERR_IO, "%s: cannot be renamed to %s: %s", previous, latest,
                         strerror(errno));
    return GBT_OK;
}

/* Settings of the run's length: they may change on --resume (change_length()). */
static bool is_length(const gbt_train_setting *s)
{
    return s->offset == offsetof(gbt_train_def, iterations) ||
           s->offset == offsetof(gbt_train_def, budget_seconds);
}

/* Warn about settings that were asked for (those that differ from the default) and differ from the run's own.
   `saved` has been through train_def_settle(). */
static void warn_of_differences(const gbt_train_def *asked, const gbt_train_def *saved)
{
    const gbt_train_def usual = gbt_train_def_default();
    for (size_t i = 0; i < gbt_train_setting_count(); i++) {
        const gbt_train_setting *s = gbt_train_setting_at(i);
        char wanted[SETTING_TEXT_SIZE], by_default[SETTING_TEXT_SIZE], own[SETTING_TEXT_SIZE];
        setting_text(s, asked, wanted, sizeof wanted);
        setting_text(s, &usual, by_default, sizeof by_default);
        setting_text(s, saved, own, sizeof own);
        if (s->saved && !is_length(s) && strcmp(wanted, by_default) != 0 && strcmp(wanted, own) != 0)
            log_warn("a run is resumed with its own settings: %s = %s, not %s", s->name, own, wanted);
    }
}

static gbt_status open_data(trainer *t, const char *data, const char *run, const gbt_train_def *def,
                            const char *named, gbt_error *err)
{
    run_data own;
    if (data == NULL) {
        run_data_find(run, named, &own);
        if (own.place[0] == '\0')
            return base_fail(err, GBT_ERR_IO,
                             "%.1000s: its data set is not found (tried %.2000s; give its new folder)", run,
                             own.tried);
        data = file_is_same(named, own.place) ? named : own.place;
    }
    return trainer_open(t, data, def, err);
}

/* The pace of a budget of which t->seconds are spent: the steps done so far were its first parts; the
   remaining parts are decided during the run. */
static pace pace_of_time_spent(const trainer *t, double budget_seconds)
{
    const int parts =
        (int)fmin(fmax(round(PACE_SEGMENTS * t->seconds / budget_seconds), 1), PACE_SEGMENTS - 1);
    pace p = {.known = t->step > 0 ? parts : 0};
    for (int i = 0; i < p.known; i++)
        p.steps[i] = ((uint64_t)i + 1) * t->step / (uint64_t)parts - (uint64_t)i * t->step / (uint64_t)parts;
    return p;
}

/* The new schedule counts only statistics gathered from here on; 0 is a run before its first round. */
static void change_pace(trainer *t, pace p)
{
    t->pace = p;
    if (t->round_step > 0)
        t->round_step = t->step;
}

static gbt_status change_length(trainer *t, const char *run, const gbt_train_def *asked, gbt_error *err)
{
    gbt_train_def *own = &t->def;
    const bool by_time = own->iterations == 0 && own->pace == NULL;
    if (asked->iterations > 0 && asked->iterations != own->iterations) {
        if (asked->iterations <= t->step)
            return base_fail(
                err, GBT_ERR_ARGUMENT,
                "%.1000s: %llu iterations were asked for (wanted more than the %llu that it has done)", run,
                (unsigned long long)asked->iterations, (unsigned long long)t->step);
        own->iterations = asked->iterations;
        own->pace = NULL;
        change_pace(t, pace_of_iterations(own->iterations));
        log_info("%s: %llu steps done; training continues to step %llu, with the schedules of a run of that "
                 "length",
                 run, (unsigned long long)t->step, (unsigned long long)own->iterations);
    } else if (asked->iterations == 0 && asked->budget_seconds > 0 &&
               (asked->pace == NULL || own->pace == NULL) &&
               !(by_time && asked->budget_seconds == own->budget_seconds)) {
        if (asked->budget_seconds <= t->seconds)
            return base_fail(
                err, GBT_ERR_ARGUMENT,
                "%.1000s: %g seconds of training were asked for (wanted more than the %.1f it had)", run,
                asked->budget_seconds, t->seconds);
        own->iterations = 0;
        own->budget_seconds = asked->budget_seconds;
        own->pace = NULL;
        change_pace(t, pace_of_time_spent(t, own->budget_seconds));
        log_info(
            "%s: %.1f s of training done; it continues to %g s, with the schedules of a run of that length",
            run, t->seconds, own->budget_seconds);
    } else if (t->pace.known == PACE_SEGMENTS && t->step >= pace_total(&t->pace)) {
        log_info("%s: all %llu steps are done; with more iterations, or more time, training continues", run,
                 (unsigned long long)t->step);
    }
    return GBT_OK;
}

gbt_status resume_open(trainer *t, const char *data, const char *run, const char *latest,
                       const char *previous, const gbt_train_def *def, config_strings *strings,
                       gbt_error *err)
{
    char config[CONFIG_TEXT_SIZE];
    const char *path = !file_exists(latest) && file_exists(previous) ? previous : latest;
    GBT_TRY(train_def_check(def, err));
    GBT_TRY(checkpoint_config(path, config, sizeof config, err));
    gbt_train_def saved = *def;
    for (size_t i = 0; i < gbt_train_setting_count(); i++) /* the config leaves out some settings with default
                                                              values */
        if (gbt_train_setting_at(i)->saved)
            setting_set_default(gbt_train_setting_at(i), &saved);
    GBT_TRY(config_parse(config, path, &saved, strings, err));
    saved.lossless = saved.lossless || def->lossless; /* affects the model file, not training */
    warn_of_differences(def, &saved);
    const char *named = saved.eval_split; /* the list in the run's own files, wherever the original list is
                                             now */
    char split[RUN_SPLIT_TEXT_SIZE];
    GBT_TRY(run_split_text(run, named, split, err));
    saved.eval_split = split;
    GBT_TRY(open_data(t, data, run, &saved, strings->data, err));
    t->def.eval_split = named;
    GBT_TRY(checkpoint_load(t, path, err));
    return change_length(t, run, def, err);
}
