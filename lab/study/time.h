/* SPDX-License-Identifier: Apache-2.0 */
/* study/time.h -- the study "time": its variants, statistics and output. */
#ifndef GBT_STUDY_TIME_H
#define GBT_STUDY_TIME_H

#include "study/grid.h"
#include "study/runs_stat.h"

enum {
    TIME_VARIANTS_MAX = 16,
    TIME_DEFAULT = 0,
    TIME_FAITHFUL = 1,
    TIME_MARKS = 9 /* intermediate scores, at tenths of a run's budget */
};

typedef struct time_variant {
    const char *name; /* in tables, and of its folder, where characters other than letters and digits become
                         '-' */
    const char *settings; /* differences from the default settings: lines as in a run's `config` */
    double budgets;       /* training time in units of the study's budget */
} time_variant;

/** The first is the default, the second the faithful protocol. */
extern const time_variant time_variants[];
extern const size_t time_variant_count;

/** Held-out PSNR at the end, over the seeds; and its change relative to the default variant at the same seed.
 */
stat_sample time_psnr(const grid_study *s, size_t scene, size_t variant);
stat_sample time_change(const grid_study *s, size_t scene, size_t variant);

/**
 * Point `mark` of a variant's curve, mean over the seeds; TIME_MARKS is the end of the run. False if a run
 * lacks this point, since one step may pass several.
 */
bool time_mark(const grid_study *s, size_t scene, size_t variant, size_t mark, double *seconds, double *psnr);

/**
 * The training time at which a run first has a PSNR of `psnr` or more: interpolated between its marks and its
 * end, linearly over log seconds. NaN if it never does, or has no score. Nothing is known before the first
 * mark: a run that is there already gets the time of that mark.
 */
double time_to_reach(const study_figures *run, double psnr);

/** For each seed, the time after which the default variant has the final PSNR of the faithful protocol. NaN
    if it does not reach it for one of the seeds. */
stat_sample time_to_match(const grid_study *s, size_t scene);

/** The files that the study writes. */
extern const study_output time_output;

#endif
