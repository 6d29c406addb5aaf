/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_report.c -- gbtrace report. */
#include "cli/options.h"
#include "gbtrace/evaluate.h"

static const option *options(int *count)
{
    static const option rows[] = {MEMORY_OPTION};
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_report(given->value[0], given->value + 1, (size_t)given->count - 1, &err),
                          &err);
}

const command command_report = {.name = "report",
                                .summary = "write the report of a run again, with the charts of studies",
                                .usage = "RUN [STUDY...]",
                                .options = options,
                                .min_operands = 1,
                                .max_operands = OPTIONS_MAX_OPERANDS,
                                .run = run};
