/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_split.h -- RUN/held-out.txt, the run's own copy of a list of held-out photos, so that the split
   does not depend on what happens to the original list. */
#ifndef GBT_TRAIN_RUN_SPLIT_H
#define GBT_TRAIN_RUN_SPLIT_H

#include "data/scene.h"

#define RUN_SPLIT_NAME "held-out.txt"

enum { RUN_SPLIT_TEXT_SIZE = 8192 };

/** `text`, a gbt_train_def.eval_split, with its list replaced by the run's own; unchanged when it names no
    list, or when the run has none. */
gbt_status run_split_text(const char *run, const char *text, char out[RUN_SPLIT_TEXT_SIZE], gbt_error *err);

/** Save the list that split the scene; does nothing without a list. */
gbt_status run_split_save(const char *run, const scene *s, gbt_error *err);

#endif
