/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_info.c -- gbtrace info. */
#include "cli/options.h"
#include "gbtrace/info.h"

static bool json;

static const option *options(int *count)
{
    static const option rows[] = {
        {.name = "json", .kind = OPTION_FLAG, .value = &json, .help = "print JSON"},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_info(given->value[0], json, stdout, &err), &err);
}

const command command_info = {.name = "info",
                              .summary = "show what a data set or a model contains",
                              .usage = "PATH",
                              .options = options,
                              .min_operands = 1,
                              .max_operands = 1,
                              .run = run};
