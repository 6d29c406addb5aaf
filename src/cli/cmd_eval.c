/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_eval.c -- gbtrace eval. */
#include "cli/options.h"
#include "gbtrace/evaluate.h"

static gbt_evaluate_def def;

static const option *options(int *count)
{
    def = gbt_evaluate_def_default();
    static const option rows[] = {
        RUN_OPTION("model-paths"),
        DATA_OPTION(&def.data, "data set in place of the one it was trained on"),
        JSON_OPTION(
            &def.json,
            "also write the scores to this file; with settings other than the run's, only to this file"),
        {.name = "renderer",
         .kind = OPTION_CHOICE,
         .value = &def.renderer,
         .choices = GBT_RENDERER_TRAINING_NAMES,
         .help = "renderer; default: the one it was trained with"},
        DOWNSCALE_OPTION(&def.downscale),
        PRESET_OPTION(&def.preset),
        {.name = "lpips",
         .kind = OPTION_STRING,
         .value = &def.lpips,
         .value_name = "FILE",
         .help = LPIPS_HELP},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_evaluate(given->value[0], &def, &err), &err);
}

const command command_eval = {.name = "eval",
                              .summary =
                                  "score the held-out views (PSNR, SSIM, FLIP, LPIPS) and update the report",
                              .usage = "RUN",
                              .options = options,
                              .min_operands = 1,
                              .max_operands = 1,
                              .shares_work = true,
                              .run = run,
                              .alias = "metrics"};
