/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_compress.c -- gbtrace compress. */
#include "cli/options.h"
#include "gbtrace/compress.h"
#include "gbtrace/train.h"

static int run(const command *self, int argc, char **argv)
{
    gbt_compress_def def = gbt_compress_def_default();
    const char *out = NULL;
    bool lossless = false;
    int threads = 0;
    const option options[] = {
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
        {.name = "lossless", .kind = OPTION_FLAG, .value = &lossless, .help = "store the model without loss"},
        {.name = "data",
         .kind = OPTION_STRING,
         .value = &def.data,
         .value_name = "DATA",
         .help = "use the cameras of this data set instead of the one it was trained on",
         .aliases = "s source-path"},
        {.name = "json",
         .kind = OPTION_STRING,
         .value = &def.json,
         .value_name = "FILE",
         .help = "write the figures to this file"},
        {.name = "threads",
         .kind = OPTION_INT,
         .value = &threads,
         .min = 0,
         .max = 1024,
         .value_name = "T",
         .help = THREADS_HELP},
    };
    operands model;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 1, 1, argc, argv, &model);
    if (code >= 0)
        return code;
    if (threads > 0)
        gbt_set_threads(threads);
    def.lossless = lossless;
    gbt_error err = {0};
    return command_failed(gbt_compress(model.value[0], &def, out, stdout, &err), &err);
}

const command command_compress = {.name = "compress",
                                  .summary =
                                      "write a trained model as a small file, which every command can read",
                                  .usage = "RUN|MODEL.gbt -o FILE.gbt",
                                  .run = run};
