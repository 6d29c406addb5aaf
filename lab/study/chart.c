/* SPDX-License-Identifier: Apache-2.0 */
/* study/chart.c -- a scatter chart as SVG. Labels are placed where they cover neither a mark nor each other.
 */
#include "study/chart.h"

#include <math.h>
#include <string.h>

#include "report/plot.h"

enum { LEFT = 54, RIGHT = 738, TOP = 84, BOTTOM = 450, BOXES_MAX = 256 };

static const char scatter_css[] =
    ".plot .join{fill:none;stroke:var(--k);stroke-width:1.5;opacity:.45}\n"
    ".plot .mark{fill:var(--k);stroke:var(--page);stroke-width:1.5}\n"
    ".plot .label,.plot "
    ".level-label{font-size:11px;paint-order:stroke;stroke:var(--page);stroke-width:"
    "3px;stroke-linejoin:round}\n"
    ".plot .label{fill:var(--k)}.plot .label.s0{font-size:14px;font-weight:700}\n"
    ".plot .level{stroke:var(--dim);stroke-width:1;stroke-dasharray:5 4}.plot "
    ".level-label{font-style:italic}\n";

/* ---- placing labels ---- */

typedef struct box {
    double x0, y0, x1, y1;
} box;

typedef struct plane {
    plot plot;
    box taken[BOXES_MAX];
    int taken_count;
} plane;

static bool is_free(const plane *p, box b)
{
    if (b.x0 < LEFT + 1 || b.x1 > RIGHT + 16 || b.y0 < TOP - 8 || b.y1 > BOTTOM)
        return false;
    for (int i = 0; i < p->taken_count; i++)
        if (b.x0 < p->taken[i].x1 && b.x1 > p->taken[i].x0 && b.y0 < p->taken[i].y1 && b.y1 > p->taken[i].y0)
            return false;
    return true;
}

static void take(plane *p, box b)
{
    if (p->taken_count < BOXES_MAX)
        p->taken[p->taken_count++] = b;
}

/* Approximate width of a text; the letters of the fonts named above differ little. */
static double text_width(const char *label, bool large)
{
    return (large ? 8.4 : 6.3) * (double)strlen(label);
}

/* The first free position of a label around a mark of the given radius: right, left, above, below, the
   corners, then those above and below a line farther away: colours still say whose label it is. */
static bool find_room(plane *p, double x, double y, double radius, const char *label, bool large,
                      double *at_x, double *at_y)
{
    static const int sides[8][2] = {{1, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, -1}, {-1, -1}, {1, 1}, {-1, 1}};
    const double width = text_width(label, large), height = large ? 15 : 12, gap = radius + 3;
    for (int place = 0; place < 14; place++) {
        const int i = place < 8 ? place : place - 6;
        const double middle = y + sides[i][1] * (gap + (place < 8 ? height / 2 : 1.5 * height));
        const double start = sides[i][0] > 0   ? x + (sides[i][1] == 0 ? gap : 2)
                             : sides[i][0] < 0 ? x - width - (sides[i][1] == 0 ? gap : 2)
                                               : x - width / 2;
        const box b = {start - 1, middle - height / 2, start + width + 1, middle + height / 2};
        if (!is_free(p, b))
            continue;
        take(p, b);
        *at_x = start;
        *at_y = middle + (large ? 5 : 4);
        return true;
    }
    return false;
}

/* ---- drawing ---- */

static bool can_show(const plane *p, const scatter_point *point)
{
    return plot_can_show(&p->plot, point->x, point->y);
}

static bool find_plot(const scatter_chart *c, plot *p)
{
    *p = (plot){.left = LEFT,
                .right = RIGHT,
                .top = TOP,
                .bottom = BOTTOM,
                .x = {.label = c->x_unit, .log = true, .from_ticks = true, .grid = true, .wanted = 6},
                .y = {.label = c->y_unit, .from_ticks = true, .grid = true, .wanted = 6}};
    plot_clear(p);
    for (size_t i = 0; i < c->point_count; i++)
        plot_take(p, c->points[i].x, c->points[i].y);
    for (size_t i = 0; i < c->level_count; i++)
        plot_take(p, p->x.low, c->levels[i].y); /* has no effect if there is no point */
    return plot_close(p);
}

/* Open the tag of a mark: a large diamond for series 0, else a circle. */
static void draw_shape(text *out, int series, double x, double y)
{
    if (series == 0)
        text_format(out, "<path class=\"mark s0\" d=\"M%.1f %.1fl8 8l-8 8l-8 -8z\"", x, y - 8);
    else
        text_format(out, "<circle class=\"mark s%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"5\"", series, x, y);
}

static void draw_legend(text *out, const scatter_chart *c)
{
    double x = RIGHT;
    for (int s = SCATTER_SERIES_MAX - 1; s >= 0; s--) {
        if (c->series[s] == NULL)
            continue;
        x -= text_width(c->series[s], false) + 30;
        draw_shape(out, s, x + 14, 46);
        text_format(out, "/><text class=\"key\" x=\"%.1f\" y=\"%d\">", x + 25, 50);
        text_escaped(out, c->series[s]);
        text_add(out, "</text>");
    }
}

static void draw_joins(text *out, const scatter_chart *c, const plane *p)
{
    for (int s = 1; s < SCATTER_SERIES_MAX; s++) {
        bool open = false;
        if (c->apart >> s & 1)
            continue;
        text_format(out, "<path class=\"join s%d\" d=\"", s);
        for (size_t i = 0; i < c->point_count; i++)
            if (c->points[i].series == s && can_show(p, &c->points[i]))
                plot_line_to(out, &p->plot, &open, c->points[i].x, c->points[i].y);
        text_add(out, open ? "\"/>" : "M0 0\"/>");
    }
}

static void draw_mark(text *out, const scatter_chart *c, const plane *p, const scatter_point *point)
{
    const double x = plot_x(&p->plot, point->x), y = plot_y(&p->plot, point->y);
    draw_shape(out, point->series, x, y);
    text_add(out, "><title>");
    text_escaped(out, c->series[point->series]);
    text_add(out, " ");
    text_escaped(out, point->label);
    text_format(out, ": %.3g at %.1f</title>%s", point->x, point->y,
                point->series == 0 ? "</path>" : "</circle>");
}

static void draw_labels(text *out, const scatter_chart *c, plane *p, bool large)
{
    for (size_t i = 0; i < c->point_count; i++) {
        const scatter_point *point = &c->points[i];
        double x, y;
        if ((point->series == 0) != large || !can_show(p, point) || point->label[0] == '\0')
            continue;
        if (!find_room(p, plot_x(&p->plot, point->x), plot_y(&p->plot, point->y), large ? 9 : 5, point->label,
                       large, &x, &y))
            continue;
        text_format(out, "<text class=\"label s%d\" x=\"%.1f\" y=\"%.1f\">", point->series, x, y);
        text_escaped(out, point->label);
        text_add(out, "</text>");
    }
}

/* Dashed horizontal lines. Each has its label above or below it, as far to the right as there is room. */
static void draw_levels(text *out, const scatter_chart *c, plane *p)
{
    for (size_t i = 0; i < c->level_count; i++) {
        if (!isfinite(c->levels[i].y))
            continue;
        const double y = plot_y(&p->plot, c->levels[i].y), width = text_width(c->levels[i].label, false);
        text_format(out, "<line class=\"level\" x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\"/>", LEFT, y,
                    RIGHT, y);
        bool done = false;
        for (double x = RIGHT - width - 4; x > LEFT && !done; x -= 20)
            for (int side = 0; side < 2 && !done; side++) {
                const double middle = side == 0 ? y - 8 : y + 9;
                const box b = {x, middle - 6, x + width, middle + 6};
                done = is_free(p, b);
                if (!done)
                    continue;
                take(p, b);
                text_format(out, "<text class=\"level-label\" x=\"%.1f\" y=\"%.1f\">", x, middle + 4);
                text_escaped(out, c->levels[i].label);
                text_add(out, "</text>");
            }
    }
}

void scatter_begin(text *out, const char *label, const char *css, int height)
{
    plot_begin(out, label, scatter_css, css, SCATTER_WIDTH, height);
}

void scatter_draw(text *out, const scatter_chart *c, int top)
{
    plane p = {.taken_count = 0};
    text_format(out, "<g transform=\"translate(0 %d)\"><text class=\"title\" x=\"10\" y=\"24\">", top);
    text_escaped(out, c->title);
    text_format(out, "</text><text x=\"%d\" y=\"24\" text-anchor=\"end\">", RIGHT);
    text_escaped(out, c->note);
    text_add(out, "</text>");
    if (!find_plot(c, &p.plot)) {
        text_add(out, "<text x=\"58\" y=\"100\">n/a: nothing was measured.</text></g>");
        return;
    }
    draw_legend(out, c);
    plot_draw_axes(out, &p.plot);
    for (size_t i = 0; i < c->point_count; i++)
        if (can_show(&p, &c->points[i])) {
            const double x = plot_x(&p.plot, c->points[i].x), y = plot_y(&p.plot, c->points[i].y),
                         r = c->points[i].series == 0 ? 8 : 5;
            take(&p, (box){x - r, y - r, x + r, y + r});
        }
    draw_joins(out, c, &p);
    for (int pass = 0; pass < 2; pass++) /* the named points last, on top */
        for (size_t i = 0; i < c->point_count; i++)
            if (can_show(&p, &c->points[i]) && (c->points[i].series == 0) == (pass == 1))
                draw_mark(out, c, &p, &c->points[i]);
    draw_labels(out, c, &p, true);
    draw_levels(out, c, &p);
    draw_labels(out, c, &p, false);
    text_add(out, "</g>");
}
