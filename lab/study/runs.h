/* SPDX-License-Identifier: Apache-2.0 */
/* study/runs.h -- the training runs of a study: made, or taken from an earlier call; their figures read
   back. */
#ifndef GBT_STUDY_RUNS_H
#define GBT_STUDY_RUNS_H

#include <stdio.h>

#include "gbtrace/train.h"
#include "report/text.h"

enum {
    STUDY_SCENES_MAX = 16,
    STUDY_SEEDS_MAX = 10,
    STUDY_NAME_SIZE = 256,
    STUDY_MARKS_MAX = GBT_TRAIN_MAX_EVALS
};

/** What a run says about itself. From metrics.json: scores are NaN without held-out views. */
typedef struct study_figures {
    double psnr, ssim;
    double lpips_01; /* NaN when it was scored without a network */
    double points, anchors_initial, anchors_final, model_bytes, iterations, train_seconds;
    size_t mark_count;
    struct {
        double seconds, psnr;
    } marks[STUDY_MARKS_MAX]; /* held-out PSNR in passing */
    /* Measured here on the held-out views, means; NaN without them. */
    double anchors_in_view;
    double blended_per_ray; /* hits that a ray blends; by rays, whatever trained the model */
    /* Of the model. */
    double macs_per_anchor; /* multiply-adds of the networks for one anchor in view */
    double network_bytes;   /* weights and biases, float32 */
} study_figures;

/** FOLDER/runs/SCENE/VARIANT/seed-S, where everything in a name but letters, digits, '.' and '_' becomes
    '-'. */
gbt_status study_runs_folder(const char *folder, const char *data_name, const char *variant, uint64_t seed,
                             char *out, size_t size, gbt_error *err);

/**
 * What data sets are called: the last parts of their paths.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT (count out of range, two of one name), GBT_ERR_IO (no such path)
 */
gbt_status study_runs_names(const char *const *data, size_t count, char names[][STUDY_NAME_SIZE],
                            gbt_error *err);

/**
 * Train and score `def` on `data` in the folder `run`, unless it holds that already.
 *
 * Finished is a run whose study.json, written last, is whole and tells the same settings, and whose
 * metrics.json is whole.
 *
 * @param lpips [in] optional (NULL): file of a network; a finished run that has no LPIPS yet is scored again,
 *                   not trained
 * @return as gbt_train() and gbt_evaluate(); what was found of another run is lost only when this one starts
 */
gbt_status study_runs_do(const char *data, const char *run, const gbt_train_def *def, const char *lpips,
                         study_figures *out, gbt_error *err);

/**
 * study_runs_do() of a variant: what `settings`, lines as in a run's `config`, change in `def`, in the
 * variant's folder.
 *
 * @param variant [in] its name, in messages and as folder (study_runs_folder())
 */
gbt_status study_runs_do_variant(const char *folder, const char *data, const char *data_name,
                                 const char *variant, const char *settings, gbt_train_def def,
                                 study_figures *out, gbt_error *err);

#endif
