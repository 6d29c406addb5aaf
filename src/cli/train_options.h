/* SPDX-License-Identifier: Apache-2.0 */
/* cli/train_options.h -- the options of a training run. */
#ifndef GBT_CLI_TRAIN_OPTIONS_H
#define GBT_CLI_TRAIN_OPTIONS_H

#include "cli/options.h"
#include "gbtrace/train.h"

/** Fill `out` with a row per setting of the library, whose place is in `def`, and rows for options of other
    programs. Returns the number of rows. */
int train_options(gbt_train_def *def, option *out);

/** The row of one setting, by name, with its place at `value`, for use in another command. Not for flags. */
option train_option(const char *name, void *value);

/** After parsing: set evaluation times ("1m,2m" or NULL), and the command line, which the report shows. */
gbt_status train_options_finish(gbt_train_def *def, const char *eval_at, const operands *given,
                                gbt_error *err);

#endif
