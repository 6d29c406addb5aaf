/* SPDX-License-Identifier: Apache-2.0 */
/* train/schedule.h -- where a run stands (progress in [0, 1)) and what follows from it: learning rates,
   growth, anchors left out.

   Everything is a fraction of the run, so a short run is a whole run. A run is cut into PACE_SEGMENTS equal
   parts; the pace says how many iterations each part has. With a fixed number of iterations they are equal;
   with a time budget each part is given its number when it starts, from the speed measured so far, and the
   numbers are recorded: with them anyone repeats the run to the bit. */
#ifndef GBT_TRAIN_SCHEDULE_H
#define GBT_TRAIN_SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

#include "gbtrace/status.h"

enum { PACE_SEGMENTS = 20 };

typedef struct pace {
    uint64_t steps[PACE_SEGMENTS]; /* iterations of each part, >= 0 */
    int known; /* parts decided so far; PACE_SEGMENTS from the start unless the time budget decides */
} pace;

/** Equal parts that sum to `iterations` (parts may be empty for fewer than PACE_SEGMENTS iterations). */
pace pace_of_iterations(uint64_t iterations);

/** "n1,...,n20", or as train.json has it: "[n1, ..., n20]"; GBT_ERR_ARGUMENT otherwise. */
gbt_status pace_parse(const char *text, pace *out, gbt_error *err);

/** The text that pace_parse() reads, of a pace whose parts are all known. */
enum { PACE_TEXT_SIZE = PACE_SEGMENTS * 21 + 1 };
void pace_text(const pace *p, char out[PACE_TEXT_SIZE]);

uint64_t pace_total(const pace *p); /* of the known parts */

/** Progress in front of step number `step` (0-based), which lies in a known part; 1 at or after the end. */
double pace_progress(const pace *p, uint64_t step);

/**
 * How long the whole run will be, in steps, if the parts up to that of `step` (known) are like the rest: what
 * comes later has no say, as with a budget.
 */
double pace_expected(const pace *p, uint64_t step);

/** The part that `step` lies in, or p->known when the known parts are used up. */
int pace_segment(const pace *p, uint64_t step);

/**
 * How much an anchor must bring, (0, 1]: what growth and pruning ask of it is multiplied by this.
 *
 * A long run has the steps to teach more anchors: 1 up to 1000 views, then falling with their square root,
 * down to 0.25 (docs/training.md).
 *
 * @param views that the steps of the whole run look at: pace_expected() times the views of a step
 */
float schedule_threshold_factor(double views);

/**
 * Where the learning rates that a short run keeps (features, scales) end in a long one, as a part of where
 * they begin: 1 up to 4000 views, then falling with their square root, down to 0.1.
 *
 * @param views as schedule_threshold_factor() has them
 */
double schedule_rate_end(double views);

/**
 * The part of the anchors in view that each step until SCHEDULE_EXACT_FROM leaves out at random: 0 up to 100
 * `looks` at each photo, then 1 - (100 / looks)^0.3: 0.28 at 300, 0.5 at 1,000. Looks are those of the whole
 * run, as far as its length is known (pace_expected()).
 *
 * What looks at its photos so often fits them better than it fits the scene. Anchors that cannot count on
 * each other come to stand where all photos want them (docs/training.md).
 */
float schedule_left_out(double looks);

/** From here on the cut-offs and the order of rendering. Before, SCHEDULE_ALPHA_MIN and SCHEDULE_T_MIN, which
    leave half as many hits per ray, and trace_settings.packet_order. */
#define SCHEDULE_EXACT_FROM 0.925
#define SCHEDULE_ALPHA_MIN 0.02f
#define SCHEDULE_T_MIN 0.003f

/** From then on half of the views that steps look at have a random background (rules.opaque_from). Before,
   while anchors grow, a surface may let it through, which costs fewer Gaussians and fewer hits. */
#define SCHEDULE_OPAQUE_FROM 0.5

/**
 * In the last part of a run all rates fall: a step teaches a model of one photo at a time, and what it takes
 * from the others comes to rest.
 */
#define SCHEDULE_COOL_FROM 0.9

/** Statistics are gathered, and anchors grow and are pruned, from these parts of the training on. */
#define SCHEDULE_STATS_FROM (500.0 / 30000)
#define SCHEDULE_ADJUST_FROM (1500.0 / 30000)
/** With --refine-poses, until then the poses settle on the anchors as they start: none moves, grows or is
    pruned. */
#define SCHEDULE_POSES_SETTLED 0.1
/** Until then anchors grow at sparse points too: the start left most of them out. */
#define SCHEDULE_POINTS_UNTIL 0.15

#endif
