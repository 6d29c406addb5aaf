/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_log.h -- the records of a run: progress events, log.csv, TensorBoard events, train.json. */
#ifndef GBT_TRAIN_RUN_LOG_H
#define GBT_TRAIN_RUN_LOG_H

#include <stdio.h>

#include "train/event_records.h"
#include "train/trainer.h"

/** The stages of a step in their order: X(name in train.json, its time in the report `r`). */
#define RUN_STAGE_LIST(X)                                                                                    \
    X(photo, r->photo)                                                                                       \
    X(rays, r->times.rays)                                                                                   \
    X(visible, r->times.visible)                                                                             \
    X(decode, r->times.decode)                                                                               \
    X(build, r->times.build)                                                                                 \
    X(trace, r->times.trace)                                                                                 \
    X(loss, r->compare)                                                                                      \
    X(adjoint, r->times.adjoint)                                                                             \
    X(decode_adjoint, r->times.decode_adjoint)                                                               \
    X(optimizer, r->optimizer)                                                                               \
    X(adjust, r->adjust)                                                                                     \
    X(all, r->all)

enum {
#define X(name, time) RUN_STAGE_##name,
    RUN_STAGE_LIST(X)
#undef X
        RUN_STAGES
};

/* Sums since the last row of log.csv. */
typedef struct run_sums {
    uint64_t steps, compared; /* compared: steps that have a loss, l1, ssim and psnr */
    double loss, l1, ssim, psnr, gaussians, visible, rays, hits, blended;
    stage_time stage[RUN_STAGES];
    double wait, exchange, exchange_bytes;
} run_sums;

typedef struct run_log {
    FILE *csv;
    run_sums row, all;
    FILE *events; /* NULL: none */
    event_records records;
    step_report last;
    double last_row_seconds;
    double psnr_smooth, loss; /* running mean of the PSNR, and the last loss; NaN before the first */
    double evaluated_seconds[GBT_TRAIN_MAX_EVALS], evaluated_psnr[GBT_TRAIN_MAX_EVALS];
    uint64_t evaluated_step[GBT_TRAIN_MAX_EVALS];
    int evaluated_count;
} run_log;

/** Open log.csv, and the event file if t->def.tensorboard (continued after --resume), and report what the run
    starts from. */
gbt_status run_log_open(run_log *log, const trainer *t, const char *csv_path, const char *events_path,
                        gbt_error *err);
void run_log_step(run_log *log, const trainer *t, const step_report *report);
void run_log_evaluation(run_log *log, const trainer *t, double psnr); /* NaN (no held-out photo): records
                                                                         nothing */

/** train.json: counts, seconds by stage, pace, machine. */
gbt_status run_log_summary(run_log *log, const trainer *t, const char *json_path, gbt_error *err);

/** Whether train.json exists and was written after `step` steps. */
bool run_log_is_of_step(const char *json_path, uint64_t step);

void run_log_close(run_log *log);

#endif
