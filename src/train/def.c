/* SPDX-License-Identifier: Apache-2.0 */
/* train/def.c -- the definition struct of training: defaults, checks, and the values that 0 stands for. */
#include "train/def.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/choice.h"
#include "base/def.h"
#include "base/log.h"
#include "train/rules.h"
#include "train/settings.h"

gbt_train_def gbt_train_def_default(void)
{
    gbt_train_def def = {.command = "", .cookie_ = DEF_COOKIE};
    for (size_t i = 0; i < gbt_train_setting_count(); i++)
        setting_set_default(gbt_train_setting_at(i), &def);
    return def;
}

gbt_status train_def_check(const gbt_train_def *d, gbt_error *err)
{
    GBT_TRY(def_check(d->cookie_, "gbt_train_def_default", err));
    for (size_t i = 0; i < gbt_train_setting_count(); i++)
        GBT_TRY(setting_check(gbt_train_setting_at(i), d, err));
    if ((d->views & (d->views - 1)) != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "views: %d (wanted a power of two)", d->views);
    if (d->eval_at_count < 0 || d->eval_at_count > GBT_TRAIN_MAX_EVALS)
        return base_fail(err, GBT_ERR_ARGUMENT, "eval_at_count: %d (wanted 0 to %d)", d->eval_at_count,
                         GBT_TRAIN_MAX_EVALS);
    const double *at = d->eval_at_seconds;
    for (int i = 0; i < d->eval_at_count; i++)
        if (!(at[i] >= 0 && (i == 0 || at[i] > at[i - 1])))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "eval_at_seconds: %g (wanted increasing times, from 0 on)", at[i]);
    if (d->resume && d->overwrite)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "overwrite: would delete the run that resume continues (wanted one of the two)");
    return GBT_OK;
}

void train_def_settle(gbt_train_def *d)
{
    const train_rules rules = train_rules_of(d);
    if (d->budget_seconds == 0)
        d->budget_seconds = TRAIN_BUDGET_SECONDS;
    if (d->offsets == 0)
        d->offsets = rules.offsets;
    if (d->scale_factor == 0) {
        const bool from_balls = d->init == GBT_INIT_GB && d->scale_prior == GBT_SCALE_PRIOR_GB;
        d->scale_factor = from_balls ? rules.ball_scale_factor : rules.spacing_scale_factor;
    }
    if (!rules.uses_footprint)
        d->footprint = 0;
    if (rules.near_depth > 0)
        d->near = 0;
    if (isinf(rules.step_pixels))
        d->step_pixels = 0;
    if (d->compat && d->alpha == GBT_ALPHA_AUTO)
        d->alpha = GBT_ALPHA_BLACK; /* Blender's scenes, too */
}

void train_def_warn_unused(const gbt_train_def *d)
{
    const gbt_train_def usual = gbt_train_def_default();
    const struct {
        const char *name;
        double value, usual;
    } own[] = {{"splats_until", d->splats_until, usual.splats_until},
               {"threshold_factor", d->threshold_factor, usual.threshold_factor},
               {"final_prune_factor", d->final_prune_factor, usual.final_prune_factor},
               {"step_pixels", d->step_pixels, usual.step_pixels},
               {"near", d->near, usual.near},
               {"footprint", d->footprint, usual.footprint}};
    char names[256] = "";
    for (size_t i = 0; d->compat && i < sizeof own / sizeof *own; i++)
        if (fabs(own[i].value - own[i].usual) > 0 && own[i].value != 0) /* 0 is what the config of a compat
                                                                           run contains */
            snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s",
                     names[0] != '\0' ? ", " : "", own[i].name);
    if (names[0] != '\0')
        log_warn("%s: ignored with compat", names);
    if (d->init_count > 0 && d->init != GBT_INIT_ADAPTIVE && d->init != GBT_INIT_RANDOM)
        log_warn("init_count: ignored with init %s", CHOICE_NAME(GBT_INIT_NAMES, d->init));
    if (d->splats_until > 0 && d->renderer != GBT_RENDERER_TRACE)
        log_warn("splats_until: ignored with renderer %s", CHOICE_NAME(GBT_RENDERER_NAMES, d->renderer));
}
