/* SPDX-License-Identifier: Apache-2.0 */
/* report/plot.h -- the basis of all charts, on the page and in studies: axes with round ticks, data to chart
   coordinates, polylines, and the frame of an SVG file. */
#ifndef GBT_REPORT_PLOT_H
#define GBT_REPORT_PLOT_H

#include <stdbool.h>

#include "report/text.h"

enum { CHART_MAX_TICKS = 16 };

/**
 * Ticks at round numbers, spaced by 1, 2 or 5 times a power of ten, that enclose [low, high]; about `wanted`
 * of them.
 *
 * @param low, high [in] finite, low <= high; if equal, one step around them
 * @param ticks     [out] [CHART_MAX_TICKS], ascending
 * @return how many, 2 to CHART_MAX_TICKS
 */
int chart_ticks(double low, double high, int wanted, double *ticks);

/** The same for a logarithmic axis: 1, 2 and 5 times powers of ten, or powers of ten only if there are many.
    0 < low <= high. */
int chart_log_ticks(double low, double high, double *ticks);

typedef struct plot_axis {
    const char *label; /* escaped here; NULL: none */
    bool log;
    bool from_ticks; /* the axis ends at round numbers; else with the values */
    bool grid;       /* a grid line at every tick */
    int wanted;      /* approximate number of ticks; 0: the axis is not drawn */
    double low, high;
    double ticks[CHART_MAX_TICKS];
    int tick_count;
} plot_axis;

/** Fill in the corners, and of the axes the fields before `low`. Then call plot_clear(), plot_take() for
    every value, plot_close(), and draw. */
typedef struct plot {
    int left, right, top, bottom;
    plot_axis x, y;
} plot;

void plot_clear(plot *p);

/** Whether a point is finite, small enough to be drawn, and above 0 on a logarithmic axis. */
bool plot_can_show(const plot *p, double x, double y);

/** Extend the axes to include a point; points that cannot be shown are ignored. */
void plot_take(plot *p, double x, double y);

/** Choose the ticks and the ends of the axes. False if there was no point. */
bool plot_close(plot *p);

double plot_x(const plot *p, double x);
double plot_y(const plot *p, double y);

/** Draw grid, ticks and labels: groups of the classes "grid", "y" and "x". */
void plot_draw_axes(text *out, const plot *p);

/** Append a point to the SVG path that is being written. Start with `*open` false; it is true afterwards. */
void plot_line_to(text *out, const plot *p, bool *open, double x, double y);

/** Begin an SVG file of class "plot", with a background and style rules for the light and the dark theme: for
    text (title, key), axes, and the colours of the classes s0 (that of text) to s6 as --k. `css` and `more`
    add rules ("": none). End the file with "</svg>". */
void plot_begin(text *out, const char *label, const char *css, const char *more, int width, int height);

#endif
