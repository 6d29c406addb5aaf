/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_data.h -- find the data set of a run, from any current folder, also after run and data set were
   moved together. */
#ifndef GBT_TRAIN_RUN_DATA_H
#define GBT_TRAIN_RUN_DATA_H

#include <stdbool.h>

#include "gbtrace/status.h"

#define RUN_DATA_NAME "data_places"

enum { RUN_DATA_PATH_SIZE = 4096 };

typedef struct run_data {
    char folder[RUN_DATA_PATH_SIZE];    /* of the run */
    char place[RUN_DATA_PATH_SIZE];     /* where the data set is; empty: not found */
    char tried[3 * RUN_DATA_PATH_SIZE]; /* the places that were searched, "A, B, C" */
    bool moved;                         /* found by its place relative to the run */
} run_data;

/** Write RUN/data_places, three lines: `data` as given, its absolute path, and its path relative to the
    folder `run`. */
gbt_status run_data_save(const char *run, const char *data, gbt_error *err);

/**
 * Look for the data set that a model names, in this order: the absolute path, the path relative to the run,
 * the path as given.
 *
 * @param run   [in] folder of the run, or its model file; without data_places, or if that describes other
 *                   data, only the path as given is tried
 * @param named [in] path in the model
 */
void run_data_find(const char *run, const char *named, run_data *out);

#endif
