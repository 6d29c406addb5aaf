/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_demo.c -- gbtrace demo: make a scene, train on it, score it, report. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cli/finish_run.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "gbtrace/make_scene.h"
#include "gbtrace/progress.h"
#include "gbtrace/train.h"

/** "tabletop|courtyard|..." */
static char scene_choices[256];
static int scene_index;

static gbt_make_scene_def scene;
static gbt_train_def train;
static const char *out = "demo";
static double minutes = 2;

static const option *options(int *count)
{
    scene = gbt_make_scene_def_default();
    train = gbt_train_def_default();
    const char *const *names = gbt_make_scene_names();
    size_t used = 0;
    for (int i = 0; names[i] != NULL && used < sizeof scene_choices; i++)
        used += (size_t)snprintf(scene_choices + used, sizeof scene_choices - used, "%s%s", i > 0 ? "|" : "",
                                 names[i]);
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &out,
         .value_name = "DIR",
         .help = "folder for the scene and its run, which are replaced; a run of other data is left alone"},
        {.name = "minutes",
         .kind = OPTION_DOUBLE,
         .value = &minutes,
         .min = 0.05,
         .max = 600,
         .value_name = "M",
         .help = "training time, minutes"},
        {.name = "scene",
         .kind = OPTION_CHOICE,
         .value = &scene_index,
         .choices = scene_choices,
         .help = "which procedural scene (gbtrace make-scene --help says what they show)"},
        {.name = "seed",
         .kind = OPTION_UINT64,
         .value = &train.seed,
         .value_name = "S",
         .help = "random seed"},
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

/* Whether a run was trained on the scene beside it: the last line of its file data_places says so. */
static bool is_of_scene(const char *run_folder)
{
    char path[4200], line[4200] = "";
    snprintf(path, sizeof path, "%s/data_places", run_folder);
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return false;
    while (fgets(line, sizeof line, file) != NULL) {
    }
    fclose(file);
    return strcmp(line, "../scene\n") == 0;
}

static int run(const operands *given)
{
    (void)given; /* takes no operands */
    char data[4096], run_folder[4096], command_line[8400];
    if (snprintf(data, sizeof data, "%s/scene", out) >= (int)sizeof data ||
        snprintf(run_folder, sizeof run_folder, "%s/run", out) >= (int)sizeof run_folder)
        return command_misused("--output: the path is too long");
    char data_word[sizeof data], run_word[sizeof run_folder];
    snprintf(command_line, sizeof command_line, "gbtrace train %s -o %s --budget %.0fs --seed %llu",
             gbt_shell_word(data, data_word, sizeof data_word),
             gbt_shell_word(run_folder, run_word, sizeof run_word), 60 * minutes,
             (unsigned long long)train.seed);
    char about[4200];
    snprintf(about, sizeof about, "%s/SCENE.md", data);
    if (access(data, F_OK) == 0 && access(about, F_OK) != 0)
        return command_misused("%s: exists, but is not a scene made by gbtrace (choose another --output)",
                               data);
    train.budget_seconds = 60 * minutes;
    train.command = command_line;
    train.overwrite = is_of_scene(run_folder);
    scene.name = gbt_make_scene_names()[scene_index];
    gbt_error err = {0};
    progress_say("1/3 photographing the procedural scene \"%s\"", scene.name);
    gbt_status status = gbt_make_scene(&scene, data, &err);
    if (status == GBT_OK) {
        progress_say("2/3 training: %s", command_line);
        status = gbt_train(data, run_folder, &train, &err);
    }
    if (status == GBT_OK) {
        progress_say("3/3 scoring the held-out views");
        status = finish_run(run_folder, false, &err);
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
                              .options = options,
                              .min_operands = 0,
                              .max_operands = 0,
                              .run = run};
