/* SPDX-License-Identifier: Apache-2.0 */
/* train/save.h -- what a run leaves while it goes on and at its end: checkpoint, model, exposures, poses. */
#ifndef GBT_TRAIN_SAVE_H
#define GBT_TRAIN_SAVE_H

#include "base/beside.h"
#include "train/trainer.h"

enum { RUN_PATH_SIZE = 4096 };

typedef struct run_paths {
    char model[RUN_PATH_SIZE], config[RUN_PATH_SIZE], log[RUN_PATH_SIZE], events[RUN_PATH_SIZE],
        json[RUN_PATH_SIZE], exposure[RUN_PATH_SIZE], poses[RUN_PATH_SIZE], checkpoint[RUN_PATH_SIZE],
        checkpoint_previous[RUN_PATH_SIZE];
} run_paths;

/** Write all of them. The model also where the checkpoint, which is 20 times as large, cannot be written;
    exposures and poses only beside a model of the same step. The first failure. */
gbt_status save_all(trainer *t, const run_paths *paths, gbt_error *err);

/** The same, and once more, with a warning, where it fails: the reason may be gone. The second failure. */
gbt_status save_surely(trainer *t, const run_paths *paths, gbt_error *err);

/** A save that is written while steps go on: of a copy of all that changes. Start from {0}. */
typedef struct save_beside {
    beside job;
    trainer copy;
    void *memory; /* of the copy; NULL: nothing is being written */
    const run_paths *paths;
    gbt_status status;
    gbt_error error;
} save_beside;

/**
 * Begin one; `paths` are borrowed until save_finish(). Without memory for the copy it is done when this
 * returns. None may be under way: save_finish() first.
 */
gbt_status save_begin(save_beside *s, trainer *t, const run_paths *paths, gbt_error *err);

/** Still being written? */
bool save_is_under_way(save_beside *s);

/** Wait for it; what writing came to. GBT_OK when there is none. */
gbt_status save_finish(save_beside *s, gbt_error *err);

#endif
