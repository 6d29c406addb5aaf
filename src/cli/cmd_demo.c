/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_demo.c -- gbtrace demo: make a scene, train on it, score it, report. */
#include <stdio.h>
#include <string.h>

#include "cli/finish_run.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "gbtrace/make_scene.h"
#include "gbtrace/train.h"

/** "tabletop|courtyard|..." */
static const char *scene_choices(void)
{
    static char list[256];
    const char *const *names = gbt_make_scene_names();
    size_t used = 0;
    for (int i = 0; names[i] != NULL && used < sizeof list; i++)
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? "|" : "", names[i]);
    return list;
}

static int run(const command *self, int argc, char **argv)
{
    gbt_make_scene_def scene = gbt_make_scene_def_default();
    gbt_train_def train = gbt_train_def_default();
    const char *out = "demo";
    double minutes = 2;
    int threads = 0;
    const option options[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "DIR",
         .help = "folder for the scene and the run"},
        {.name = "minutes",
         .kind = OPTION_DOUBLE,
         .value = &minutes,
         .min = 0.05,
         .max = 600,
         .value_name = "M",
         .help = "training time, minutes"},
        {.name = "scene",
         .kind = OPTION_CHOICE,
         .value = &scene.name,
         .choices = scene_choices(),
         .help = "which procedural scene (gbtrace make-scene --help says what they show)"},
        {.name = "seed",
         .kind = OPTION_UINT64,
         .value = &train.seed,
         .value_name = "S",
         .help = "random seed"},
        {.name = "threads",
         .kind = OPTION_INT,
         .value = &threads,
         .min = 0,
         .max = 1024,
         .value_name = "T",
         .help = THREADS_HELP},
    };
    operands none;
    const int code = options_parse(self, options, sizeof options / sizeof *options, 0, 0, argc, argv, &none);
    if (code >= 0)
        return code;
    if (threads > 0)
        gbt_set_threads(threads);
    char data[4096], run_folder[4096], command_line[8400];
    if (snprintf(data, sizeof data, "%s/scene", out) >= (int)sizeof data ||
        snprintf(run_folder, sizeof run_folder, "%s/run", out) >= (int)sizeof run_folder)
        return command_misused("--output: the path is too long");
    snprintf(command_line, sizeof command_line, "gbtrace train %s -o %s --budget %.0fs", data, run_folder,
             60 * minutes);
    train.budget_seconds = 60 * minutes;
    train.command = command_line;
    train.overwrite = true;
    gbt_error err = {0};
    progress_say("1/3 photographing the procedural scene \"%s\"", scene.name);
    gbt_status status = gbt_make_scene(&scene, data, &err);
    if (status == GBT_OK) {
        progress_say("2/3 training: %s", command_line);
        status = gbt_train(data, run_folder, &train, &err);
    }
    if (status == GBT_OK) {
        progress_say("3/3 scoring the held-out views");
        status = finish_run(run_folder, false, false, &err);
    }
    if (status == GBT_OK)
        finish_run_say(run_folder);
    if (status == GBT_OK && progress_for_people())
        puts("Your own photos: gbtrace train PHOTOS -o RUN --budget 10m   (PHOTOS holds images/ and sparse/0 "
             "from COLMAP)");
    return command_failed(status, &err);
}

const command command_demo = {.name = "demo",
                              .summary =
                                  "make a procedural scene, train on it, score it and write the report",
                              .usage = "[--minutes M] [-o DIR]",
                              .run = run};
