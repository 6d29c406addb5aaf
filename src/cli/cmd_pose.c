/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_pose.c -- gbtrace pose. */
#include <stdio.h>

#include "cli/options.h"
#include "gbtrace/pose.h"
#include "gbtrace/progress.h"

static gbt_pose_def def;
static const char *out;

static const option *options(int *count)
{
    def = gbt_pose_def_default();
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "DATA",
         .help = "folder for the data set; after an interruption, the same command continues",
         .required = true},
        {.name = "frames",
         .kind = OPTION_INT,
         .value = &def.frames,
         .min = 0,
         .max = 2000,
         .value_name = "N",
         .help = "frames to take from a video; 0: three per second, but 60 to 200"},
        {.name = "camera-model",
         .kind = OPTION_CHOICE,
         .value = &def.camera_model,
         .choices = GBT_POSE_CAMERA_NAMES,
         .help = "the lens; auto: OPENCV for 20 photos or more of one camera, else SIMPLE_RADIAL"},
        {.name = "matcher",
         .kind = OPTION_CHOICE,
         .value = &def.matcher,
         .choices = GBT_POSE_MATCHER_NAMES,
         .help = "which pairs of photos are matched; auto: all of few photos, of many those near in time or "
                 "by GPS"},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    char word[8192];
    gbt_error err = {0};
    const gbt_status status = gbt_pose(given->value[0], &def, out, stdout, &err);
    if (status == GBT_OK)
        printf("Train: gbtrace train %s -o RUN\n", gbt_shell_word(out, word, sizeof word));
    return command_failed(status, &err);
}

const command command_pose = {.name = "pose",
                              .summary = "find the camera poses of photos or of a video, with COLMAP",
                              .usage = "PHOTOS|VIDEO -o DATA",
                              .options = options,
                              .min_operands = 1,
                              .max_operands = 1,
                              .run = run};
