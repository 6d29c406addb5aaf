/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_init.c -- gbtrace init. */
#include <string.h>

#include "cli/options.h"
#include "cli/train_options.h"
#include "gbtrace/init.h"

static gbt_init_def def;
static const char *out, *json;

static const option *options(int *count)
{
    def = gbt_init_def_default();
    const option all[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "FILE.ply",
         .help = "where to write balls and anchors",
         .required = true},
        train_option("init", &def.init),
        train_option("init-count", &def.init_count),
        train_option("scale-prior", &def.scale_prior),
        train_option("max-depth", &def.max_depth),
        train_option("voxel-size", &def.voxel_size),
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
    static option rows[sizeof all / sizeof *all];
    memcpy(rows, all, sizeof all);
    *count = sizeof all / sizeof *all;
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
