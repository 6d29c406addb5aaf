/* SPDX-License-Identifier: Apache-2.0 */
/* study/time.c -- the study "time": make its runs. */
#include "study/time.h"

#include "base/fail.h"
#include "base/memory.h"

lab_time_def lab_time_def_default(void)
{
    return (lab_time_def){.budget_seconds = 84, .downscale = 1, .seeds = 1};
}

static gbt_status run_one(const void *study, size_t scene, size_t variant, int seed, const char *folder,
                          study_figures *out, gbt_error *err)
{
    const time_study *s = study;
    const time_variant *v = &time_variants[variant];
    gbt_train_def def = gbt_train_def_default();
    def.downscale = s->def.downscale;
    def.seed = (uint64_t)seed;
    def.save_every_seconds = 0;
    def.command = "gbtrace study time";
    def.budget_seconds = v->budgets * s->def.budget_seconds;
    for (int i = 0; i < TIME_MARKS; i++)
        def.eval_at_seconds[def.eval_at_count++] = def.budget_seconds * (i + 1) / (TIME_MARKS + 1);
    return study_runs_do_variant(folder, s->def.data[scene], s->grid.names[scene], v->name, v->settings, def,
                                 out, err);
}

static gbt_status write_all(const time_study *s, const char *folder, FILE *out, gbt_error *err)
{
    study_texts texts = {.csv.err = err, .page.err = err, .charts.err = err};
    time_csv(s, &texts.csv);
    time_tables(s, &texts.page);
    time_charts(s, &texts.charts);
    GBT_TRY(study_texts_save(&texts, folder, "time", out));
    return time_json(s, folder, err);
}

static gbt_status open_study(time_study *s, const lab_time_def *def, gbt_error *err)
{
    s->def = *def;
    if (!(def->budget_seconds > 0 && def->budget_seconds <= 1e6))
        return base_fail(err, GBT_ERR_ARGUMENT, "--budget: %g s (wanted more than 0, up to 1e6)",
                         def->budget_seconds);
    return study_grid_open(&s->grid, def->data, def->data_count, time_variant_count, def->seeds, err);
}

gbt_status lab_study_time(const lab_time_def *def, const char *folder, FILE *out, gbt_error *err)
{
    time_study *s = mem_calloc(1, sizeof *s, "study", err);
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = open_study(s, def, err);
    if (status == GBT_OK)
        status = study_grid_fill(&s->grid, folder, NULL, run_one, s, err);
    if (status == GBT_OK)
        status = write_all(s, folder, out, err);
    study_grid_close(&s->grid);
    mem_free(s);
    return status;
}
