/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_train.c -- gbtrace train. */
#include "cli/finish_run.h"
#include "cli/options.h"
#include "cli/train_options.h"

static int run(const command *self, int argc, char **argv)
{
    train_options t;
    train_options_init(&t);
    const char *output = NULL;
    bool lossless = false;
    const option own[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &output,
         .value_name = "RUN",
         .help = "folder for the model, scores and report",
         .aliases = "m model-path",
         .required = true},
        {.name = "source-path",
         .short_name = 's',
         .kind = OPTION_OPERAND,
         .value_name = "DATA",
         .help = "the same as DATA",
         .aliases = "data"},
        {.name = "lossless",
         .kind = OPTION_FLAG,
         .value = &lossless,
         .help = "store the model without loss (see compress); the file is about seven times larger"},
    };
    option options[OPTIONS_MAX];
    const int count = train_options_table(&t, own, sizeof own / sizeof *own, options);
    operands data;
    const int code = options_parse(self, options, count, 0, 1, argc, argv, &data);
    if (code >= 0)
        return code;
    if (data.count == 0 && !t.def.resume)
        return command_misused("argument missing (usage: gbtrace %s %s)", self->name, self->usage);
    gbt_error err = {0};
    gbt_status status = train_options_finish(&t, "gbtrace train", argc, argv, &err);
    if (status == GBT_OK)
        status = gbt_train(data.count > 0 ? data.value[0] : NULL, output, &t.def, &err);
    if (status == GBT_OK)
        status = finish_run(output, lossless, t.def.tensorboard, &err);
    if (status == GBT_OK)
        finish_run_say(output);
    return command_failed(status, &err);
}

const command command_train = {.name = "train",
                               .summary = "train on posed photos, score the held-out ones, write a report",
                               .usage = "DATA -o RUN",
                               .run = run};
