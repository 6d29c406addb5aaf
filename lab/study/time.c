/* SPDX-License-Identifier: Apache-2.0 */
/* study/time.c -- the study "time": make its runs. */
#include "study/time.h"

#include "base/fail.h"

static gbt_status run_one(const void *study, size_t scene, size_t variant, int seed, const char *folder,
                          study_figures *out, gbt_error *err)
{
    const time_study *s = study;
    const time_variant *v = &time_variants[variant];
    gbt_train_def def = gbt_train_def_default();
    def.eval_split = s->def.eval_split;
    def.downscale = s->def.downscale;
    def.seed = (uint64_t)seed;
    def.save_every_seconds = 0;
    def.find_exposure = false; /* the faithful protocol has none, and scores must be of the same pixels */
    def.command = "gbtrace study time";
    def.budget_seconds = v->budgets * s->def.budget_seconds;
    for (int i = 0; i < TIME_MARKS; i++)
        def.eval_at_seconds[def.eval_at_count++] = def.budget_seconds * (i + 1) / (TIME_MARKS + 1);
    return study_runs_do_variant(folder, s->def.data[scene], s->grid.names[scene], v->name, v->settings, def,
                                 out, err);
}

gbt_status lab_study_time(const lab_runs_def *def, const char *folder, FILE *out, gbt_error *err)
{
    time_study s = {.def = study_grid_def(def, 1, "auto", 0)};
    if (!(def->budget_seconds > 0 && def->budget_seconds <= 1e6))
        return base_fail(err, GBT_ERR_ARGUMENT, "--budget: %g s (wanted more than 0, up to 1e6)",
                         def->budget_seconds);
    GBT_TRY(study_grid_open(&s.grid, def->data, def->data_count, time_variant_count, s.def.seeds, err));
    return study_grid_report(&s.grid, NULL, run_one, &time_output, &s, folder, out, err);
}
