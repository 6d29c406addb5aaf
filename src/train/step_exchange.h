/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_exchange.h -- a step's views on several processes: what they came to, and the sum of their rows.
 */
#ifndef GBT_TRAIN_STEP_EXCHANGE_H
#define GBT_TRAIN_STEP_EXCHANGE_H

#include "train/trainer.h"

/** t->outcomes of all views of the step, from those that each process has rendered. */
void step_exchange_outcomes(trainer *t);

/**
 * t->rows of all views from those of this process's: an equal share of the numbers goes to each process,
 * which adds up what it gets in the order of the tree, and tells everybody.
 *
 * @param mine    [in] the sum of this process's views; not t->rows
 * @param numbers [in] all numbers of rows are below
 */
gbt_status step_exchange_rows(trainer *t, const row_list *mine, size_t numbers, gbt_error *err);

#endif
