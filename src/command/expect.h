/* SPDX-License-Identifier: Apache-2.0 */
/* command/expect.h -- predict memory and time of a training run, from constants that were measured. */
#ifndef GBT_COMMAND_EXPECT_H
#define GBT_COMMAND_EXPECT_H

#include <jansson.h>
#include <stdio.h>

#include "base/cpu.h"
#include "data/scene.h"
#include "train/memory_need.h"

typedef struct expectation {
    memory_need memory;
    double step_seconds;  /* one iteration, mean over the run */
    double score_seconds; /* to render, compare and write the held-out views */
    int threads;          /* for which the times hold */
} expectation;

/**
 * Predict a run with default settings, photos divided by `downscale` > 0, and a budget of `budget` > 0
 * seconds. Within 25 % on scenes and processors like those that were measured.
 */
expectation expect_training(const scene *s, double downscale, int threads, cpu_isa isa, double budget);

json_t *expect_to_json(const expectation *e);

/** Print the prediction for a person. */
void expect_print(const expectation *e, FILE *out);

#endif
