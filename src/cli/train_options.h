/* SPDX-License-Identifier: Apache-2.0 */
/* cli/train_options.h -- the options of a training run. */
#ifndef GBT_CLI_TRAIN_OPTIONS_H
#define GBT_CLI_TRAIN_OPTIONS_H

#include "cli/options.h"
#include "gbtrace/train.h"

/** A row per setting of the library, whose place is in `def`, and rows that tell what to use; returns how
 * many. */
int train_options(gbt_train_def *def, option *out);

/** The row of one setting, by its name, for another command, where its place is `value`. Not of a flag. */
option train_option(const char *name, void *value);

/** After parsing: evaluation times ("1m,2m" or NULL), and the command line for the report. */
gbt_status train_options_finish(gbt_train_def *def, const char *eval_at, const operands *given,
                                gbt_error *err);

#endif
