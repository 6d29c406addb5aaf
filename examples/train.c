/* SPDX-License-Identifier: Apache-2.0 */
/* examples/train.c -- train on a folder of posed photos and score the result.

   Usage: train DATA RUN [ITERATIONS] */
#include <stdio.h>
#include <stdlib.h>

#include <gbtrace/evaluate.h>
#include <gbtrace/train.h>

int main(int argc, char **argv)
{
    gbt_error err = {0};
    gbt_train_def train = gbt_train_def_default();
    char *end = "";
    train.iterations = argc > 3 ? strtoul(argv[3], &end, 10) : 2000;
    if (argc < 3 || *end != '\0' || (argc > 3 && end == argv[3])) {
        fprintf(stderr, "usage: train DATA RUN [ITERATIONS]\n");
        return 2;
    }
    gbt_status status = gbt_train(argv[1], argv[2], &train, &err);
    if (status == GBT_OK) {
        const gbt_evaluate_def evaluate = gbt_evaluate_def_default();
        status = gbt_evaluate(argv[2], &evaluate, &err);
    }
    if (status == GBT_OK)
        printf("%s/report.html shows the held-out photos beside their renders\n", argv[2]);
    else
        fprintf(stderr, "error: %s\n", err.text);
    return gbt_status_exit_code(status);
}
