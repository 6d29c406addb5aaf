/* SPDX-License-Identifier: Apache-2.0 */
/* report/axes.h -- what the charts of the page share: their size, their axes, where a value is. */
#ifndef GBT_REPORT_AXES_H
#define GBT_REPORT_AXES_H

#include "report/chart.h"

/* A chart in its own units; the page scales it. Small enough that its text can still be read on a phone. */
enum {
    CHART_WIDTH = 460,
    CHART_HEIGHT = 268,
    CHART_LEFT = 50,
    CHART_RIGHT = 448,
    CHART_TOP = 26,
    CHART_BOTTOM = 224
};

typedef struct chart_axes {
    double x_low, x_high, y_low, y_high;
    bool log_y;
} chart_axes;

double chart_place_x(const chart_axes *a, double x);
double chart_place_y(const chart_axes *a, double y);
bool chart_can_show(const line_chart *c, double x, double y); /* finite, of a size that can be drawn, above 0
                                                                 on a logarithmic axis */
bool chart_is_amount(double value);                           /* finite, >= 0, of a size that can be drawn */

/** What the series reach; false without a value. */
bool chart_find_range(const line_chart *c, chart_axes *a);

/** Axes that end at ticks; x starts at 0 (the run does), ends with the data. Sets the ranges of `a` to
    that. */
void chart_draw_axes(text *out, const line_chart *c, chart_axes *a);

#endif
