/* SPDX-License-Identifier: Apache-2.0 */
/* train/save.h -- save a run, during training and at its end: checkpoint, model, exposures, poses. */
#ifndef GBT_TRAIN_SAVE_H
#define GBT_TRAIN_SAVE_H

#include "base/background.h"
#include "train/trainer.h"

enum { RUN_PATH_SIZE = 4096 };

typedef struct run_paths {
    char model[RUN_PATH_SIZE], config[RUN_PATH_SIZE], log[RUN_PATH_SIZE], events[RUN_PATH_SIZE],
        json[RUN_PATH_SIZE], exposure[RUN_PATH_SIZE], poses[RUN_PATH_SIZE], checkpoint[RUN_PATH_SIZE],
        checkpoint_previous[RUN_PATH_SIZE];
} run_paths;

/** Write all files; after a failure, whose cause may be temporary, warn and write them once more. Returns the
    second failure. */
gbt_status save_surely(trainer *t, const run_paths *paths, gbt_error *err);

/** A background save: writes a copy of all changing state while steps go on. Start from {0}. */
typedef struct save_in_background {
    background_job job;
    trainer copy;
    void *memory; /* memory of the copy; NULL: no save is in progress */
    const run_paths *paths;
    gbt_status status;
    gbt_error error;
} save_in_background;

/**
 * Begin a background save; `paths` are borrowed until save_finish(). Without memory for the copy, the save is
 * complete when this returns. No other save may be in progress: call save_finish() first.
 */
gbt_status save_begin(save_in_background *s, trainer *t, const run_paths *paths, gbt_error *err);

/** Still being written? */
bool save_is_under_way(save_in_background *s);

/** Wait for the save and return its result; GBT_OK when none is in progress. */
gbt_status save_finish(save_in_background *s, gbt_error *err);

#endif
