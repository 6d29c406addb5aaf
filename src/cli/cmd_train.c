/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_train.c -- gbtrace train. */
#include <string.h>

#include "cli/finish_run.h"
#include "cli/options.h"
#include "cli/train_options.h"

static gbt_train_def def;
static const char *output, *eval_at;

static const option own_rows[] = {
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
     .aliases = "data",
     .rare = true},
    {.name = "eval",
     .kind = OPTION_STRING,
     .value = &def.eval_split,
     .fixed = "auto",
     .help = "hold out as the data set says, else every eighth photo (the default)",
     .rare = true},
    {.name = "eval-at",
     .kind = OPTION_STRING,
     .value = &eval_at,
     .value_name = "T1,T2",
     .help = "measure held-out PSNR after these training times, such as 1m,2m; not counted as training time",
     .rare = true},
};

static const option *options(int *count)
{
    static option rows[OPTIONS_MAX];
    def = gbt_train_def_default();
    memcpy(rows, own_rows, sizeof own_rows);
    *count = sizeof own_rows / sizeof *own_rows;
    *count += train_options(&def, rows + *count);
    return rows;
}

static int run(const operands *given)
{
    if (given->count == 0 && !def.resume)
        return command_misused("argument missing (usage: gbtrace %s %s)", command_train.name,
                               command_train.usage);
    const bool by_count = options_typed(&def.iterations), by_time = options_typed(&def.budget_seconds);
    if (by_count && by_time && def.iterations > 0 && def.budget_seconds > 0)
        return command_misused("--budget: cannot be combined with --iterations");
    /* A length of training set in a configuration file or variable is meant for runs in general: it does not
     * apply to a resumed run, and a length on the command line replaces it. */
    if ((def.resume || by_time) && !by_count)
        def.iterations = 0;
    if (def.resume && !by_time)
        def.budget_seconds = 0;
    if ((by_count || by_time) && !options_typed(&def.pace))
        def.pace = NULL;
    gbt_error err = {0};
    gbt_status status = train_options_finish(&def, eval_at, given, &err);
    if (status == GBT_OK)
        status = gbt_train(given->count > 0 ? given->value[0] : NULL, output, &def, &err);
    if (status == GBT_OK)
        status = gbt_set_memory(def.memory, output, &err);
    if (status == GBT_OK)
        status = finish_run(output, def.tensorboard, &err);
    if (status == GBT_OK)
        status = options_memory_kept(def.memory, &err);
    if (status == GBT_OK)
        finish_run_say(output);
    return command_failed(status, &err);
}

const command command_train = {.name = "train",
                               .summary = "train on posed photos, score the held-out ones, write a report",
                               .usage = "DATA -o RUN",
                               .options = options,
                               .max_operands = 1,
                               .shares_work = true,
                               .run = run};
