/* SPDX-License-Identifier: Apache-2.0 */
/* study/crosscheck.h -- the study "crosscheck", tracer against rasterizer: what is measured, and its output.
 */
#ifndef GBT_STUDY_CROSSCHECK_H
#define GBT_STUDY_CROSSCHECK_H

#include <stdbool.h>

#include "base/image.h"
#include "benchmark/bench_reference.h"
#include "study/output.h"

enum { CROSS_MODELS_MAX = 16, CROSS_VIEWS_MAX = 4, CROSS_CHECKS = 7, CROSS_NAME_SIZE = 320 };

/** From the tracer to the splats of 3DGS, one change at a time; each step keeps the earlier changes. */
typedef enum cross_step {
    CROSS_TILES,
    CROSS_ORDER,
    CROSS_PROJECTION,
    CROSS_DILATION,
    CROSS_CUTS,
    CROSS_STEPS
} cross_step;

/** A value with a limit. */
typedef struct cross_check {
    const char *row;
    double limit, value; /* passes if value >= limit; NaN fails */
} cross_check;

typedef struct cross_view {
    char name[256], sheet[CROSS_NAME_SIZE]; /* name of the view; file name of its sheet of pictures */
    int width, height;
    size_t gaussians;
    bool stand_in; /* splats do not support the camera's lens: a pinhole replaced it */
    bench_error step[CROSS_STEPS], total[CROSS_STEPS]; /* to the previous step's picture; to the tracer's */
    bench_error traced, per_ray,
        splat; /* to the double-precision references, with the model's own cut-offs */
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

/** Factor by which differences are amplified for display; for CROSS_TILES, which changes rounding only, the
    second. */
enum { CROSS_AMPLIFIED = 8, CROSS_AMPLIFIED_TILES = 1000 };

/**
 * Write one PNG with eight pictures, four per row. First row: tracer, splats, their difference, the
 * difference of the step CROSS_TILES. Second row: the differences of order, projection, dilation and
 * cut-offs.
 *
 * @param traced   [in] the tracer's picture
 * @param pictures [in] the picture after each step
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_IO
 */
gbt_status cross_write_sheet(const image *traced, const image pictures[CROSS_STEPS], const char *path,
                             gbt_error *err);

/** The files that the study writes. */
extern const study_output cross_output;

#endif
