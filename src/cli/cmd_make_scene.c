/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_make_scene.c -- gbtrace make-scene. */
#include <stdio.h>

#include "cli/options.h"
#include "gbtrace/make_scene.h"

enum { SCENES_MAX = 16 };

static const command_word *scene_words(void)
{
    static command_word words[SCENES_MAX + 1];
    const char *const *names = gbt_make_scene_names();
    for (int i = 0; names[i] != NULL && i < SCENES_MAX; i++)
        words[i] = (command_word){names[i], gbt_make_scene_summary(names[i])};
    return words;
}

static gbt_make_scene_def def;
static const char *out;

static const option *options(int *count)
{
    def = gbt_make_scene_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "DIR",
         .help = "where to write the data set",
         .required = true},
        {.name = "width",
         .kind = OPTION_INT,
         .value = &def.width,
         .min = 8,
         .max = 8192,
         .value_name = "N",
         .help = "photo width, pixels"},
        {.name = "height",
         .kind = OPTION_INT,
         .value = &def.height,
         .min = 8,
         .max = 8192,
         .value_name = "N",
         .help = "photo height, pixels"},
        {.name = "views",
         .kind = OPTION_INT,
         .value = &def.view_count,
         .field = "view_count",
         .min = 3,
         .max = 9999,
         .value_name = "N",
         .help = "number of photos"},
        {.name = "points",
         .kind = OPTION_INT,
         .value = &def.points,
         .min = 1,
         .max = 10000000,
         .value_name = "N",
         .help = "number of sparse points"},
        {.name = "point-noise",
         .kind = OPTION_DOUBLE,
         .value = &def.point_noise,
         .min = 0,
         .max = 0.1,
         .value_name = "X",
         .help = "noise of the sparse points: standard deviation, as a fraction of their distance"},
        {.name = "samples",
         .kind = OPTION_INT,
         .value = &def.samples,
         .min = 1,
         .max = 1024,
         .value_name = "N",
         .help = "maximum number of rays per pixel"},
        {.name = "seed", .kind = OPTION_UINT64, .value = &def.seed, .value_name = "S", .help = "random seed"},
        {.name = "depth", .kind = OPTION_FLAG, .value = &def.depth, .help = "also write exact depth images"},
        {.name = "gaussians",
         .kind = OPTION_INT,
         .value = &def.gaussians,
         .min = 0,
         .max = 1000000000,
         .value_name = "N",
         .help = "also write N plain Gaussians on the surfaces, gaussians.ply: for tests of large files"},
        {.name = "lens",
         .kind = OPTION_CHOICE,
         .value = &def.lens,
         .choices = GBT_MAKE_SCENE_LENS_NAMES,
         .help =
             "lens of all cameras; fisheye: 180 degrees across the shorter side; panorama: twice as wide as "
             "high; rolling: a pinhole that moves while its rows are read out"},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    def.name = given->value[0];
    gbt_error err = {0};
    const gbt_status status = gbt_make_scene(&def, out, &err);
    if (status == GBT_OK)
        printf("wrote %s\n", out);
    return command_failed(status, &err);
}

const command command_make_scene = {
    .name = "make-scene",
    .summary = "a procedural scene with known geometry, written as photos and a COLMAP model",
    .usage = "NAME -o DIR",
    .options = options,
    .min_operands = 1,
    .max_operands = 1,
    .run = run,
    .words = scene_words};
