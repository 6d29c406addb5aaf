/* SPDX-License-Identifier: Apache-2.0 */
/* cli/finish_run.h -- what follows training, for every command that trains. */
#ifndef GBT_CLI_FINISH_RUN_H
#define GBT_CLI_FINISH_RUN_H

#include <stdbool.h>

#include "gbtrace/status.h"

/**
 * Make RUN/model.gbt small, unless the run is lossless; then score the held-out views with what it gives
 * back, and write the report; with `tensorboard`, scores and pictures for it too.
 */
gbt_status finish_run(const char *run, bool tensorboard, gbt_error *err);

/** Say on stdout where the report is and what shows the scene, to a person (progress_for_people()). */
void finish_run_say(const char *run);

#endif
