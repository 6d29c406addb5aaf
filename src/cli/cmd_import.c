/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_import.c -- gbtrace import. */
#include "cli/options.h"
#include "gbtrace/import.h"

static gbt_import_def def;
static const char *out;

static const option *options(int *count)
{
    def = gbt_import_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "RUN",
         .help = "folder for the model",
         .required = true},
        {.name = "data",
         .kind = OPTION_STRING,
         .value = &def.data,
         .value_name = "DATA",
         .help = "data set to render and score it on; default: the one named in its cfg_args"},
        {.name = "renderer",
         .kind = OPTION_CHOICE,
         .value = &def.renderer,
         .choices = GBT_RENDERER_TRAINING_NAMES,
         .help = "renderer of the run"},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_import(given->value[0], &def, out, stdout, &err), &err);
}

const command command_import = {.name = "import",
                                .summary = "import a trained Scaffold-GS model as a run",
                                .usage = "FOLDER|point_cloud.ply -o RUN",
                                .options = options,
                                .min_operands = 1,
                                .max_operands = 1,
                                .run = run};
