/* SPDX-License-Identifier: Apache-2.0 */
/* study/chart.h -- a scatter chart as SVG: what each setting costs against what it gives. */
#ifndef GBT_STUDY_CHART_H
#define GBT_STUDY_CHART_H

#include <stdbool.h>
#include <stddef.h>

#include "report/text.h"

enum { SCATTER_WIDTH = 760, SCATTER_HEIGHT = 506, SCATTER_SERIES_MAX = 7 };

/* One measured setting. Series 0 are the named ones: large marks in the colour of the text. */
typedef struct scatter_point {
    int series;        /* 0 .. SCATTER_SERIES_MAX - 1 */
    double x, y;       /* x > 0; what is not finite is left out */
    const char *label; /* beside the mark, where there is room; always in its tooltip */
} scatter_point;

/* A height without an x: only its y was measured. */
typedef struct scatter_level {
    double y;
    const char *label;
} scatter_level;

typedef struct scatter_chart {
    const char *title, *note, *x_unit, *y_unit; /* escaped here */
    const char *series[SCATTER_SERIES_MAX];     /* names for the legend; NULL: not used */
    unsigned apart; /* bit per series whose points stand alone; those of the others are joined in their order
                     */
    const scatter_point *points;
    size_t point_count;
    const scatter_level *levels;
    size_t level_count;
} scatter_chart;

/** An SVG of scatter charts begins: plot_begin() with the rules of what scatter_draw() adds. `css`: further
 * rules, or "". */
void scatter_begin(text *out, const char *label, const char *css, int height);

/**
 * The chart as an SVG group, SCATTER_WIDTH x SCATTER_HEIGHT, its upper left corner at (0, top). Log x from
 * the points; y from points and levels.
 */
void scatter_draw(text *out, const scatter_chart *chart, int top);

#endif
