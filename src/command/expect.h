/* SPDX-License-Identifier: Apache-2.0 */
/* command/expect.h -- what training on a data set will ask of the machine: memory and time, from constants
   that were measured. */
#ifndef GBT_COMMAND_EXPECT_H
#define GBT_COMMAND_EXPECT_H

#include <jansson.h>
#include <stdio.h>

#include "base/cpu.h"
#include "data/scene.h"
#include "train/memory_need.h"

typedef struct expectation {
    memory_need memory;
    double step_seconds;  /* one iteration, the mean over the run */
    double score_seconds; /* the held-out views: rendered, compared, written */
    int threads;          /* that the times are for */
} expectation;

/**
 * Of a run with the default settings, photos divided by `downscale`, above 0, and a budget of `budget`
 * seconds, above 0. Good within a quarter on scenes and processors like those it was measured on.
 */
expectation expect_training(const scene *s, double downscale, int threads, cpu_isa isa, double budget);

json_t *expect_to_json(const expectation *e);

/** One line for a person. */
void expect_print(const expectation *e, FILE *out);

#endif
