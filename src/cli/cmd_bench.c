/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_bench.c -- gbtrace bench trace and gbtrace check-grad. */
#include <stdio.h>

#include "cli/options.h"
#include "lab/lab.h"

static const command_word *workloads(void)
{
    static const command_word words[] = {{"trace", "forward and backward pass of the ray tracer"},
                                         {NULL, NULL}};
    return words;
}

static lab_bench_def def;

static const option *options_bench(int *count)
{
    def = lab_bench_def_default();
    static const option rows[] = {
        {.name = "model",
         .kind = OPTION_STRING,
         .value = &def.model,
         .value_name = "FILE|RUN",
         .help = "plain Gaussians (gbtrace export --help lists their formats), or a trained run"},
        {.name = "camera",
         .kind = OPTION_STRING,
         .value = &def.camera,
         .value_name = "FILE.json",
         .help = "a camera file (docs/cameras.md); needed for plain Gaussians; default: the run's first "
                 "held-out view"},
        {.name = "alpha-min",
         .kind = OPTION_FLOAT,
         .value = &def.alpha_min,
         .min = 0,
         .max = 0.999,
         .value_name = "A",
         .help = "ignore hits with an alpha below this; 0: as the run, else 1/255",
         .rare = true},
        {.name = "alpha-max",
         .kind = OPTION_FLOAT,
         .value = &def.alpha_max,
         .min = 0,
         .max = 0.999999,
         .value_name = "A",
         .help = "clamp alpha to this; 0: as the run, else 0.99",
         .rare = true},
        {.name = "t-min",
         .kind = OPTION_FLOAT,
         .value = &def.t_min,
         .min = 0,
         .max = 0.999,
         .value_name = "T",
         .help = "stop a ray below this transmittance; 0: as the run, else 1e-4",
         .rare = true},
        {.name = "preset",
         .kind = OPTION_CHOICE,
         .value = &def.preset,
         .choices = GBT_PRESET_NAMES,
         .help = "cut-off preset (docs/accuracy.md); --alpha-min and --t-min override it"},
        {.name = "kernel",
         .kind = OPTION_STRING,
         .value = &def.kernel,
         .value_name = "LIST",
         .choices = "list|packet|tree|single|embree|splats",
         .list = true,
         .help =
             "list, packet (lists, with one order for 16 rays), tree, single, embree or splats; list,tree "
             "measures both alternately and compares them"},
        {.name = "repeats",
         .kind = OPTION_INT,
         .value = &def.repeats,
         .min = 1,
         .max = 1000,
         .value_name = "N",
         .help = "timed passes; the median is reported"},
        {.name = "check",
         .kind = OPTION_FLAG,
         .value = &def.check,
         .help = "compare with the double-precision reference, with the same cut-offs and without any"},
        {.name = "json",
         .kind = OPTION_STRING,
         .value = &def.json,
         .value_name = "FILE",
         .help = "write the figures to this file"},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run_bench(const operands *given)
{
    gbt_error err = {0};
    (void)given; /* one word, already checked by options_parse() */
    if (def.model == NULL)
        return command_misused("bench trace: --model is missing (wanted --model FILE|RUN)");
    return command_failed(lab_bench_trace(&def, stdout, &err), &err);
}

const command command_bench = {.name = "bench",
                               .summary = "benchmark the ray tracer on given Gaussians",
                               .usage = "trace --model FILE|RUN [--camera FILE.json]",
                               .options = options_bench,
                               .min_operands = 1,
                               .max_operands = 1,
                               .run = run_bench,
                               .words = workloads};

static int run_check_grad(const operands *given)
{
    gbt_error err = {0};
    return command_failed(lab_check_grad(given->value[0], stdout, &err), &err);
}

const command command_check_grad = {
    .name = "check-grad",
    .summary = "check the gradients of a trained run against double precision and finite differences",
    .usage = "RUN",
    .min_operands = 1,
    .max_operands = 1,
    .run = run_check_grad};
