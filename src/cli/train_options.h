/* SPDX-License-Identifier: Apache-2.0 */
/* cli/train_options.h -- the options of a training run, shared by train and demo. */
#ifndef GBT_CLI_TRAIN_OPTIONS_H
#define GBT_CLI_TRAIN_OPTIONS_H

#include "cli/options.h"
#include "gbtrace/train.h"

typedef struct train_options {
    gbt_train_def def;
    int threads;         /* 0: all */
    const char *eval_at; /* "1m,2m" or NULL */
    char command[2048];
} train_options;

void train_options_init(train_options *t);

/** `own` rows first, then the shared ones, into `out` [OPTIONS_MAX]; returns how many. */
int train_options_table(train_options *t, const option *own, int own_count, option *out);

/** After parsing: threads, evaluation times, the command line for the report. */
gbt_status train_options_finish(train_options *t, const char *command_name, int argc, char **argv,
                                gbt_error *err);

#endif
