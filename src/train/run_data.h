/* SPDX-License-Identifier: Apache-2.0 */
/* train/run_data.h -- where the data set of a run is, from whatever folder the run is opened and wherever
   both were moved together. */
#ifndef GBT_TRAIN_RUN_DATA_H
#define GBT_TRAIN_RUN_DATA_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

enum { RUN_DATA_PATH_SIZE = 4096 };

typedef struct run_data {
    char folder[RUN_DATA_PATH_SIZE];    /* of the run */
    char place[RUN_DATA_PATH_SIZE];     /* where it is; empty: at none of the places */
    char tried[3 * RUN_DATA_PATH_SIZE]; /* the places, "A, B, C" */
    bool moved;                         /* found by its place relative to the run */
} run_data;

/** Write RUN/data_places: `data` as it was named, its absolute path, its path relative to the folder `run`, a
    line each. */
gbt_status run_data_save(const char *run, const char *data, gbt_error *err);

/**
 * Look for the data set that a model names, in the order absolute, relative to the run, as named.
 *
 * @param run   [in] folder of the run, or its model file; one without data_places, or of other data, has the
 *                   place as named alone
 * @param named [in] as the model names it
 */
void run_data_find(const char *run, const char *named, run_data *out);

#endif
