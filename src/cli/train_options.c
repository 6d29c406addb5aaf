/* SPDX-License-Identifier: Apache-2.0 */
/* cli/train_options.c -- the options of a training run. */
#include "cli/train_options.h"

#include <stdio.h>
#include <string.h>

void train_options_init(train_options *t)
{
    memset(t, 0, sizeof *t);
    t->def = gbt_train_def_default();
}

int train_options_table(train_options *t, const option *own, int own_count, option *out)
{
    gbt_train_def *d = &t->def;
    const option shared[] = {
        {.name = "budget",
         .kind = OPTION_DURATION,
         .value = &d->budget_seconds,
         .min = 0,
         .max = 1e7,
         .value_name = "TIME",
         .help = "training time in all, such as 90s, 10min or 1h; the schedule is fitted to it; 0: 10min",
         .aliases = "budget-seconds"},
        {.name = "iterations",
         .kind = OPTION_UINT64,
         .value = &d->iterations,
         .min = 0,
         .max = 1e9,
         .value_name = "N",
         .help = "number of iterations instead of a time budget; 0: the budget decides",
         .aliases = "max-steps num-iters"},
        {.name = "pace",
         .kind = OPTION_STRING,
         .value = &d->pace,
         .value_name = "N1,...,N20",
         .help = "repeat a --budget run bit for bit: the pace recorded in its train.json"},
        {.name = "init",
         .kind = OPTION_CHOICE,
         .value = &d->init,
         .choices = "gb|adaptive|voxel|random",
         .help = "initial anchors: the paper's granular balls, adaptive granular balls, voxels, or random "
                 "points"},
        {.name = "init-count",
         .kind = OPTION_DOUBLE,
         .value = &d->init_count,
         .min = 0,
         .max = 1,
         .value_name = "F",
         .help = "adaptive and random: anchors per sparse point; 0: half as many anchors as gb gives"},
        {.name = "scale-prior",
         .kind = OPTION_CHOICE,
         .value = &d->scale_prior,
         .choices = "gb|nn",
         .help = "initial scale with --init gb: from ball radius and point spacing, or from spacing alone, "
                 "as with the other --init"},
        {.name = "max-depth",
         .kind = OPTION_INT,
         .value = &d->max_depth,
         .min = 0,
         .max = 64,
         .value_name = "D",
         .help = "maximum depth of the ball tree"},
        {.name = "voxel-size",
         .kind = OPTION_FLOAT,
         .value = &d->voxel_size,
         .min = 0,
         .max = 1e9,
         .value_name = "V",
         .help = "voxel size, scene units; 0: estimated from the points"},
        {.name = "offsets",
         .kind = OPTION_INT,
         .value = &d->offsets,
         .min = 0,
         .max = 16,
         .value_name = "K",
         .help = "Gaussians per anchor; 0: 2, or 10 with --compat",
         .aliases = "n-offsets"},
        {.name = "distance",
         .kind = OPTION_CHOICE,
         .value = &d->distance,
         .choices = "auto|on|off",
         .help = "whether the camera distance is an input of the networks"},
        {.name = "downscale",
         .short_name = 'd',
         .kind = OPTION_DOUBLE,
         .value = &d->downscale,
         .min = 1,
         .max = 64,
         .value_name = "F",
         .help = "divide the photos' width and height by this",
         .aliases = "r resolution data-factor"},
        {.name = "renderer",
         .kind = OPTION_CHOICE,
         .value = &d->renderer,
         .choices = "trace|raster|per-ray",
         .help = "ray tracing; or, for comparison, splatting in tiles, or tiles with the response and depth "
                 "order of rays"},
        {.name = "footprint",
         .kind = OPTION_DOUBLE,
         .value = &d->footprint,
         .min = 0,
         .max = 4,
         .value_name = "V",
         .help = "anti-aliasing: variance of a ray's pixel footprint, px^2; 0: infinitely thin rays"},
        {.name = "near",
         .kind = OPTION_DOUBLE,
         .value = &d->near,
         .min = 0,
         .max = 1,
         .value_name = "F",
         .help = "near clipping distance, as a fraction of the nearest depth at which the photos see sparse "
                 "points; 0: 2 % of the median distance"},
        {.name = "start-level",
         .kind = OPTION_INT,
         .value = &d->start_level,
         .min = 0,
         .max = 4,
         .value_name = "L",
         .help = "start by training on one random pixel in 4^L"},
        {.name = "eval-split",
         .kind = OPTION_STRING,
         .value = &d->eval_split,
         .value_name = "SPLIT",
         .choices = "auto|every=8|none",
         .help = "held-out photos: auto (as the data set says, else every=8), every=N, none, list=FILE"},
        {.name = "eval",
         .kind = OPTION_STRING,
         .value = &d->eval_split,
         .fixed = "every=8",
         .help = "the same as --eval-split every=8"},
        {.name = "alpha",
         .kind = OPTION_CHOICE,
         .value = &d->alpha,
         .choices = "auto|black|white|mask",
         .help = "transparent pixels of photos: composited on black or white, or masked out of loss and "
                 "scores; auto: white for Blender scenes, else black"},
        {.name = "eval-at",
         .kind = OPTION_STRING,
         .value = &t->eval_at,
         .value_name = "T1,T2",
         .help =
             "measure held-out PSNR after these training times, such as 1m,2m; not counted as training time"},
        {.name = "max-anchors",
         .kind = OPTION_UINT64,
         .value = &d->max_anchors,
         .min = 1,
         .max = 1e8,
         .value_name = "N",
         .help = "maximum number of anchors"},
        {.name = "no-grow",
         .kind = OPTION_FLAG_OFF,
         .value = &d->grow,
         .help = "keep the initial anchors: no growing, no pruning"},
        {.name = "grow",
         .kind = OPTION_FLAG,
         .value = &d->grow,
         .help = "grow and prune anchors (the default)"},
        {.name = "thrift",
         .kind = OPTION_DOUBLE,
         .value = &d->thrift,
         .min = 0.1,
         .max = 10,
         .value_name = "F",
         .help = "multiply the thresholds for growing and for keeping an anchor: above 1 for smaller models, "
                 "below 1 for larger"},
        {.name = "last-thrift",
         .kind = OPTION_DOUBLE,
         .value = &d->last_thrift,
         .min = 1,
         .max = 100,
         .value_name = "F",
         .help = "multiply the threshold for keeping an anchor once more in the last tenth of growing, when "
                 "none are added; 1: no change"},
        {.name = "splats-until",
         .kind = OPTION_DOUBLE,
         .value = &d->splats_until,
         .min = 0,
         .max = 1,
         .value_name = "F",
         .help = "train by splatting, which is faster, up to this fraction of the run, then by ray tracing; "
                 "0: ray tracing throughout"},
        {.name = "grow-until",
         .kind = OPTION_DOUBLE,
         .value = &d->grow_until,
         .min = 0,
         .max = 1,
         .value_name = "F",
         .help = "grow and prune anchors up to this fraction of the run"},
        {.name = "scale-factor",
         .kind = OPTION_DOUBLE,
         .value = &d->scale_factor,
         .min = 0,
         .max = 100,
         .value_name = "F",
         .help = "multiply the anchors' initial scales; 0: by 2 with --scale-prior gb, 0.7 with nn, 1 with "
                 "--compat"},
        {.name = "exposure",
         .kind = OPTION_FLAG,
         .value = &d->exposure,
         .help = "learn a colour matrix per photo, for photos that differ in exposure or white balance"},
        {.name = "learning-rate",
         .kind = OPTION_DOUBLE,
         .value = &d->learning_rate_factor,
         .min = 1e-3,
         .max = 1e3,
         .value_name = "F",
         .help = "multiply all learning rates"},
        {.name = "compat",
         .kind = OPTION_FLAG,
         .value = &d->compat,
         .help = "follow the reference implementation in every detail (docs/training.md)"},
        {.name = "save-every",
         .kind = OPTION_DURATION,
         .value = &d->save_every_seconds,
         .min = 0,
         .max = 1e7,
         .value_name = "TIME",
         .help = "time between checkpoints; 0: only at the end"},
        {.name = "tensorboard",
         .kind = OPTION_FLAG,
         .value = &d->tensorboard,
         .help = "also write RUN/events.out.tfevents.* for TensorBoard"},
        {.name = "resume",
         .kind = OPTION_FLAG,
         .value = &d->resume,
         .help = "go on with RUN from its last checkpoint, with its settings and data; with another "
                 "--iterations or --budget to that length in all, also when it was finished"},
        {.name = "overwrite",
         .kind = OPTION_FLAG,
         .value = &d->overwrite,
         .help = "train anew in a folder that holds a run, which is lost"},
        {.name = "seed",
         .kind = OPTION_UINT64,
         .value = &d->seed,
         .value_name = "S",
         .help = "of everything that is random"},
        {.name = "memory",
         .kind = OPTION_SIZE,
         .value = &d->hit_bytes_max,
         .min = 0,
         .max = 0x1p60,
         .value_name = "BYTES",
         .help = "memory for ray hits kept for the backward pass, such as 100M; hits beyond it are traced "
                 "again; 0: no limit; does not change the result"},
        {.name = "threads",
         .kind = OPTION_INT,
         .value = &t->threads,
         .min = 0,
         .max = 1024,
         .value_name = "T",
         .help = THREADS_HELP "; does not change the result"},
        /* What people type who come from 3DGS and Scaffold-GS. */
        {.name = "images",
         .kind = OPTION_ELSEWHERE,
         .aliases = "i",
         .help = "photos are found from the cameras; for smaller ones use --downscale F"},
        {.name = "white-background",
         .kind = OPTION_ELSEWHERE,
         .aliases = "w",
         .help = "what no Gaussian covers shows the mean colour of the points; leave it out"},
        {.name = "sh-degree",
         .kind = OPTION_ELSEWHERE,
         .help = "colours come from networks; gbtrace export has --sh-degree"},
        {.name = "test-iterations",
         .kind = OPTION_ELSEWHERE,
         .help = "use --eval-at 1m,2m for scores on the way"},
        {.name = "save-iterations",
         .kind = OPTION_ELSEWHERE,
         .aliases = "checkpoint-iterations",
         .help = "use --save-every 2m"},
        {.name = "start-checkpoint", .kind = OPTION_ELSEWHERE, .help = "use --resume with the same -o RUN"},
        {.name = "data-device",
         .kind = OPTION_ELSEWHERE,
         .aliases = "gpu",
         .help = "everything runs on the CPU; leave it out"},
        {.name = "ip",
         .kind = OPTION_ELSEWHERE,
         .aliases = "port",
         .help = "gbtrace view RUN shows a run while it trains"},
        {.name = "lambda-dssim", .kind = OPTION_ELSEWHERE, .help = "it is 0.2; leave it out"},
        {.name = "densify-until-iter",
         .kind = OPTION_ELSEWHERE,
         .aliases = "update-until densify-from-iter start-stat update-from",
         .help = "use --grow-until F, a fraction of the run"},
        {.name = "densify-grad-threshold",
         .kind = OPTION_ELSEWHERE,
         .aliases = "densification-interval opacity-reset-interval percent-dense update-interval",
         .help = "growth follows the length of the run; --max-anchors N limits it"},
        {.name = "position-lr-init",
         .kind = OPTION_ELSEWHERE,
         .aliases = "position-lr-final position-lr-max-steps feature-lr opacity-lr scaling-lr rotation-lr "
                    "offset-lr-init offset-lr-final",
         .help = "use --learning-rate F, which multiplies all rates"},
        {.name = "train-test-exp",
         .kind = OPTION_ELSEWHERE,
         .aliases = "appearance-dim",
         .help = "use --exposure"},
        {.name = "antialiasing",
         .kind = OPTION_ELSEWHERE,
         .help = "rays are as wide as pixels already (--footprint)"},
        {.name = "depths", .kind = OPTION_ELSEWHERE, .help = "depth maps are not read; leave it out"},
    };
    const int shared_count = sizeof shared / sizeof *shared;
    memcpy(out, own, (size_t)own_count * sizeof *own);
    memcpy(out + own_count, shared, sizeof shared);
    return own_count + shared_count;
}

static gbt_status read_times(train_options *t, gbt_error *err)
{
    char list[512];
    if (snprintf(list, sizeof list, "%s", t->eval_at) >= (int)sizeof list) {
        snprintf(err->text, sizeof err->text, "--eval-at: the list is too long");
        return GBT_ERR_ARGUMENT;
    }
    double previous = 0;
    char *rest = NULL;
    for (char *item = strtok_r(list, ",", &rest); item != NULL; item = strtok_r(NULL, ",", &rest)) {
        double seconds = 0;
        const option one = {.name = "eval-at",
                            .kind = OPTION_DURATION,
                            .value = &seconds,
                            .min = 0,
                            .max = 1e7,
                            .value_name = "TIME"};
        char wanted[128];
        if (!options_read_value(&one, item, wanted, sizeof wanted) || seconds <= previous ||
            t->def.eval_at_count == GBT_TRAIN_MAX_EVALS) {
            snprintf(err->text, sizeof err->text,
                     "--eval-at: \"%.80s\" (wanted up to %d rising times, such as 1m,2m)", item,
                     GBT_TRAIN_MAX_EVALS);
            return GBT_ERR_ARGUMENT;
        }
        t->def.eval_at_seconds[t->def.eval_at_count++] = previous = seconds;
    }
    return GBT_OK;
}

gbt_status train_options_finish(train_options *t, const char *command_name, int argc, char **argv,
                                gbt_error *err)
{
    if (t->threads > 0)
        gbt_set_threads(t->threads);
    size_t used = (size_t)snprintf(t->command, sizeof t->command, "%s", command_name);
    for (int i = 0; i < argc && used < sizeof t->command; i++)
        used += (size_t)snprintf(t->command + used, sizeof t->command - used, " %s", argv[i]);
    t->def.command = t->command;
    return t->eval_at != NULL ? read_times(t, err) : GBT_OK;
}
