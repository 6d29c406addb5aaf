/* SPDX-License-Identifier: Apache-2.0 */
/* report/chart.h -- the charts of the page as inline SVG: lines, bars, stacked areas. Colours and fonts come
   from the page's style sheet. */
#ifndef GBT_REPORT_CHART_H
#define GBT_REPORT_CHART_H

#include <stdbool.h>
#include <stddef.h>

#include "report/text.h"

/* Coordinates of a chart, which the page scales. They are few enough that text stays readable on a phone. */
enum {
    CHART_WIDTH = 460,
    CHART_HEIGHT = 268,
    CHART_LEFT = 50,
    CHART_RIGHT = 448,
    CHART_TOP = 26,
    CHART_BOTTOM = 224
};

typedef enum chart_style {
    CHART_LINE,  /* with a readout at the pointer */
    CHART_FAINT, /* the raw values behind a smoothed line */
    CHART_DOTS   /* one dot, with its own tooltip, per value */
} chart_style;

typedef struct chart_series {
    const char *name; /* NULL: not in the legend */
    const double *x, *y;
    size_t count; /* x ascending; non-finite values are skipped */
    int color;    /* 0 to 3: style sheet classes c0 to c3 */
    chart_style style;
} chart_series;

typedef struct line_chart {
    const char *title, *x_unit, *y_unit;
    const char *note; /* below the title; NULL: none */
    bool log_y, from_zero;
    int y_decimals; /* of the readout; -1: integers with separators */
    const chart_series *series;
    size_t series_count;
} line_chart;

typedef struct chart_bar {
    const char *name; /* escaped here */
    double value;     /* not finite or below 0: "n/a" */
    int color;        /* 0 to 8: style sheet classes s0 to s8 */
} chart_bar;

/* One layer of a stacked area chart. */
typedef struct chart_layer {
    const char *name; /* escaped here */
    const double *y;  /* [count] of the call of chart_stack() */
    int color;        /* as in chart_bar */
} chart_layer;

/** A <figure> with a line chart. Without a finite value it says that nothing was logged. Long series are
    averaged down to about one point per pixel. */
void chart_lines(text *out, const line_chart *chart);

/** Horizontal bars in the given order, each with its value and its share of `whole`. If `whole` is not above
    0, shares are of the sum. */
void chart_bars(text *out, const char *title, const char *unit, const chart_bar *bars, size_t count,
                double whole);

/** A stacked area chart over training time: at most 16 layers, the first at the bottom. Rows in which a layer
    is unknown are skipped. */
void chart_stack(text *out, const char *title, const char *x_unit, const char *y_unit, const double *x,
                 size_t count, const chart_layer *layers, size_t layer_count);

#endif
