/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_info.c -- gbtrace info. */
#include "cli/options.h"
#include "gbtrace/info.h"

static int run(const command *self, int argc, char **argv)
{
    bool json = false;
    const option options[] = {
        {.name = "json", .kind = OPTION_FLAG, .value = &json, .help = "print JSON"},
    };
    operands paths;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 1, 1, argc, argv, &paths);
    if (code >= 0)
        return code;
    gbt_error err = {0};
    return command_failed(gbt_info(paths.value[0], json, stdout, &err), &err);
}

const command command_info = {
    .name = "info", .summary = "show what a data set or a model contains", .usage = "PATH", .run = run};
