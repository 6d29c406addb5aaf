/* cli/cmd_export.c -- gbtrace export. */
#include "cli/options.h"
#include "gbtrace/export.h"
#include "gbtrace/train.h"

static int run(const command *self, int argc, char **argv)
{
    gbt_export_def def = gbt_export_def_default();
    int threads = 0;
    const char *output = NULL;
    const option options[] = {
        {.name = "output", .short_name = 'o', .kind = OPTION_STRING, .value = &output, .value_name = "FILE",
         .help = "the same as one more OUT"},
        {.name = "sh-degree", .kind = OPTION_INT, .value = &def.sh_degree, .min = 0, .max = 3, .value_name = "N",
         .help = "how colours depend on the direction: spherical harmonics up to this"},
        {.name = "refine", .kind = OPTION_INT, .value = &def.refine_steps, .min = 0, .max = 100000, .value_name = "N",
         .help = "steps that fit the Gaussians to the model's own pictures"},
        {.name = "no-backdrop", .kind = OPTION_FLAG_OFF, .value = &def.backdrop,
         .help = "leave out the sphere of Gaussians that is the model's background; viewers then draw black there"},
        {.name = "data", .kind = OPTION_STRING, .value = &def.data, .value_name = "DATA",
         .help = "data set in place of the one it was trained on", .aliases = "s source-path"},
        {.name = "json", .kind = OPTION_STRING, .value = &def.json, .value_name = "FILE", .help = "write the figures there"},
        {.name = "lpips", .kind = OPTION_STRING, .value = &def.lpips, .value_name = "FILE", .help = "result folder: " LPIPS_HELP},
        {.name = "threads", .kind = OPTION_INT, .value = &threads, .min = 0, .max = 1024, .value_name = "T",
         .help = "0: all processors, at most the container's share"},
    };
    operands files;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 1, 9, argc, argv, &files);
    if (code >= 0)
        return code;
    if (output != NULL)
        files.value[files.count++] = output;
    if (files.count < 2)
        return command_misused("argument missing (usage: gbtrace %s %s)", self->name, self->usage);
    if (threads > 0)
        gbt_set_threads(threads);
    gbt_error err = {0};
    return command_failed(gbt_export(files.value[0], &def, files.value + 1, (size_t)files.count - 1, stdout, &err), &err);
}

const command command_export = {.name = "export",
                                .summary = "a scene as .ply, .splat, .spz or .glb, for other programs' viewers; or one of these as another",
                                .usage = "RUN|MODEL.gbt|SCENE.ply|.splat|.spz OUT.ply|.splat|.spz|.glb...", .run = run};
