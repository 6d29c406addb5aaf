/* SPDX-License-Identifier: Apache-2.0 */
/* study/grid.c -- make all runs of a study: scenes x variants x seeds. */
#include "study/grid.h"

#include <math.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "cluster/cluster.h"

lab_runs_def lab_runs_def_default(void)
{
    return (lab_runs_def){
        .downscale = 1, .budget_seconds = 84, .renderer = GBT_RENDERER_RASTER, .tables = "1,2,3,4"};
}

lab_runs_def study_grid_def(const lab_runs_def *def, int seeds, const char *eval_split, uint64_t iterations)
{
    lab_runs_def whole = *def;
    whole.seeds = def->seeds == 0 ? seeds : def->seeds;
    whole.eval_split = def->eval_split == NULL ? eval_split : def->eval_split;
    whole.iterations = def->iterations == 0 ? iterations : def->iterations;
    return whole;
}

gbt_status study_grid_open(study_grid *g, const char *const *data, size_t data_count, size_t variant_count,
                           int seeds, gbt_error *err)
{
    *g = (study_grid){.scene_count = data_count, .variant_count = variant_count, .seeds = seeds};
    if (seeds < 1 || seeds > STUDY_SEEDS_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "--seeds: %d (wanted 1 to %d)", seeds, (int)STUDY_SEEDS_MAX);
    GBT_TRY(study_runs_names(data, data_count, g->names, err));
    g->figures =
        mem_calloc(data_count * variant_count * (size_t)seeds, sizeof *g->figures, "figures of runs", err);
    return g->figures != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

void study_grid_close(study_grid *g)
{
    mem_free(g->figures);
    g->figures = NULL;
}

void study_grid_add_runs(const study_grid *g, const char *eval_split, text *out)
{
    if (g->seeds == 1)
        text_add(out, "seed 0");
    else
        text_format(out, "seeds 0 to %d", g->seeds - 1);
    text_format(out, ", held-out photos: %s.\n", eval_split);
}

/* Report that run `number` of `count` begins; numbers start at 1. */
static void tell(size_t number, size_t count)
{
    char line[64];
    gbt_event e = {.text = line,
                   .stage = "study",
                   .done = number - 1,
                   .total = count,
                   .fraction = (double)(number - 1) / (double)count};
    e.seconds = e.seconds_left = e.psnr = e.loss = (double)NAN;
    snprintf(line, sizeof line, "run %zu of %zu", number, count);
    log_progress(&e);
}

/* Make every `step`-th run, starting with `first`. */
static gbt_status fill(study_grid *g, const bool *wanted, study_grid_run *run, const void *study,
                       const char *folder, size_t first, size_t step, gbt_error *err)
{
    size_t variants = 0, index = 0;
    for (size_t v = 0; v < g->variant_count; v++)
        variants += wanted == NULL || wanted[v];
    GBT_TRY(file_make_folder(folder, err));
    for (int seed = 0; seed < g->seeds; seed++)
        for (size_t scene = 0; scene < g->scene_count; scene++)
            for (size_t v = 0; v < g->variant_count; v++) {
                if ((wanted != NULL && !wanted[v]) || index++ % step != first)
                    continue;
                tell(index, variants * g->scene_count * (size_t)g->seeds);
                GBT_TRY(run(study, scene, v, seed, folder, study_grid_at(g, scene, v, seed), err));
            }
    return GBT_OK;
}

/* Several processes first make their shares of the runs independently; then the first process goes through
   all runs and finds them finished. */
gbt_status study_grid_report(study_grid *g, const bool *wanted, study_grid_run *run,
                             const study_output *output, const void *study, const char *folder, FILE *out,
                             gbt_error *err)
{
    const size_t size = (size_t)gbt_cluster_size(), rank = (size_t)gbt_cluster_rank();
    gbt_status status = GBT_OK;
    cluster_stand_alone(true);
    if (size > 1)
        status = fill(g, wanted, run, study, folder, rank, size, err);
    cluster_stand_alone(false);
    status = cluster_agree(status, err);
    if (status == GBT_OK && rank == 0) {
        cluster_stand_alone(true);
        status = fill(g, wanted, run, study, folder, 0, 1, err);
        if (status == GBT_OK)
            status = study_output_save(output, study, folder, out, err);
        cluster_stand_alone(false);
    }
    study_grid_close(g);
    return cluster_follow(status, err);
}
