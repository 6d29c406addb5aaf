/* SPDX-License-Identifier: Apache-2.0 */
/* cli/train_options.c -- the options of a training run: the library's settings, and options of other
   programs, for which a message says what to use here. */
#include "cli/train_options.h"

#include <stdio.h>
#include <string.h>

#include "gbtrace/progress.h"

#define RATES(of) of "-lr-init " of "-lr-final " of "-lr-delay-mult " of "-lr-max-steps "

/* Options of other programs. */
static const option elsewhere[] = {
    /* 3DGS and Scaffold-GS. */
    {.name = "images",
     .kind = OPTION_ELSEWHERE,
     .aliases = "i",
     .help = "photos are found from the cameras; for smaller ones use --downscale F"},
    {.name = "white-background",
     .kind = OPTION_ELSEWHERE,
     .aliases = "w",
     .help = "use --alpha white (the default of Blender's scenes)"},
    {.name = "random-background",
     .kind = OPTION_ELSEWHERE,
     .help = "from the middle of a run on, half of the steps use one already; leave it out"},
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
     .aliases = "gpu debug debug-from detect-anomaly convert-SHs-python compute-cov3D-python optimizer-type",
     .help = "everything runs on the CPU; leave it out"},
    {.name = "ip",
     .kind = OPTION_ELSEWHERE,
     .aliases = "port disable-viewer",
     .help = "gbtrace view RUN shows a run while it trains"},
    {.name = "lambda-dssim", .kind = OPTION_ELSEWHERE, .help = "it is always 0.2; leave it out"},
    {.name = "densify-until-iter",
     .kind = OPTION_ELSEWHERE,
     .aliases = "update-until densify-from-iter start-stat update-from",
     .help = "use --grow-until F, a fraction of the run"},
    {.name = "densify-grad-threshold",
     .kind = OPTION_ELSEWHERE,
     .aliases = "densification-interval opacity-reset-interval percent-dense update-interval update-depth "
                "update-init-factor update-hierachy-factor success-threshold min-opacity",
     .help = "growth follows the length of the run; --max-anchors N limits it"},
    {.name = "position-lr-init",
     .kind = OPTION_ELSEWHERE,
     .aliases = "position-lr-final position-lr-delay-mult position-lr-max-steps feature-lr opacity-lr "
                "scaling-lr rotation-lr exposure-lr-init exposure-lr-final exposure-lr-delay-steps "
                "exposure-lr-delay-mult " RATES("offset") RATES("mlp-opacity") RATES("mlp-cov")
                    RATES("mlp-color") RATES("mlp-featurebank") RATES("appearance"),
     .help = "use --learning-rate F, which multiplies all rates"},
    {.name = "train-test-exp",
     .kind = OPTION_ELSEWHERE,
     .aliases = "appearance-dim",
     .help = "use --exposure"},
    {.name = "antialiasing",
     .kind = OPTION_ELSEWHERE,
     .help = "rays are as wide as pixels already (--footprint)"},
    {.name = "depths",
     .kind = OPTION_ELSEWHERE,
     .aliases = "depth-l1-weight-init depth-l1-weight-final",
     .help = "depth maps are not read; leave it out"},
    {.name = "add-opacity-dist",
     .kind = OPTION_ELSEWHERE,
     .aliases = "add-cov-dist add-color-dist",
     .help = "use --distance on"},
    {.name = "use-feat-bank",
     .kind = OPTION_ELSEWHERE,
     .aliases = "feat-dim lod warmup ratio undistorted",
     .help = "gbtrace has nothing like it; leave it out"},
};

enum { ELSEWHERE_COUNT = sizeof elsewhere / sizeof *elsewhere, NAME_SIZE = 32 };

static option_kind kind_of(const gbt_train_setting *s)
{
    switch (s->kind) {
    case GBT_SETTING_FLAG:
        return s->number != 0 ? OPTION_FLAG_OFF : OPTION_FLAG;
    case GBT_SETTING_INT:
        return OPTION_INT;
    case GBT_SETTING_UINT64:
        return OPTION_UINT64;
    case GBT_SETTING_BYTES:
        return OPTION_SIZE;
    case GBT_SETTING_FLOAT:
        return OPTION_FLOAT;
    case GBT_SETTING_DOUBLE:
        return OPTION_DOUBLE;
    case GBT_SETTING_SECONDS:
        return OPTION_DURATION;
    case GBT_SETTING_CHOICE:
        return OPTION_CHOICE;
    case GBT_SETTING_TEXT:
        break;
    }
    return OPTION_STRING;
}

static option row_of(const gbt_train_setting *s, void *value)
{
    option row = {.name = s->option != NULL ? s->option : s->name,
                  .kind = kind_of(s),
                  .value = value,
                  .min = s->or_zero ? 0 : s->min,
                  .max = s->max,
                  .choices = s->choices,
                  .value_name = s->unit,
                  .help = s->help,
                  .field = s->field,
                  .aliases = s->aliases,
                  .rare = s->rare};
    if (row.aliases != NULL && (row.aliases[1] == ' ' || row.aliases[1] == '\0')) {
        row.short_name = row.aliases[0];
        row.aliases = row.aliases[1] == ' ' ? row.aliases + 2 : NULL;
    }
    return row;
}

int train_options(gbt_train_def *def, option *out)
{
    static char names[OPTIONS_MAX][NAME_SIZE];
    int count = 0;
    for (size_t i = 0; i < gbt_train_setting_count(); i++, count++) {
        const gbt_train_setting *s = gbt_train_setting_at(i);
        out[count] = row_of(s, (char *)def + s->offset);
        if (out[count].kind == OPTION_FLAG_OFF) { /* a setting that is on by default gets an option that turns
                                                     it off */
            snprintf(names[count], NAME_SIZE, "no-%s", out[count].name);
            out[count].name = names[count];
        }
    }
    memcpy(out + count, elsewhere, sizeof elsewhere);
    return count + ELSEWHERE_COUNT;
}

option train_option(const char *name, void *value)
{
    size_t i = 0;
    while (strcmp(gbt_train_setting_at(i)->name, name) != 0)
        i++;
    return row_of(gbt_train_setting_at(i), value);
}

static gbt_status read_times(const char *eval_at, gbt_train_def *def, gbt_error *err)
{
    char list[512];
    if (snprintf(list, sizeof list, "%s", eval_at) >= (int)sizeof list) {
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
            def->eval_at_count == GBT_TRAIN_MAX_EVALS) {
            snprintf(err->text, sizeof err->text,
                     "--eval-at: \"%.80s\" (wanted up to %d increasing times, such as 1m,2m)", item,
                     GBT_TRAIN_MAX_EVALS);
            return GBT_ERR_ARGUMENT;
        }
        def->eval_at_seconds[def->eval_at_count++] = previous = seconds;
    }
    return GBT_OK;
}

gbt_status train_options_finish(gbt_train_def *def, const char *eval_at, const operands *given,
                                gbt_error *err)
{
    static char command_line[2048];
    char word[sizeof command_line];
    size_t used = (size_t)snprintf(command_line, sizeof command_line, "gbtrace train");
    for (int i = 0; i < given->argc && used < sizeof command_line; i++)
        used += (size_t)snprintf(command_line + used, sizeof command_line - used, " %s",
                                 gbt_shell_word(given->argv[i], word, sizeof word));
    def->command = command_line;
    return eval_at != NULL ? read_times(eval_at, def, err) : GBT_OK;
}
