/* SPDX-License-Identifier: Apache-2.0 */
/* train/schedule.h -- the progress of a run, in [0, 1), and the schedules that depend on it: learning rates,
   growth, anchors left out.

   All schedules are functions of progress, so a short run passes through the same phases as a long one. A run
   is divided into PACE_SEGMENTS parts of equal progress; the pace is the number of iterations of each part.
   With a fixed number of iterations the parts are equal. With a time budget the number of each part is
   decided when it starts, from the speed measured so far, and recorded: with the recorded pace the run can be
   repeated bit for bit. */
#ifndef GBT_TRAIN_SCHEDULE_H
#define GBT_TRAIN_SCHEDULE_H

#include <stdint.h>

#include "gbtrace/status.h"

enum { PACE_SEGMENTS = 20 };

typedef struct pace {
    uint64_t steps[PACE_SEGMENTS]; /* iterations of each part, >= 0 */
    int known; /* parts decided so far; PACE_SEGMENTS from the start unless the time budget decides */
} pace;

/** Equal parts that sum to `iterations` (parts may be empty for fewer than PACE_SEGMENTS iterations). */
pace pace_of_iterations(uint64_t iterations);

/** Parse "n1,...,n20", or the form in train.json, "[n1, ..., n20]"; GBT_ERR_ARGUMENT otherwise. */
gbt_status pace_parse(const char *text, pace *out, gbt_error *err);

/** Text of a pace whose parts are all known, as pace_parse() reads it. */
enum { PACE_TEXT_SIZE = PACE_SEGMENTS * 21 + 1 };
void pace_text(const pace *p, char out[PACE_TEXT_SIZE]);

uint64_t pace_total(const pace *p); /* of the known parts */

/** Progress before step number `step` (0-based), which lies in a known part; 1 at or after the end. */
double pace_progress(const pace *p, uint64_t step);

/**
 * Expected length of the whole run, in steps, extrapolated from the parts up to the (known) part of `step`.
 * Later parts are ignored even if known, so that repeating a budget run by its pace gives the same values.
 */
double pace_expected(const pace *p, uint64_t step);

/** The part that `step` lies in, or p->known when the known parts are used up. */
int pace_segment(const pace *p, uint64_t step);

/**
 * Factor in (0, 1] of the thresholds of growth and pruning.
 *
 * A longer run can train more anchors, so thresholds fall: 1 up to 1000 views, then proportional to 1 /
 * sqrt(views), at least 0.25 (docs/training.md).
 *
 * @param views of the whole run: pace_expected() times the views per step
 */
float schedule_threshold_factor(double views);

/**
 * Final value, relative to the initial one, of the learning rates that are constant in a short run (features,
 * scales): 1 up to 4000 views, then proportional to 1 / sqrt(views), at least 0.1.
 *
 * @param views as in schedule_threshold_factor()
 */
double schedule_rate_end(double views);

/**
 * Share of the anchors in view that each step until SCHEDULE_EXACT_FROM leaves out at random: 0 up to 100
 * `looks` (uses of each pixel in the whole run, by pace_expected()), then 1 - (100 / looks)^0.3: 0.28 at 300,
 * 0.5 at 1,000.
 *
 * This is dropout against overfitting: a run that uses its pixels so often would fit the photos better than
 * the scene. Anchors that cannot rely on each other move to where all photos want them (docs/training.md).
 */
float schedule_left_out(double looks);

/** Progress from which the cut-offs and the blending order are those of final renders. Before it,
    SCHEDULE_ALPHA_MIN and SCHEDULE_T_MIN, which halve the hits per ray, and trace_settings.packet_order
    apply. */
#define SCHEDULE_EXACT_FROM 0.925
#define SCHEDULE_ALPHA_MIN 0.02f
#define SCHEDULE_T_MIN 0.003f

/** Progress from which half of the views have a random background (rules.opaque_from). Before it, while
    anchors grow, surfaces may stay partly transparent to the background, which needs fewer Gaussians and
    fewer hits. */
#define SCHEDULE_OPAQUE_FROM 0.5

/**
 * Progress from which all learning rates fall towards 0: each step fits one photo at the expense of the
 * others, and these fluctuations die out as rates fall.
 */
#define SCHEDULE_COOL_FROM 0.9

/** With --refine-poses, progress until which only poses are wanted (rules.begins_at). */
#define SCHEDULE_POSES_SETTLED 0.1
/** Counted from rules.begins_at: progress from which growth statistics are gathered, and from which anchors
    grow and are pruned. */
#define SCHEDULE_STATS_FROM (500.0 / 30000)
#define SCHEDULE_ADJUST_FROM (1500.0 / 30000)
/** Likewise, until which sparse points are growth candidates, too: the start leaves most of them out. */
#define SCHEDULE_POINTS_UNTIL 0.15

#endif
