/* SPDX-License-Identifier: Apache-2.0 */
/* study/grid.h -- the runs of a study, scenes x variants x seeds, and their figures. */
#ifndef GBT_STUDY_GRID_H
#define GBT_STUDY_GRID_H

#include "lab/lab.h"
#include "study/output.h"
#include "study/runs.h"

typedef struct study_grid {
    size_t scene_count, variant_count;
    int seeds; /* number of seeds, which are 0 to seeds - 1 */
    char names[STUDY_SCENES_MAX][STUDY_NAME_SIZE];
    study_figures *figures; /* [scene][variant][seed], owned; access them by study_grid_at() */
} study_grid;

/** A copy of `def` in which unset values are replaced by the study's own. */
lab_runs_def study_grid_def(const lab_runs_def *def, int seeds, const char *eval_split, uint64_t iterations);

/**
 * A grid without figures. Close it with study_grid_close(), even after a failure.
 *
 * @param data [in] paths of data sets, which are named by study_runs_names()
 * @return GBT_OK, GBT_ERR_ARGUMENT (seeds or data out of range), GBT_ERR_IO, GBT_ERR_NO_MEMORY
 */
gbt_status study_grid_open(study_grid *g, const char *const *data, size_t data_count, size_t variant_count,
                           int seeds, gbt_error *err);
void study_grid_close(study_grid *g);

static inline study_figures *study_grid_at(const study_grid *g, size_t place, size_t variant, int seed)
{
    return &g->figures[(place * g->variant_count + variant) * (size_t)g->seeds + (size_t)seed];
}

/** Adds "seed 0" or "seeds 0 to 2", and which photos are held out. */
void study_grid_add_runs(const study_grid *g, const char *eval_split, text *out);

/** A study that consists of a grid and nothing else. */
typedef struct grid_study {
    lab_runs_def def; /* strings borrowed */
    study_grid grid;
} grid_study;

/** Make one run of a study in `folder`, or reuse it if it is finished; its figures go into `out`. */
typedef gbt_status study_grid_run(const void *study, size_t scene, size_t variant, int seed,
                                  const char *folder, study_figures *out, gbt_error *err);

/**
 * Make `folder` and all runs, write the results, close the grid. The loop over seeds is outermost, so that an
 * interrupted study has complete comparisons for the first seeds. After gbt_cluster_open() all processes must
 * call this; they share the runs.
 *
 * @param wanted [in] [variant_count]; variants with false are not made, and their figures stay zero; NULL:
 * all
 * @return as the first failing `run`, or study_output_save(); GBT_ERR_IO
 */
gbt_status study_grid_report(study_grid *g, const bool *wanted, study_grid_run *run,
                             const study_output *output, const void *study, const char *folder, FILE *out,
                             gbt_error *err);

#endif
