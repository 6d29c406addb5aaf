/* SPDX-License-Identifier: Apache-2.0 */
/* study/chart.h -- a scatter chart as SVG: what each setting costs, and what it gains. */
#ifndef GBT_STUDY_CHART_H
#define GBT_STUDY_CHART_H

#include <stddef.h>

#include "report/text.h"

enum { SCATTER_WIDTH = 760, SCATTER_HEIGHT = 506, SCATTER_SERIES_MAX = 7 };

/* One measured setting. Series 0 is for points with a name: large marks in the text colour. */
typedef struct scatter_point {
    int series;        /* 0 .. SCATTER_SERIES_MAX - 1 */
    double x, y;       /* x > 0; non-finite points are left out */
    const char *label; /* shown beside the mark if there is room, and always in its tooltip */
} scatter_point;

/* A horizontal line, for a setting of which only y was measured. */
typedef struct scatter_level {
    double y;
    const char *label;
} scatter_level;

typedef struct scatter_chart {
    const char *title, *note, *x_unit, *y_unit; /* escaped here */
    const char *series[SCATTER_SERIES_MAX];     /* names for the legend; NULL: series not used */
    unsigned apart; /* one bit per series whose points are not joined; points of other series are joined in
                       their order */
    const scatter_point *points;
    size_t point_count;
    const scatter_level *levels;
    size_t level_count;
} scatter_chart;

/** Begin an SVG file of scatter charts: plot_begin() with the style rules of scatter_draw(). `css`: further
    rules, or "". */
void scatter_begin(text *out, const char *label, const char *css, int height);

/**
 * Draw a chart as an SVG group of SCATTER_WIDTH x SCATTER_HEIGHT with its upper left corner at (0, top). The
 * logarithmic x axis spans the points, the y axis points and levels.
 */
void scatter_draw(text *out, const scatter_chart *chart, int top);

#endif
