/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_split.h -- a split by a list of names is the run's own, whatever becomes of the list it was told
   of: RUN/held-out.txt. */
#ifndef GBT_TRAIN_RUN_SPLIT_H
#define GBT_TRAIN_RUN_SPLIT_H

#include "data/scene.h"

#define RUN_SPLIT_NAME "held-out.txt"

enum { RUN_SPLIT_TEXT_SIZE = 8192 };

/** `text`, a gbt_train_def.eval_split, with the run's own list in place of the one that it names; unchanged
    where it names none, or where the run has none. */
gbt_status run_split_text(const char *run, const char *text, char out[RUN_SPLIT_TEXT_SIZE], gbt_error *err);

/** Keep the list that split the scene; without one nothing is done. */
gbt_status run_split_save(const char *run, const scene *s, gbt_error *err);

#endif
