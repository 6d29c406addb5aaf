/* eval/study_anchors.c -- the study "anchors": its variants, and making their runs. */
#include "eval/study_anchors.h"

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"

/* THE table to edit. The first two have their places. A new meaning needs a new name: the name is the folder of the runs. */
const anchors_variant anchors_variants[] = {
    {"voxels", "init = voxel"},
    {"the paper's balls", ""},
    {"adaptive balls", "init = adaptive"},
    {"random points", "init = random"},
    {"adaptive balls, thrift 1.5", "init = adaptive\nthrift = 1.5"},
    {"adaptive balls, thrift 2.5", "init = adaptive\nthrift = 2.5"},
    {"adaptive balls, thrift 0.5", "init = adaptive\nthrift = 0.5"},
};

const size_t anchors_variant_count = sizeof anchors_variants / sizeof *anchors_variants;

_Static_assert(sizeof anchors_variants / sizeof *anchors_variants <= ANCHORS_VARIANTS_MAX, "every variant has a place");

gbt_anchors_def gbt_anchors_def_default(void)
{
    return (gbt_anchors_def){.iterations = 1000, .downscale = 1, .seeds = 3};
}

static gbt_status run_one(const anchors_study *s, size_t scene, size_t variant, int seed, const char *folder, study_figures *out, gbt_error *err)
{
    const anchors_variant *v = &anchors_variants[variant];
    gbt_train_def def = gbt_train_def_default();
    def.iterations = s->def.iterations, def.downscale = s->def.downscale, def.seed = (uint64_t)seed;
    def.save_every_seconds = 0, def.command = "gbtrace study anchors";
    return study_runs_do_variant(folder, s->def.data[scene], s->names[scene], v->name, v->settings, def, out, err);
}

static gbt_status run_all(anchors_study *s, const char *folder, gbt_error *err)
{
    size_t done = 0;
    for (int seed = 0; seed < s->def.seeds; seed++)
        for (size_t scene = 0; scene < s->def.data_count; scene++)
            for (size_t v = 0; v < anchors_variant_count; v++) {
                study_runs_tell(++done, (size_t)s->def.seeds * s->def.data_count * anchors_variant_count);
                GBT_TRY(run_one(s, scene, v, seed, folder, (study_figures *)anchors_run(s, scene, v, seed), err));
            }
    return GBT_OK;
}

static gbt_status write_all(const anchors_study *s, const char *folder, FILE *out, gbt_error *err)
{
    study_texts texts = {.csv.err = err, .page.err = err, .charts.err = err};
    anchors_csv(s, &texts.csv);
    anchors_tables(s, &texts.page);
    anchors_charts(s, &texts.charts);
    GBT_TRY(study_texts_save(&texts, folder, "anchors", out));
    return anchors_json(s, folder, err);
}

static gbt_status open_study(anchors_study *s, const gbt_anchors_def *def, gbt_error *err)
{
    s->def = *def;
    if (def->seeds < 1 || def->seeds > STUDY_SEEDS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "--seeds: %d (wanted 1 to %d)", def->seeds, (int)STUDY_SEEDS_MAX);
    if (def->iterations < 20)
        return base_fail(err, GBT_ERR_ARGUMENT, "--iterations: %llu (wanted at least 20)", (unsigned long long)def->iterations);
    GBT_TRY(study_runs_names(def->data, def->data_count, s->names, err));
    s->figures = mem_calloc(def->data_count * anchors_variant_count * (size_t)def->seeds, sizeof *s->figures, "figures of runs", err);
    return s->figures != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

gbt_status gbt_study_anchors(const gbt_anchors_def *def, const char *folder, FILE *out, gbt_error *err)
{
    anchors_study *s = mem_calloc(1, sizeof *s, "study", err);
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = open_study(s, def, err);
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
