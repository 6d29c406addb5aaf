/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_rows.h -- the gradients and statistics of several views as rows, and their sum into the trainer.

   A row is an anchor's: its fields that learn in their order, then, where growth gathers, its statistics. The
   gradient of the networks follows as rows with numbers from the number of anchors on. */
#ifndef GBT_TRAIN_STEP_ROWS_H
#define GBT_TRAIN_STEP_ROWS_H

#include "train/trainer.h"

/** v->rows from v->gradient and v->stats. */
gbt_status step_rows_take(const trainer *t, step_view *v, gbt_error *err);

/**
 * The sum over all views of the step (row_list_sum(), in their order, those of other processes too): its mean
 * is added to t->gradient, and the statistics to t->stats. `out` gets the traffic.
 */
gbt_status step_rows_add_up(trainer *t, step_report *out, gbt_error *err);

#endif
