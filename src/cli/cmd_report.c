/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_report.c -- gbtrace report. */
#include "cli/options.h"
#include "gbtrace/evaluate.h"

static int run(const command *self, int argc, char **argv)
{
    operands given;
    const int code = options_parse(self, NULL, 0, 1, OPTIONS_MAX_OPERANDS, argc, argv, &given);
    if (code >= 0)
        return code;
    gbt_error err = {0};
    return command_failed(gbt_report(given.value[0], given.value + 1, (size_t)given.count - 1, &err), &err);
}

const command command_report = {.name = "report",
                                .summary = "write the report of a run again, with the charts of studies",
                                .usage = "RUN [STUDY...]",
                                .run = run};
