/* SPDX-License-Identifier: Apache-2.0 */
/* train/learnables.h -- all trainable parameters of a model: learning rates and limits, listed once, and
   arrays of the same shape (gradient, Adam moments).

   A new array of the anchors takes a line in anchor/anchors.h and a line of rates in learnables.c. */
#ifndef GBT_TRAIN_LEARNABLES_H
#define GBT_TRAIN_LEARNABLES_H

#include "anchor/anchors.h"
#include "growth/growth.h"

/** One number per trainable parameter: a gradient, or an Adam moment. The position is unused. */
typedef struct learnables {
    anchors anchors;
    float *networks; /* [decoder.param_count] */
} learnables;

/** Zeros for a model of that shape. Start from {0}; free with learnables_free() after success or failure. */
gbt_status learnables_make(learnables *l, size_t anchor_count, const decoder *d, gbt_error *err);
void learnables_free(learnables *l);

/** Set all to 0. */
void learnables_zero(learnables *l, size_t param_count);

/** Reorder rows as the anchors of a growth round; rows of new anchors are 0. */
gbt_status learnables_follow(learnables *l, const growth_result *result, gbt_error *err);

typedef struct learning_rates {
    double anchor[ANCHOR_FIELDS]; /* of the trainable fields */
    double network[DECODER_NETWORKS];
    int views; /* views per step: adam_rates_of_views() */
} learning_rates;

/** What the rates of a step depend on. */
typedef struct learning_rates_def {
    double progress;     /* train_rules_progress() */
    bool uses_own_rates; /* our higher rates, for runs of some thousand steps; false: the reference's */
    bool geometry_stays; /* the rates of offsets and scales are 0 */
    double extent;       /* camera extent; the reference's rate of offsets is proportional to it */
    double factor;       /* multiplies all rates */
    double end;          /* with `own`: schedule_rate_end(), the final fraction of rates that have no end
                            value in the table */
    int views;           /* of a step */
} learning_rates_def;

/** Rates decay log-linearly and, from SCHEDULE_COOL_FROM on, in addition linearly to nearly 0
    (docs/training.md). */
learning_rates learning_rates_at(const learning_rates_def *def);

/** A model in training: its parameters with gradients, moments and limits. All borrowed. */
typedef struct learning_model {
    anchors *anchors;
    const uint64_t *created; /* [anchors->count], ascending: number of Adam steps of the anchors when this
                                anchor was made */
    decoder *decoder;
    learnables *gradient, *moment1, *moment2;
    float scale_log_min;        /* lower limit of every log-scale */
    const float *scale_log_max; /* [anchors->count]: upper limit of the log-scales of each anchor */
} learning_model;

/** One Adam step of the networks, number `age` >= 1. Their gradient is 0 afterwards. */
void learn_networks(const learning_model *m, const learning_rates *rates, uint64_t age);

/** One Adam step of the anchors, number `age` >= 1 of the run. Their gradient is 0 afterwards.
    Threads: parallel inside, same bits for every number. */
void learn_anchors(const learning_model *m, const learning_rates *rates, uint64_t age);

#endif
