/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_compress.c -- gbtrace compress. */
#include "cli/options.h"
#include "gbtrace/compress.h"

static gbt_compress_def def;
static const char *out;

static const option *options(int *count)
{
    def = gbt_compress_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "FILE.gbt",
         .help = "where to write the small model",
         .required = true},
        {.name = "quality",
         .short_name = 'q',
         .kind = OPTION_DOUBLE,
         .value = &def.quality,
         .min = 20,
         .max = 90,
         .value_name = "DB",
         .help = "PSNR between renders of the small and of the original model; higher makes a larger file"},
        {.name = "lossless",
         .kind = OPTION_FLAG,
         .value = &def.lossless,
         .help = "store the model without loss"},
        DATA_OPTION(&def.data, "use the cameras of this data set instead of the one it was trained on"),
        JSON_OPTION(&def.json, "write the sizes and times to this file"),
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_compress(given->value[0], &def, out, stdout, &err), &err);
}

const command command_compress = {.name = "compress",
                                  .summary =
                                      "write a trained model as a small file, which every command can read",
                                  .usage = "RUN|MODEL.gbt -o FILE.gbt",
                                  .options = options,
                                  .min_operands = 1,
                                  .max_operands = 1,
                                  .shares_work = true,
                                  .run = run};
