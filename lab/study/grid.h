/* SPDX-License-Identifier: Apache-2.0 */
/* study/grid.h -- scenes x variants x seeds: the runs that a study makes, and what they said. */
#ifndef GBT_STUDY_GRID_H
#define GBT_STUDY_GRID_H

#include "lab/lab.h"
#include "study/output.h"
#include "study/runs.h"

typedef struct study_grid {
    size_t scene_count, variant_count;
    int seeds; /* 0 to seeds - 1 */
    char names[STUDY_SCENES_MAX][STUDY_NAME_SIZE];
    study_figures *figures; /* [scene][variant][seed], owned; read them by study_grid_at() */
} study_grid;

/** `def` with a study's own values where it has none. */
lab_runs_def study_grid_def(const lab_runs_def *def, int seeds, const char *eval_split, uint64_t iterations);

/**
 * A grid without figures. Close it with study_grid_close(), also after a failure.
 *
 * @param data [in] paths of data sets; their names are taken (study_runs_names())
 * @return GBT_OK, GBT_ERR_ARGUMENT (seeds or data out of range), GBT_ERR_IO, GBT_ERR_NO_MEMORY
 */
gbt_status study_grid_open(study_grid *g, const char *const *data, size_t data_count, size_t variant_count,
                           int seeds, gbt_error *err);
void study_grid_close(study_grid *g);

static inline study_figures *study_grid_at(const study_grid *g, size_t place, size_t variant, int seed)
{
    return &g->figures[(place * g->variant_count + variant) * (size_t)g->seeds + (size_t)seed];
}

/** All of a study that is its grid alone. */
typedef struct grid_study {
    lab_runs_def def; /* strings borrowed */
    study_grid grid;
} grid_study;

/** Make one run of a study in `folder`, or take it from there: its figures into `out`. */
typedef gbt_status study_grid_run(const void *study, size_t scene, size_t variant, int seed,
                                  const char *folder, study_figures *out, gbt_error *err);

/**
 * Make `folder` and all runs, save what came out, close the grid. Seeds are outermost: an interrupted study
 * has whole comparisons of the first seeds. After gbt_cluster_open() all processes call this, and share the
 * runs.
 *
 * @param wanted [in] [variant_count], false: not made, its figures stay zero; NULL: all
 * @return as `run`, which fails first, and study_output_save(); GBT_ERR_IO
 */
gbt_status study_grid_report(study_grid *g, const bool *wanted, study_grid_run *run,
                             const study_output *output, const void *study, const char *folder, FILE *out,
                             gbt_error *err);

#endif
