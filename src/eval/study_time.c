/* eval/study_time.c -- the study "time": make its runs, and read curves. */
#include "eval/study_time.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"

gbt_time_def gbt_time_def_default(void)
{
    return (gbt_time_def){.budget_seconds = 84, .downscale = 1, .seeds = 1};
}

/* ---- curves ----------------------------------------------------------------------------------------------------------------------- */

stat_sample time_psnr(const time_study *s, size_t scene, size_t variant)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->def.seeds; seed++)
        values[seed] = time_run(s, scene, variant, seed)->psnr;
    return stat_of(values, (size_t)s->def.seeds);
}

stat_sample time_change(const time_study *s, size_t scene, size_t variant)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->def.seeds; seed++)
        values[seed] = time_run(s, scene, variant, seed)->psnr - time_run(s, scene, TIME_DEFAULT, seed)->psnr;
    return stat_of(values, (size_t)s->def.seeds);
}

bool time_mark(const time_study *s, size_t scene, size_t variant, size_t mark, double *seconds, double *psnr)
{
    *seconds = *psnr = 0;
    for (int seed = 0; seed < s->def.seeds; seed++) {
        const study_figures *run = time_run(s, scene, variant, seed);
        if (mark < TIME_MARKS && mark >= run->mark_count)
            return false;
        *seconds += (mark < TIME_MARKS ? run->marks[mark].seconds : run->train_seconds) / s->def.seeds;
        *psnr += (mark < TIME_MARKS ? run->marks[mark].psnr : run->psnr) / s->def.seeds;
    }
    return isfinite(*psnr);
}

double time_to_reach(const study_figures *run, double psnr)
{
    double last_seconds = NAN, last_psnr = NAN;
    for (size_t i = 0; i <= run->mark_count; i++) {
        const bool is_end = i == run->mark_count;
        const double seconds = is_end ? run->train_seconds : run->marks[i].seconds, here = is_end ? run->psnr : run->marks[i].psnr;
        if (here >= psnr) {
            const double share = i > 0 && here > last_psnr ? (psnr - last_psnr) / (here - last_psnr) : 1;
            return i > 0 && last_seconds > 0 ? last_seconds * pow(seconds / last_seconds, share) : seconds;
        }
        last_seconds = seconds, last_psnr = here;
    }
    return NAN;
}

stat_sample time_saved(const time_study *s, size_t scene)
{
    double values[STUDY_SEEDS_MAX];
    for (int seed = 0; seed < s->def.seeds; seed++) {
        values[seed] = time_to_reach(time_run(s, scene, TIME_DEFAULT, seed), time_run(s, scene, TIME_FAITHFUL, seed)->psnr);
        if (!isfinite(values[seed]))
            return stat_of(NULL, 0); /* a mean without the slow ones would flatter */
    }
    return stat_of(values, (size_t)s->def.seeds);
}

/* ---- runs ------------------------------------------------------------------------------------------------------------------------- */

static gbt_status run_one(const time_study *s, size_t scene, size_t variant, int seed, const char *folder, study_figures *out, gbt_error *err)
{
    const time_variant *v = &time_variants[variant];
    gbt_train_def def = gbt_train_def_default();
    def.downscale = s->def.downscale, def.seed = (uint64_t)seed, def.save_every_seconds = 0, def.command = "gbtrace study time";
    def.budget_seconds = v->budgets * s->def.budget_seconds;
    for (int i = 0; i < TIME_MARKS; i++)
        def.eval_at_seconds[def.eval_at_count++] = def.budget_seconds * (i + 1) / (TIME_MARKS + 1);
    return study_runs_do_variant(folder, s->def.data[scene], s->names[scene], v->name, v->settings, def, out, err);
}

static gbt_status run_all(time_study *s, const char *folder, gbt_error *err)
{
    size_t done = 0;
    for (int seed = 0; seed < s->def.seeds; seed++)
        for (size_t scene = 0; scene < s->def.data_count; scene++)
            for (size_t v = 0; v < time_variant_count; v++) {
                study_runs_tell(++done, (size_t)s->def.seeds * s->def.data_count * time_variant_count);
                GBT_TRY(run_one(s, scene, v, seed, folder, (study_figures *)time_run(s, scene, v, seed), err));
            }
    return GBT_OK;
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

static gbt_status check_def(const gbt_time_def *def, gbt_error *err)
{
    if (def->seeds < 1 || def->seeds > STUDY_SEEDS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "--seeds: %d (wanted 1 to %d)", def->seeds, (int)STUDY_SEEDS_MAX);
    if (!(def->budget_seconds > 0 && def->budget_seconds <= 1e6))
        return base_fail(err, GBT_ERR_ARGUMENT, "--budget: %g s (wanted more than 0, up to 1e6)", def->budget_seconds);
    return GBT_OK;
}

gbt_status gbt_study_time(const gbt_time_def *def, const char *folder, FILE *out, gbt_error *err)
{
    GBT_TRY(check_def(def, err));
    time_study *s = mem_calloc(1, sizeof *s, "study", err);
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    s->def = *def;
    gbt_status status = study_runs_names(def->data, def->data_count, s->names, err);
    if (status == GBT_OK)
        s->figures = mem_calloc(def->data_count * time_variant_count * (size_t)def->seeds, sizeof *s->figures, "figures of runs", err);
    if (status == GBT_OK && s->figures == NULL)
        status = GBT_ERR_NO_MEMORY;
    if (status == GBT_OK)
        status = file_make_folder(folder, err);
    if (status == GBT_OK)
        status = run_all(s, folder, err);
    if (status == GBT_OK)
        status = write_all(s, folder, out, err);
    mem_free(s->figures);
    mem_free(s);
    return status;
}
