/* SPDX-License-Identifier: Apache-2.0 */
/* cli/finish_run.c -- what follows training: compress the model, score it, write the report. */
#include "cli/finish_run.h"

#include <stdio.h>

#include "cli/progress.h"
#include "gbtrace/compress.h"
#include "gbtrace/evaluate.h"
#include "gbtrace/progress.h"
#include "gbtrace/train.h"

gbt_status finish_run(const char *run, bool tensorboard, gbt_error *err)
{
    char model[4096];
    int hold;
    gbt_status status = gbt_hold_run(run, &hold, err);
    if (status != GBT_OK)
        return status;
    if (snprintf(model, sizeof model, "%s/model.gbt", run) < (int)sizeof model) {
        gbt_compress_def small = gbt_compress_def_default();
        small.after_training = true;
        status = gbt_compress(run, &small, model, NULL, err);
    }
    gbt_evaluate_def score = gbt_evaluate_def_default();
    score.tensorboard = tensorboard;
    score.after_training = true;
    if (status == GBT_OK)
        status = gbt_evaluate(run, &score, err);
    gbt_release_run(hold);
    return status;
}

void finish_run_say(const char *run)
{
    char word[8192];
    if (progress_for_people())
        printf("Report: %s/report.html\nViewer: gbtrace view %s\n", run,
               gbt_shell_word(run, word, sizeof word));
}
