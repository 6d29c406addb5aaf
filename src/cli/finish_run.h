/* SPDX-License-Identifier: Apache-2.0 */
/* cli/finish_run.h -- what follows training, for every command that trains. */
#ifndef GBT_CLI_FINISH_RUN_H
#define GBT_CLI_FINISH_RUN_H

#include <stdbool.h>

#include "gbtrace/status.h"

/**
 * Compress RUN/model.gbt, unless the run is lossless. Then score the held-out views with the compressed model
 * and write the report; with `tensorboard`, write scores and pictures for TensorBoard too.
 */
gbt_status finish_run(const char *run, bool tensorboard, gbt_error *err);

/** Print where the report is and how to view the scene, unless no person reads it (progress_for_people()). */
void finish_run_say(const char *run);

#endif
