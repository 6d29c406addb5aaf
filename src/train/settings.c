/* SPDX-License-Identifier: Apache-2.0 */
/* train/settings.c -- the table of training settings. Defaults, ranges, RUN/config, the command line,
   environment variables and the comparison of a resumed run are all derived from it. A new setting is a field
   of gbt_train_def and a row here. */
#include "train/settings.h"

#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "anchor/anchors.h"
#include "base/choice.h"
#include "base/fail.h"

#define FIELD(f) .field = #f, .offset = offsetof(gbt_train_def, f)
#define NAMED(n, f) .name = n, FIELD(f)
#define FLAG .kind = GBT_SETTING_FLAG
#define RANGE(k, low, high, u) .kind = GBT_SETTING_##k, .min = low, .max = high, .unit = u
#define CHOICE(names) .kind = GBT_SETTING_CHOICE, .choices = names

static const gbt_train_setting settings[] = {
    {NAMED("budget-seconds", budget_seconds), .option = "budget", RANGE(SECONDS, 0, 1e9, "TIME"), .number = 0,
     .saved = true,
     .help = "total training time, such as 90s, 10min or 1h; the schedule is fitted to it; 0: 10min"},
    {NAMED("iterations", iterations), RANGE(UINT64, 0, 1e15, "N"), .number = 0, .saved = true,
     .help = "number of iterations instead of a time budget; 0: the budget decides",
     .aliases = "max-steps num-iters"},
    {NAMED("views", views), RANGE(INT, 1, 64, "V"), .number = 1, .saved = true, .if_changed = true,
     .rare = true,
     .help = "photos per step, a power of two; learning rates are multiplied by the square root of "
             "it (docs/cluster.md)",
     .aliases = "batch-size"},
    {NAMED("init", init), CHOICE(GBT_INIT_NAMES), .number = GBT_INIT_GB, .saved = true,
     .help =
         "initial anchors: the paper's granular balls, adaptive granular balls, voxels, or random points"},
    {NAMED("init-count", init_count), RANGE(DOUBLE, 0, 1, "F"), .number = 0, .saved = true, .rare = true,
     .help = "init adaptive and random: anchors per sparse point; 0: half as many anchors as gb gives"},
    {NAMED("scale-prior", scale_prior), CHOICE(GBT_SCALE_PRIOR_NAMES), .number = GBT_SCALE_PRIOR_GB,
     .saved = true, .rare = true,
     .help = "initial scale with init gb: from ball radius and point spacing, or from spacing alone, as with "
             "every other init"},
    {NAMED("max-depth", max_depth), RANGE(INT, 0, 64, "D"), .number = 18, .saved = true, .rare = true,
     .help = "maximum depth of the ball tree"},
    {NAMED("voxel-size", voxel_size), RANGE(FLOAT, 0, 1e9, "V"), .number = 0, .saved = true, .rare = true,
     .help = "voxel size, scene units; 0: estimated from the points"},
    {NAMED("offsets", offsets), RANGE(INT, 0, ANCHOR_MAX_OFFSETS, "K"), .number = 0, .saved = true,
     .rare = true, .help = "Gaussians per anchor; 0: 2, or 10 with compat", .aliases = "n-offsets"},
    {NAMED("distance", distance), CHOICE(GBT_DISTANCE_INPUT_NAMES), .number = GBT_DISTANCE_INPUT_AUTO,
     .saved = true, .rare = true, .help = "whether the camera distance is an input of the networks"},
    {NAMED("pace", pace), .kind = GBT_SETTING_TEXT, .unit = "N1,...,N20", .saved = true, .rare = true,
     .help = "repeat a run with a budget bit for bit: the pace recorded in its train.json"},
    {NAMED("downscale", downscale), RANGE(DOUBLE, 1, 64, "F"), .or_zero = true, .number = 0, .saved = true,
     .help = "divide the cameras' width and height by this; 0: to the photos' own size, at most 1,600 pixels "
             "wide",
     .aliases = "d r resolution data-factor"},
    {NAMED("renderer", renderer), CHOICE(GBT_RENDERER_TRAINING_NAMES), .number = GBT_RENDERER_TRACE,
     .saved = true, .rare = true,
     .help =
         "ray tracing; or, for comparison, splatting in tiles, or tiles with the response and depth order of "
         "rays"},
    {NAMED("footprint", footprint), RANGE(DOUBLE, 0, 4, "V"), .number = 0.1, .saved = true, .rare = true,
     .help = "anti-aliasing: variance of a ray's pixel footprint, px^2; 0: infinitely thin rays"},
    {NAMED("near", near), RANGE(DOUBLE, 0, 1, "F"), .number = 0.5, .saved = true, .rare = true,
     .help = "near clipping distance, as a fraction of the nearest depth at which the photos see sparse "
             "points; at least 2 % of the median distance, except for photos that see nearer points"},
    {NAMED("step-pixels", step_pixels), RANGE(INT, 0, 1e9, "N"), .number = 50000, .saved = true, .rare = true,
     .help = "approximate number of pixels per step, a new random subset of the photo each time; 0: all"},
    {NAMED("eval-split", eval_split), .kind = GBT_SETTING_TEXT, .unit = "SPLIT", .text = "auto",
     .choices = "auto|every=8|none|validate=8", .saved = true,
     .help = "held-out photos: auto (as the data set says, else every=8), every=N, every=N:K (from photo K "
             "on), none, list=FILE; validate=N: every N-th training photo instead"},
    {NAMED("alpha", alpha), CHOICE(GBT_ALPHA_NAMES), .number = GBT_ALPHA_AUTO, .saved = true,
     .help = "transparent pixels of photos: composited on black or white, or masked out of loss and scores; "
             "auto: "
             "white for Blender scenes, else and with compat black"},
    {NAMED("background", background), CHOICE(GBT_BACKGROUND_NAMES), .number = GBT_BACKGROUND_CONSTANT,
     .saved = true, .if_changed = true,
     .help = "a constant colour, or a learned sky that depends on direction"},
    {NAMED("seed", seed), RANGE(UINT64, 0, 0, "S"), .number = 0, .saved = true, .help = "random seed"},
    {NAMED("max-anchors", max_anchors), RANGE(UINT64, 1, 1e8, "N"), .number = 2000000, .saved = true,
     .rare = true, .help = "maximum number of anchors"},
    {NAMED("grow", grow), FLAG, .rare = true, .number = 1, .saved = true,
     .help = "keep the initial anchors: no growing, no pruning"},
    {NAMED("threshold-factor", threshold_factor), RANGE(DOUBLE, 0.1, 10, "F"), .number = 1, .saved = true,
     .help = "multiply the thresholds of densification and of pruning: above 1 for smaller models, "
             "below 1 for "
             "larger"},
    {NAMED("final-prune-factor", final_prune_factor), RANGE(DOUBLE, 1, 100, "F"), .number = 4, .saved = true,
     .rare = true,
     .help = "also multiply the threshold of pruning by this in the last tenth of the growth phase, "
             "when no anchors are added; 1: no change"},
    {NAMED("compat", compat), FLAG, .rare = true, .saved = true,
     .help = "follow the reference implementation in every detail (docs/compat.md)"},
    {NAMED("exposure", exposure), FLAG, .saved = true,
     .help = "learn a colour matrix per photo (exposure, white balance)"},
    {NAMED("find-exposure", find_exposure), FLAG, .rare = true, .number = 1, .saved = true,
     .help = "do not turn exposure on automatically where the photos' exposures differ"},
    {NAMED("refine-poses", refine_poses), FLAG, .saved = true, .if_changed = true,
     .help = "also correct the poses of the photos"},
    {NAMED("splats-until", splats_until), RANGE(DOUBLE, 0, 1, "F"), .saved = true, .rare = true,
     .help = "train by splatting up to this fraction of the run, then by ray tracing"},
    {NAMED("grow-until", grow_until), RANGE(DOUBLE, 0, 1, "F"), .number = 0.5, .saved = true, .rare = true,
     .help = "grow and prune anchors up to this fraction of the run"},
    {NAMED("scale-factor", scale_factor), RANGE(DOUBLE, 0.01, 100, "F"), .or_zero = true, .number = 0,
     .saved = true, .rare = true,
     .help =
         "multiply the anchors' initial scales; 0: by 2 with the scale prior gb, 0.7 with nn, 1 with compat"},
    {NAMED("learning-rate", learning_rate_factor), RANGE(DOUBLE, 1e-3, 1e3, "F"), .number = 1, .saved = true,
     .rare = true, .help = "multiply all learning rates"},
    {NAMED("save-every-seconds", save_every_seconds), .option = "save-every", RANGE(SECONDS, 0, 1e9, "TIME"),
     .number = 120, .help = "time between checkpoints; 0: only at the end"},
    {NAMED("stop-at-step", stop_at_step), RANGE(UINT64, 0, 0, "N"), .rare = true,
     .help = "stop, as an interrupt would, after this step; 0: never"},
    {NAMED("tensorboard", tensorboard), FLAG, .rare = true,
     .help = "also write RUN/events.out.tfevents.* for TensorBoard"},
    {NAMED("resume", resume), FLAG,
     .help =
         "resume RUN from its last checkpoint; with other iterations or another budget, up to that total, "
         "even if it was finished"},
    {NAMED("overwrite", overwrite), FLAG, .help = "replace a run that the folder already holds: it is lost"},
    {NAMED("lossless", lossless), FLAG, .saved = true, .if_changed = true, .rare = true,
     .help = "store the model without loss (see compress); the file is about seven times larger"},
    {NAMED("memory", memory), RANGE(BYTES, 0, 0x1p60, "BYTES"),
     .help = "upper limit for memory, such as 4G (docs/memory.md); does not change the result; 0: no limit"},
};

enum { SETTING_COUNT = sizeof settings / sizeof *settings };

size_t gbt_train_setting_count(void) { return SETTING_COUNT; }

const gbt_train_setting *gbt_train_setting_at(size_t index) { return &settings[index]; }

/* ---- one setting of a definition struct ---- */

enum { NUMBER_TEXT_SIZE = 32 };

/* Print the fewest digits, at least 6, that read back as the same number: 0.7, not 0.69999999999999996. */
static const char *number_text(double value, char out[NUMBER_TEXT_SIZE])
{
    for (int digits = 6; digits <= DBL_DECIMAL_DIG; digits++) {
        snprintf(out, NUMBER_TEXT_SIZE, "%.*g", digits, value);
        if (strtod(out, NULL) == value)
            break;
    }
    return out;
}

/* Address of a setting's field in `def`. */
static void *place(const gbt_train_setting *s, gbt_train_def *def) { return (char *)def + s->offset; }

/* The value as a double; integers above 2^53 are approximate. */
static double number_of(const gbt_train_setting *s, const gbt_train_def *def)
{
    const void *at = (const char *)def + s->offset;
    switch (s->kind) {
    case GBT_SETTING_FLAG:
        return *(const bool *)at;
    case GBT_SETTING_INT:
        return *(const int *)at;
    case GBT_SETTING_UINT64:
        return (double)*(const uint64_t *)at;
    case GBT_SETTING_BYTES:
        return (double)*(const size_t *)at;
    case GBT_SETTING_FLOAT:
        return (double)*(const float *)at;
    case GBT_SETTING_DOUBLE:
    case GBT_SETTING_SECONDS:
        return *(const double *)at;
    case GBT_SETTING_CHOICE:
        return *(const int *)at;
    case GBT_SETTING_TEXT:
        break;
    }
    return 0;
}

/* Numbers outside the range of int become a value that no setting allows. */
static int to_int(double number) { return number >= -1e9 && number <= 1e9 ? (int)number : INT_MIN; }

static void set_number(const gbt_train_setting *s, double number, gbt_train_def *def)
{
    void *at = place(s, def);
    switch (s->kind) {
    case GBT_SETTING_FLAG:
        *(bool *)at = number != 0;
        break;
    case GBT_SETTING_INT:
    case GBT_SETTING_CHOICE:
        *(int *)at = to_int(number);
        break;
    case GBT_SETTING_UINT64:
        *(uint64_t *)at = (uint64_t)number;
        break;
    case GBT_SETTING_BYTES:
        *(size_t *)at = (size_t)number;
        break;
    case GBT_SETTING_FLOAT:
        *(float *)at = (float)number;
        break;
    case GBT_SETTING_DOUBLE:
    case GBT_SETTING_SECONDS:
        *(double *)at = number;
        break;
    case GBT_SETTING_TEXT:
        break;
    }
}

void setting_set_default(const gbt_train_setting *s, gbt_train_def *def)
{
    if (s->kind == GBT_SETTING_TEXT)
        *(const char **)place(s, def) = s->text;
    else
        set_number(s, s->number, def);
}

gbt_status setting_check(const gbt_train_setting *s, const gbt_train_def *def, gbt_error *err)
{
    const double number = number_of(s, def);
    const bool any = s->min == 0 && s->max == 0;
    char got[NUMBER_TEXT_SIZE], low[NUMBER_TEXT_SIZE], high[NUMBER_TEXT_SIZE];
    if (s->kind == GBT_SETTING_CHOICE)
        return choice_check(s->field, s->choices, (int)number, err);
    if (s->kind == GBT_SETTING_TEXT && s->text != NULL &&
        *(const char *const *)(const void *)((const char *)def + s->offset) == NULL)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: NULL (wanted text)", s->field);
    if (s->kind == GBT_SETTING_TEXT || s->kind == GBT_SETTING_FLAG || any || (s->or_zero && number == 0) ||
        (number >= s->min && number <= s->max))
        return GBT_OK;
    return base_fail(err, GBT_ERR_ARGUMENT, "%s: %s (wanted %s to %s%s)", s->field, number_text(number, got),
                     number_text(s->min, low), number_text(s->max, high), s->or_zero ? ", or 0" : "");
}

void setting_text(const gbt_train_setting *s, const gbt_train_def *def, char *out, size_t size)
{
    const void *at = (const char *)def + s->offset;
    char number[NUMBER_TEXT_SIZE], choice[CHOICE_TEXT_SIZE];
    switch (s->kind) {
    case GBT_SETTING_UINT64:
        snprintf(out, size, "%llu", (unsigned long long)*(const uint64_t *)at);
        break;
    case GBT_SETTING_BYTES:
        snprintf(out, size, "%zu", *(const size_t *)at);
        break;
    case GBT_SETTING_FLOAT:
        snprintf(out, size, "%.9g", (double)*(const float *)at);
        break;
    case GBT_SETTING_TEXT:
        snprintf(out, size, "%s", *(const char *const *)at != NULL ? *(const char *const *)at : "");
        break;
    case GBT_SETTING_CHOICE:
        snprintf(out, size, "%s", choice_name(s->choices, *(const int *)at, choice));
        break;
    case GBT_SETTING_INT:
        snprintf(out, size, "%d", *(const int *)at);
        break;
    case GBT_SETTING_FLAG:
    case GBT_SETTING_DOUBLE:
    case GBT_SETTING_SECONDS:
        snprintf(out, size, "%s", number_text(number_of(s, def), number));
        break;
    }
}

/* Storage for the text of a setting: the n-th setting of kind text has the n-th buffer. */
static char *text_of(const gbt_train_setting *s, setting_texts *texts)
{
    int index = 0;
    for (const gbt_train_setting *before = settings; before < s; before++)
        index += before->kind == GBT_SETTING_TEXT;
    return texts->text[index];
}

/* Parse an integer: plain digits, exact up to 2^64, or the forms that other programs write, such as 1e5 or
   100.0. */
static bool read_whole(const char *text, uint64_t *out)
{
    char *end;
    if (text[0] != '\0' && text[strspn(text, "0123456789")] == '\0') {
        errno = 0;
        *out = strtoull(text, NULL, 10);
        return errno == 0;
    }
    const double number = strtod(text, &end);
    const bool is_whole =
        end != text && *end == '\0' && number >= 0 && number < 0x1p53 && number == floor(number);
    *out = is_whole ? (uint64_t)number : 0;
    return is_whole;
}

bool setting_read(const gbt_train_setting *s, const char *text, setting_texts *texts, gbt_train_def *def)
{
    char *end;
    const double number = strtod(text, &end);
    const bool is_number = end != text && *end == '\0';
    uint64_t whole;
    char *kept;
    switch (s->kind) {
    case GBT_SETTING_TEXT:
        kept = text_of(s, texts);
        if (snprintf(kept, SETTING_TEXT_SIZE, "%s", text) >= SETTING_TEXT_SIZE)
            return false;
        *(const char **)place(s, def) = kept[0] != '\0' || s->text != NULL ? kept : NULL;
        return true;
    case GBT_SETTING_CHOICE:
        *(int *)place(s, def) = choice_find(s->choices, text);
        return choice_find(s->choices, text) >= 0;
    case GBT_SETTING_FLAG:
        *(bool *)place(s, def) = strcmp(text, "true") == 0 || (is_number && number != 0);
        return is_number || strcmp(text, "true") == 0 || strcmp(text, "false") == 0;
    case GBT_SETTING_UINT64:
        return read_whole(text, place(s, def));
    case GBT_SETTING_BYTES:
        if (!read_whole(text, &whole))
            return false;
        *(size_t *)place(s, def) = (size_t)whole;
        return true;
    case GBT_SETTING_INT:
        if (!(number >= INT_MIN && number <= INT_MAX && number == floor(number)))
            return false;
        set_number(s, number, def);
        return is_number;
    case GBT_SETTING_FLOAT:
    case GBT_SETTING_DOUBLE:
    case GBT_SETTING_SECONDS:
        set_number(s, number, def);
        return is_number;
    }
    return false;
}

static bool is_named(const gbt_train_setting *s, const char *name)
{
    const size_t length = strlen(name);
    for (const char *alias = s->aliases; alias != NULL && *alias != '\0';) {
        const size_t end = strcspn(alias, " ");
        if (end == length && strncmp(alias, name, length) == 0)
            return true;
        alias += end + strspn(alias + end, " ");
    }
    return strcmp(s->name, name) == 0 || (s->option != NULL && strcmp(s->option, name) == 0);
}

const gbt_train_setting *setting_find(const char *name)
{
    for (size_t i = 0; i < SETTING_COUNT; i++)
        if (is_named(&settings[i], name))
            return &settings[i];
    return NULL;
}
