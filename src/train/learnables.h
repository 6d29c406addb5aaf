/* SPDX-License-Identifier: Apache-2.0 */
/* train/learnables.h -- everything of a model that learns: its rates and limits, listed once, and what a run
   keeps beside it (gradient, Adam moments).

   A new array of the anchors takes a line in anchor/anchors.h and a line of rates in learnables.c. */
#ifndef GBT_TRAIN_LEARNABLES_H
#define GBT_TRAIN_LEARNABLES_H

#include "anchor/anchors.h"
#include "growth/growth.h"

/** One number for each that a model learns: a gradient, or a moment of Adam. The position is unused. */
typedef struct learnables {
    anchors anchors;
    float *networks; /* [decoder.param_count] */
} learnables;

/** Zeros for a model of that shape. Start from {0}; free with learnables_free() after success or failure. */
gbt_status learnables_make(learnables *l, size_t anchor_count, const decoder *d, gbt_error *err);
void learnables_free(learnables *l);

/** All become 0. */
void learnables_zero(learnables *l, size_t param_count);

/** Rows follow the anchors; those of new anchors are 0. */
gbt_status learnables_follow(learnables *l, const growth_result *result, gbt_error *err);

typedef struct learning_rates {
    double anchor[ANCHOR_FIELDS]; /* of the fields that learn */
    double network[DECODER_NETWORKS];
    int views; /* of a step: adam_rates_of_views() */
} learning_rates;

/** What the rates of a step depend on. */
typedef struct learning_rates_def {
    double progress;      /* train_rules_progress() */
    bool own;             /* ours, higher, for runs of some thousand steps; else the reference method's */
    double geometry_from; /* offsets and scales have no rate before that progress */
    double extent;        /* of the cameras; the reference's rate of offsets is proportional to it */
    double factor;        /* of all rates */
    double end;           /* own: schedule_rate_end(), to which rates without an end of their own decay */
    int views;            /* of a step */
} learning_rates_def;

/** Log-linear decays, and in the end, from SCHEDULE_COOL_FROM on, straight to nearly nothing
    (docs/training.md). */
learning_rates learning_rates_at(const learning_rates_def *def);

/** A model in training: the values and what belongs to each. All borrowed. */
typedef struct learning_model {
    anchors *anchors;
    const uint64_t *created; /* [anchors->count], ascending: Adam steps of the anchors when this one was made
                              */
    decoder *decoder;
    learnables *gradient, *moment1, *moment2;
    float scale_log_min;        /* every log-scale is kept above this */
    const float *scale_log_max; /* [anchors->count]: and those of anchor i below this */
} learning_model;

/** One Adam step of the networks; `age` >= 1 counts it. Their gradient is 0 afterwards. */
void learn_networks(const learning_model *m, const learning_rates *rates, uint64_t age);

/** One Adam step of the anchors; `age` >= 1 counts the steps of the run. Their gradient is 0 afterwards.
    Threads: parallel inside, same bits for every number. */
void learn_anchors(const learning_model *m, const learning_rates *rates, uint64_t age);

#endif
