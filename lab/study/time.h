/* SPDX-License-Identifier: Apache-2.0 */
/* study/time.h -- what the study "time" trains, what came out, and how it is written down. */
#ifndef GBT_STUDY_TIME_H
#define GBT_STUDY_TIME_H

#include "lab/lab.h"
#include "study/grid.h"
#include "study/runs_stat.h"

enum {
    TIME_VARIANTS_MAX = 16,
    TIME_DEFAULT = 0,
    TIME_FAITHFUL = 1,
    TIME_MARKS = 9 /* in passing, at tenths of a run's budget */
};

typedef struct time_variant {
    const char *name;     /* in tables; of its folder, what is no letter or digit as '-' */
    const char *settings; /* what differs from the default: lines as in a run's `config` */
    double budgets;       /* how many it is given */
} time_variant;

/** The first is the default, the second the faithful protocol. */
extern const time_variant time_variants[];
extern const size_t time_variant_count;

/** Held-out PSNR at the end over the seeds; and its change from the default's of the same seed. */
stat_sample time_psnr(const grid_study *s, size_t scene, size_t variant);
stat_sample time_change(const grid_study *s, size_t scene, size_t variant);

/**
 * Mark `mark` of a curve over the seeds; mark TIME_MARKS is the end. False when a run has no such mark (a
 * step may pass several at once).
 */
bool time_mark(const grid_study *s, size_t scene, size_t variant, size_t mark, double *seconds, double *psnr);

/**
 * When a run first shows `psnr` or more: straight between its marks and its end, over log seconds; NaN when
 * it never does, or there is no score. Before the first mark nothing is known: a run that is there already is
 * said to reach it at that mark.
 */
double time_to_reach(const study_figures *run, double psnr);

/** Seconds of the default to what the faithful protocol has in the end, by seed; NaN when a seed does not
    come there. */
stat_sample time_saved(const grid_study *s, size_t scene);

/** How it is written down. */
extern const study_output time_output;

#endif
