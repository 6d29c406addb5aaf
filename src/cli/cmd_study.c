/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_study.c -- gbtrace study: measurements that make a chart. */
#include <stdio.h>
#include <string.h>

#include "cli/options.h"
#include "gbtrace/cluster.h"
#include "lab/lab.h"

/* The parsed command line, for all studies. */
typedef struct study_request {
    lab_study_def def; /* for studies of models */
    lab_stability_def stability;
    lab_runs_def runs; /* for studies that train */
    const char *folder;
} study_request;

static gbt_status run_speed(const study_request *r, gbt_error *err)
{
    return lab_study_speed(&r->def, r->folder, stdout, err);
}

static gbt_status run_crosscheck(const study_request *r, gbt_error *err)
{
    return lab_study_crosscheck(&r->def, r->folder, stdout, err);
}

static gbt_status run_rate(const study_request *r, gbt_error *err)
{
    return lab_study_rate(&r->def, r->folder, stdout, err);
}

static gbt_status run_stability(const study_request *r, gbt_error *err)
{
    return lab_study_stability(&r->stability, r->folder, stdout, err);
}

static gbt_status run_paper(const study_request *r, gbt_error *err)
{
    return lab_study_paper(&r->runs, r->folder, stdout, err);
}

static gbt_status run_time(const study_request *r, gbt_error *err)
{
    return lab_study_time(&r->runs, r->folder, stdout, err);
}

static gbt_status run_anchors(const study_request *r, gbt_error *err)
{
    return lab_study_anchors(&r->runs, r->folder, stdout, err);
}

enum { STUDY_COUNT = 7 };

static const command_word study_words[STUDY_COUNT + 1] = {
    {"speed", "time per ray against error, for every cut-off, of runs or plain Gaussians"},
    {"crosscheck", "tracer against rasterizer, and what makes them differ, of runs or plain Gaussians"},
    {"rate", "file size against picture quality, of runs"},
    {"stability", "the scenes on which renderers of Gaussians are known to fail; takes no model"},
    {"paper", "the paper's four tables, by training on data sets"},
    {"time", "held-out PSNR against training time, by training on data sets of pinhole photos"},
    {"anchors", "held-out PSNR against the number of anchors, by training on data sets"},
    {NULL, NULL}};
static const struct {
    int models_min, models_max;
    gbt_status (*run)(const study_request *, gbt_error *);
    bool shares_work; /* as in `command` */
} studies[STUDY_COUNT] = {{1, 16, run_speed, false}, {1, 16, run_crosscheck, false},
                          {1, 6, run_rate, false},   {0, 0, run_stability, false},
                          {1, 16, run_paper, true},  {1, 16, run_time, true},
                          {1, 16, run_anchors, true}};

static const command_word *words_of_studies(void) { return study_words; }

static study_request request;

static const option *options(int *count)
{
    request = (study_request){.def = lab_study_def_default(),
                              .stability = lab_stability_def_default(),
                              .runs = lab_runs_def_default()};
    static const option rows[] = {
        {.name = "output",
         .short_name = 'o',
         .kind = OPTION_STRING,
         .value = &request.folder,
         .value_name = "DIR",
         .help = "folder for the tables, and for charts if the study draws any",
         .required = true},
        {.name = "camera",
         .of = "speed crosscheck",
         .kind = OPTION_STRING,
         .value = &request.def.camera,
         .value_name = "FILE.json",
         .help = "the camera of files of plain Gaussians; default: camera.json beside each"},
        {.name = "repeats",
         .of = "speed",
         .kind = OPTION_INT,
         .value = &request.def.repeats,
         .min = 1,
         .max = 1000,
         .value_name = "N",
         .help = "timed passes of each setting; the median is reported",
         .rare = true},
        {.name = "only",
         .of = "stability",
         .kind = OPTION_STRING,
         .value = &request.stability.only,
         .value_name = "A1,A9",
         .choices = "A1|A2|A3|A4|A5|A6|A7|A8|A9|A10|A11|A12|A13",
         .list = true,
         .help = "only these cases; default: all"},
        {.name = "quick",
         .of = "stability",
         .kind = OPTION_FLAG,
         .value = &request.stability.quick,
         .help = "use smaller scenes, as in the tests"},
        {.name = "iterations",
         .of = "paper anchors",
         .kind = OPTION_UINT64,
         .value = &request.runs.iterations,
         .min = 0,
         .max = 1e9,
         .value_name = "N",
         .help = "iterations of each run; 0: 3000 for paper, 1000 for anchors",
         .rare = true},
        {.name = "renderer",
         .of = "paper",
         .kind = OPTION_CHOICE,
         .value = &request.runs.renderer,
         .choices = GBT_RENDERER_TRAINING_NAMES,
         .help = "renderer of the runs"},
        {.name = "voxel-size",
         .of = "paper",
         .kind = OPTION_DOUBLE,
         .value = &request.runs.voxel_size,
         .min = 0,
         .max = 1e9,
         .value_name = "V",
         .help = "voxel size, scene units; 0: the reference's, estimated from the points",
         .rare = true},
        {.name = "tables",
         .of = "paper",
         .kind = OPTION_STRING,
         .value = &request.runs.tables,
         .value_name = "1,3",
         .choices = "1|2|3|4",
         .list = true,
         .help = "only these of the paper's four tables; default: all",
         .rare = true},
        {.name = "lpips",
         .of = "paper",
         .kind = OPTION_STRING,
         .value = &request.runs.lpips,
         .value_name = "FILE",
         .help = LPIPS_HELP},
        {.name = "budget",
         .of = "time",
         .kind = OPTION_DURATION,
         .value = &request.runs.budget_seconds,
         .min = 1,
         .max = 1e6,
         .value_name = "TIME",
         .help = "training time of a run"},
        {.name = "downscale",
         .of = "paper time anchors",
         .short_name = 'd',
         .kind = OPTION_DOUBLE,
         .value = &request.runs.downscale,
         .min = 1,
         .max = 64,
         .value_name = "F",
         .help = "divide the photos' width and height by this"},
        {.name = "eval-split",
         .of = "paper time anchors",
         .kind = OPTION_STRING,
         .value = &request.runs.eval_split,
         .value_name = "SPLIT",
         .choices = "auto|every=8|validate=8",
         .help = "held-out photos, as in train; validate=8: to choose settings by; default: every=8 for "
                 "paper, else auto"},
        {.name = "seeds",
         .of = "paper time anchors",
         .kind = OPTION_INT,
         .value = &request.runs.seeds,
         .min = 0,
         .max = 10,
         .value_name = "N",
         .help = "runs of each variant; 0: 3 for paper and anchors, 1 for time"},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    size_t which = 0;
    while (strcmp(given->value[0], study_words[which].name) != 0) /* ends, since options_parse() accepts no
                                                                     other word */
        which++;
    if (given->count - 1 < studies[which].models_min)
        return command_misused("study %s: wanted a model, or data to train on", study_words[which].name);
    if (given->count - 1 > studies[which].models_max)
        return command_misused("study %s: \"%.60s\" is one too many", study_words[which].name,
                               given->value[1 + studies[which].models_max]);
    request.def.models = request.runs.data = given->value + 1;
    request.def.model_count = request.runs.data_count = (size_t)given->count - 1;
    gbt_error err = {0};
    const bool first = gbt_cluster_rank() == 0;
    if (!studies[which].shares_work)
        gbt_cluster_close(0, NULL);
    if (!first && !studies[which].shares_work)
        return 0;
    return command_failed(studies[which].run(&request, &err), &err);
}

const command command_study = {
    .name = "study",
    .summary = "measure and draw charts: speed, accuracy, size, stability, the paper's tables",
    .usage = "STUDY [MODEL|DATA...] -o DIR",
    .options = options,
    .min_operands = 1,
    .max_operands = 17,
    .shares_work = true,
    .run = run,
    .words = words_of_studies};
