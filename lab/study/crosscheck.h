/* SPDX-License-Identifier: Apache-2.0 */
/* study/crosscheck.h -- the measurements of the study "tracer against rasterizer", and how they are written
   down. */
#ifndef GBT_STUDY_CROSSCHECK_H
#define GBT_STUDY_CROSSCHECK_H

#include <stdbool.h>

#include "base/image.h"
#include "benchmark/bench_reference.h"
#include "study/output.h"

enum { CROSS_MODELS_MAX = 16, CROSS_VIEWS_MAX = 4, CROSS_CHECKS = 7, CROSS_NAME_SIZE = 320 };

/** From the tracer to the splats of 3DGS, one change at a time; each keeps the changes before it. */
typedef enum cross_step {
    CROSS_TILES,
    CROSS_ORDER,
    CROSS_PROJECTION,
    CROSS_DILATION,
    CROSS_CUTS,
    CROSS_STEPS
} cross_step;

/** What is held to a limit. */
typedef struct cross_check {
    const char *row;
    double limit, value; /* value >= limit is a pass; NaN is none */
} cross_check;

typedef struct cross_view {
    char name[256], sheet[CROSS_NAME_SIZE]; /* of the view; file name of its pictures */
    int width, height;
    size_t gaussians;
    bool stand_in; /* the camera has a lens that splats cannot have: its pinhole was taken */
    bench_error step[CROSS_STEPS], total[CROSS_STEPS]; /* to the picture before; to the tracer's */
    bench_error traced, per_ray, splat; /* to the double references, with the model's own cut-offs */
    cross_check checks[CROSS_CHECKS];
} cross_view;

typedef struct cross_model {
    char name[256];
    cross_view views[CROSS_VIEWS_MAX];
    size_t view_count;
} cross_model;

typedef struct cross_study {
    cross_model models[CROSS_MODELS_MAX];
    size_t model_count;
} cross_study;

/** Differences are shown times this; the step CROSS_TILES, which is rounding alone, times the second. */
enum { CROSS_AMPLIFIED = 8, CROSS_AMPLIFIED_TILES = 1000 };

/**
 * One PNG of eight pictures, four across: tracer, splats, their difference, that of the tiles; order,
 * projection, dilation, cut-offs.
 *
 * @param traced   [in] the tracer's picture
 * @param pictures [in] after each step
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_IO
 */
gbt_status cross_write_sheet(const image *traced, const image pictures[CROSS_STEPS], const char *path,
                             gbt_error *err);

/** How it is written down. */
extern const study_output cross_output;

#endif
