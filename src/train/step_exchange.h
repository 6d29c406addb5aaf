/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_exchange.h -- exchange between processes that share the views of a step: outcomes of views, and
   the sum of their gradient rows (a reduce-scatter followed by an all-gather). */
#ifndef GBT_TRAIN_STEP_EXCHANGE_H
#define GBT_TRAIN_STEP_EXCHANGE_H

#include "train/trainer.h"

/** Complete t->outcomes, the outcomes of all views of the step: each process contributes those of the views
    that it rendered. */
void step_exchange_outcomes(trainer *t);

/**
 * Make t->rows, the sum over all views, from each process's own sum. Each process owns an equal share of the
 * row numbers, sums the rows that it receives in the order of the tree, and sends the sums to all.
 *
 * @param mine    [in] the sum of this process's views; not t->rows
 * @param numbers [in] upper bound of all row numbers
 */
gbt_status step_exchange_rows(trainer *t, const row_list *mine, size_t numbers, gbt_error *err);

#endif
