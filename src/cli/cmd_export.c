/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_export.c -- gbtrace export. */
#include <stdio.h>

#include "cli/options.h"
#include "gbtrace/export.h"

static gbt_export_def def;
static const char *output;

static const option *options(int *count)
{
    def = gbt_export_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &output,
         .value_name = "FILE",
         .help = "another output file"},
        {.name = "sh-degree",
         .kind = OPTION_INT,
         .value = &def.sh_degree,
         .min = 0,
         .max = 3,
         .value_name = "N",
         .help = "degree of the spherical harmonics of the colours"},
        {.name = "refine",
         .kind = OPTION_INT,
         .value = &def.refine_steps,
         .field = "refine_steps",
         .min = 0,
         .max = 100000,
         .value_name = "N",
         .help = "steps that fit the Gaussians to the model's own pictures"},
        {.name = "gaussians",
         .kind = OPTION_INT,
         .value = &def.gaussians,
         .min = 0,
         .max = 1000000000,
         .value_name = "N",
         .help = "keep the N Gaussians that contribute most to the training views; 0: all"},
        {.name = "no-backdrop",
         .kind = OPTION_FLAG_OFF,
         .value = &def.backdrop,
         .field = "backdrop",
         .help = "leave out the sphere of Gaussians that is the model's background; viewers then draw black "
                 "there"},
        DATA_OPTION(&def.data, "use the cameras of this data set instead of the one it was trained on"),
        JSON_OPTION(&def.json, "write the figures to this file"),
        {.name = "lpips",
         .kind = OPTION_STRING,
         .value = &def.lpips,
         .value_name = "FILE",
         .help = "result folder: " LPIPS_HELP},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    operands files = *given;
    if (output != NULL)
        files.value[files.count++] = output;
    if (files.count < 2)
        return command_misused("argument missing (usage: gbtrace %s %s)", command_export.name,
                               command_export.usage);
    gbt_error err = {0};
    return command_failed(
        gbt_export(files.value[0], &def, files.value + 1, (size_t)files.count - 1, stdout, &err), &err);
}

static const command_word *format_words(void)
{
    enum { FORMATS_MAX = 16 };
    static command_word words[FORMATS_MAX + 1];
    for (int i = 0; i < gbt_export_format_count() && i < FORMATS_MAX; i++)
        words[i] = (command_word){gbt_export_format_at(i).ending, gbt_export_format_at(i).what};
    return words;
}

const command command_export = {
    .name = "export",
    .summary = "export a scene as plain Gaussians for other programs, or convert plain Gaussians",
    .usage = "RUN|MODEL.gbt|GAUSSIANS OUT...",
    .options = options,
    .min_operands = 1,
    .max_operands = 17, /* the input, and the 16 outputs that gbt_export() takes */
    .run = run,
    .endings = format_words};
