/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_view.c -- gbtrace view. */
#include <stdio.h>

#include "cli/options.h"
#include "cli/progress.h"
#include "gbtrace/view.h"

static void print_address(const char *url, void *context)
{
    (void)context;
    puts(url);
    fflush(stdout);
    progress_say("open this in a browser; Ctrl-C ends");
}

static gbt_view_def def;

static const option *options(int *count)
{
    def = gbt_view_def_default();
    def.ready = print_address;
    static const option rows[] = {
        RUN_OPTION(NULL),
        {.name = "port",
         .short_name = 'p',
         .kind = OPTION_INT,
         .value = &def.port,
         .min = 0,
         .max = 65535,
         .value_name = "N",
         .help = "0: any free one"},
        {.name = "host",
         .kind = OPTION_STRING,
         .value = &def.host,
         .value_name = "ADDRESS",
         .help = "IPv4 address of this machine to listen at; 0.0.0.0: all of them; with any but 127.0.0.1, "
                 "browsers need the token that is printed"},
        DATA_OPTION(&def.data, "photos of another data set"),
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_view(given->value[0], &def, &err), &err);
}

const command command_view = {.name = "view",
                              .summary =
                                  "view a scene in the browser beside its photos, also during training",
                              .usage = "RUN|MODEL.gbt|GAUSSIANS",
                              .options = options,
                              .min_operands = 1,
                              .max_operands = 1,
                              .run = run};
