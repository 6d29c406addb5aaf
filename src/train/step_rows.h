/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_rows.h -- the gradients and statistics of several views as sparse rows, and their sum into the
   trainer.

   A row belongs to an anchor: the gradients of its trainable fields in order, then, while growth gathers, its
   statistics. Row numbers from the number of anchors on hold the gradient of the networks. */
#ifndef GBT_TRAIN_STEP_ROWS_H
#define GBT_TRAIN_STEP_ROWS_H

#include "train/trainer.h"

/** Make v->rows from v->gradient and v->stats. */
gbt_status step_rows_take(const trainer *t, step_view *v, gbt_error *err);

/**
 * Sum the rows of all views of the step, also of other processes (row_list_sum(), in the order of views). The
 * mean gradient is added to t->gradient, and the summed statistics to t->stats. The traffic is reported in
 * `out`.
 */
gbt_status step_rows_add_up(trainer *t, step_report *out, gbt_error *err);

#endif
