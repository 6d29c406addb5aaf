/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_init.c -- gbtrace init. */
#include "cli/options.h"
#include "gbtrace/init.h"

static gbt_init_def def;
static const char *out, *json;

static const option *options(int *count)
{
    def = gbt_init_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "FILE.ply",
         .help = "where to write balls and anchors",
         .required = true},
        {.name = "init",
         .kind = OPTION_CHOICE,
         .value = &def.init,
         .choices = GBT_INIT_NAMES,
         .help = "initial anchors: the paper's granular balls, adaptive granular balls, the voxel baseline, "
                 "or random points"},
        {.name = "init-count",
         .kind = OPTION_DOUBLE,
         .value = &def.init_count,
         .min = 0,
         .max = 1,
         .value_name = "F",
         .help = "adaptive and random: anchors per sparse point; 0: half as many anchors as gb gives",
         .rare = true},
        {.name = "scale-prior",
         .kind = OPTION_CHOICE,
         .value = &def.scale_prior,
         .choices = GBT_SCALE_PRIOR_NAMES,
         .help = "initial scale with --init gb: from ball radius and point spacing, or from spacing alone, "
                 "as with the other --init"},
        {.name = "max-depth",
         .kind = OPTION_INT,
         .value = &def.max_depth,
         .min = 0,
         .max = 64,
         .value_name = "D",
         .help = "maximum depth of the ball tree",
         .rare = true},
        {.name = "voxel-size",
         .kind = OPTION_FLOAT,
         .value = &def.voxel_size,
         .min = 0,
         .max = 1e30,
         .value_name = "V",
         .help = "voxel size, scene units; 0: estimated from the points",
         .rare = true},
        {.name = "voxel-rule",
         .kind = OPTION_CHOICE,
         .value = &def.voxel_rule,
         .choices = GBT_VOXEL_RULE_NAMES,
         .help = "how it is estimated: median point spacing, or the squared spacing that the reference code "
                 "uses",
         .rare = true},
        {.name = "mesh",
         .kind = OPTION_FLAG,
         .value = &def.mesh,
         .help = "write each ball as a sphere mesh instead of a point"},
        JSON_OPTION(&json, "write the counts to this file"),
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    return command_failed(gbt_init(given->value[0], &def, out, json, stdout, &err), &err);
}

const command command_init = {
    .name = "init",
    .summary = "compute granular balls and anchors of a data set, and compare them with the voxel baseline",
    .usage = "DATA -o FILE.ply",
    .options = options,
    .min_operands = 1,
    .max_operands = 1,
    .run = run};
