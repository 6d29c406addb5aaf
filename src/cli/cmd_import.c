/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_import.c -- gbtrace import. */
#include "cli/options.h"
#include "gbtrace/import.h"

static int run(const command *self, int argc, char **argv)
{
    gbt_import_def def = gbt_import_def_default();
    const char *out = NULL;
    const option options[] = {
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
         .choices = "trace|raster|per-ray",
         .help = "renderer of the run"},
    };
    operands model;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 1, 1, argc, argv, &model);
    if (code >= 0)
        return code;
    gbt_error err = {0};
    return command_failed(gbt_import(model.value[0], &def, out, stdout, &err), &err);
}

const command command_import = {.name = "import",
                                .summary = "import a trained Scaffold-GS model as a run",
                                .usage = "FOLDER|point_cloud.ply -o RUN",
                                .run = run};
