/* SPDX-License-Identifier: Apache-2.0 */
/* study/runs.h -- the training runs of a study: make them, or reuse them from an earlier call; read their
   figures back. */
#ifndef GBT_STUDY_RUNS_H
#define GBT_STUDY_RUNS_H

#include <stdio.h>

#include "gbtrace/train.h"

enum {
    STUDY_SCENES_MAX = 16,
    STUDY_SEEDS_MAX = 10,
    STUDY_NAME_SIZE = 256,
    STUDY_MARKS_MAX = GBT_TRAIN_MAX_EVALS
};

/** The figures of a run. Read from metrics.json; scores are NaN without held-out views. */
typedef struct study_figures {
    double psnr, ssim;
    double lpips_01; /* NaN when it was scored without a network */
    double points, anchors_initial, anchors_final, model_bytes, iterations, train_seconds;
    size_t mark_count;
    struct {
        double seconds, psnr;
    } marks[STUDY_MARKS_MAX]; /* intermediate held-out PSNR */
    /* Measured here: means over the held-out views, NaN without any. */
    double anchors_in_view;
    double blended_per_ray; /* Gaussians blended per ray, always by the tracer */
    /* Properties of the model. */
    double macs_per_anchor; /* multiply-adds of the networks for one anchor in view */
    double network_bytes;   /* weights and biases, float32 */
} study_figures;

/** FOLDER/runs/SCENE/VARIANT/seed-S. In names, everything but letters, digits, '.' and '_' becomes '-'. */
gbt_status study_runs_folder(const char *folder, const char *data_name, const char *variant, uint64_t seed,
                             char *out, size_t size, gbt_error *err);

/**
 * The names of data sets: the last components of their paths.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT (count out of range, two equal names), GBT_ERR_IO (no such path)
 */
gbt_status study_runs_names(const char *const *data, size_t count, char names[][STUDY_NAME_SIZE],
                            gbt_error *err);

/**
 * Train `def` on `data` in the folder `run` and score it, unless that run is already finished there.
 *
 * A run is finished if its study.json, which is written last, is complete and records the same settings, and
 * its metrics.json is complete.
 *
 * @param lpips [in] optional (NULL): file of a network. A finished run without LPIPS is scored again, but not
 *                   trained again
 * @return as gbt_train() and gbt_evaluate(). A run with other settings in the folder is overwritten only when
 *         training starts
 */
gbt_status study_runs_do(const char *data, const char *run, const gbt_train_def *def, const char *lpips,
                         study_figures *out, gbt_error *err);

/**
 * study_runs_do() for a variant in its own folder. `settings`, lines as in a run's `config`, override `def`.
 *
 * @param variant [in] its name, for messages and the folder (study_runs_folder())
 */
gbt_status study_runs_do_variant(const char *folder, const char *data, const char *data_name,
                                 const char *variant, const char *settings, gbt_train_def def,
                                 study_figures *out, gbt_error *err);

#endif
