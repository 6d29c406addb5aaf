/* SPDX-License-Identifier: Apache-2.0 */
/* report/plot.h -- the engine of all charts, on the page and of studies: axes with round numbers, where a
   value is, lines between values, and the frame of an SVG file. */
#ifndef GBT_REPORT_PLOT_H
#define GBT_REPORT_PLOT_H

#include <stdbool.h>

#include "report/text.h"

enum { CHART_MAX_TICKS = 16 };

/**
 * Round numbers (1, 2 or 5 times a power of ten apart) that reach from at or below `low` to at or above
 * `high`, about `wanted` of them.
 *
 * @param low, high [in] finite, low <= high; equal: a step around them
 * @param ticks     [out] [CHART_MAX_TICKS], rising
 * @return how many, 2 to CHART_MAX_TICKS
 */
int chart_ticks(double low, double high, int wanted, double *ticks);

/** The same for a logarithmic axis: 1, 2 and 5 times powers of ten; powers alone when there are many. 0 < low
    <= high. */
int chart_log_ticks(double low, double high, double *ticks);

typedef struct plot_axis {
    const char *label; /* escaped here; NULL: none */
    bool log;
    bool from_ticks; /* begins and ends at round numbers; else with the values */
    bool grid;       /* a line across the plot at every tick */
    int wanted;      /* ticks, about; 0: this axis is not drawn */
    double low, high;
    double ticks[CHART_MAX_TICKS];
    int tick_count;
} plot_axis;

/** Set the corners, and of the axes what stands before `low`; then plot_clear(), plot_take() for every value,
    plot_close(), and draw. */
typedef struct plot {
    int left, right, top, bottom;
    plot_axis x, y;
} plot;

void plot_clear(plot *p);

/** Finite, of a size that can be drawn, above 0 on a logarithmic axis. */
bool plot_can_show(const plot *p, double x, double y);

/** Make room for a value, unless it cannot be shown. */
void plot_take(plot *p, double x, double y);

/** Find the ticks, and let the axes end where they shall. False without a value. */
bool plot_close(plot *p);

double plot_x(const plot *p, double x);
double plot_y(const plot *p, double y);

/** Grid, ticks and labels: groups of the classes "grid", "y" and "x". */
void plot_draw_axes(text *out, const plot *p);

/** Go on with the path that is being written, or begin it: `*open` is false then, and true afterwards. */
void plot_line_to(text *out, const plot *p, bool *open, double x, double y);

/** An SVG file begins, of class "plot", with its paper and its rules, light and dark: texts (title, key),
   axes, the colours of the classes s0 (that of texts) to s6 as --k; then `css` and `more` (""; more rules).
   "</svg>" ends it. */
void plot_begin(text *out, const char *label, const char *css, const char *more, int width, int height);

#endif
