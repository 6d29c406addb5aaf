/* SPDX-License-Identifier: Apache-2.0 */
/* study/chart.c -- a scatter chart as SVG. Labels go where they cover neither a mark nor each other. */
#include "study/chart.h"

#include <math.h>
#include <string.h>

#include "report/chart.h"

enum { LEFT = 58, RIGHT = 738, TOP = 84, BOTTOM = 450, BOXES_MAX = 256 };

const char scatter_css[] =
    ".scatter{--k0:#1b1c1e;--k1:#0b62c4;--k2:#d9480f;--k3:#2b8a3e;--k4:#7b3fc4;--k5:#b0246e;--k6:#0a7f8c;--"
    "page:#fff;--text:#1b1c1e;--dim:#62666d;--rule:#e8e8e5}\n"
    "@media(prefers-color-scheme:dark){.scatter{--k0:#f2f2f0;--k1:#6cb0ff;--k2:#ff9a5c;--k3:#6fd08c;--k4:#"
    "c19bff;--k5:#ff8cc2;--k6:#5fd3e0;--page:#1c1e22;--text:#e8e8e6;--dim:#9ba0a8;--rule:#2e3136}}\n"
    ".scatter .paper{fill:var(--page)}\n"
    ".scatter text{font:12px system-ui,-apple-system,\"Segoe UI\",Roboto,Arial,sans-serif;fill:var(--dim)}\n"
    ".scatter .title{font-size:15px;font-weight:600;fill:var(--text)}\n"
    ".scatter .tick-y{text-anchor:end}.scatter .tick-x{text-anchor:middle}\n"
    ".scatter .rule{stroke:var(--rule);stroke-width:1}.scatter .axis{stroke:var(--dim);stroke-width:1}\n"
    ".scatter .s0{--k:var(--k0)}.scatter .s1{--k:var(--k1)}.scatter .s2{--k:var(--k2)}.scatter "
    ".s3{--k:var(--k3)}.scatter .s4{--k:var(--k4)}.scatter .s5{--k:var(--k5)}.scatter .s6{--k:var(--k6)}\n"
    ".scatter .join{fill:none;stroke:var(--k);stroke-width:1.5;opacity:.45}\n"
    ".scatter .mark{fill:var(--k);stroke:var(--page);stroke-width:1.5}\n"
    ".scatter .label,.scatter "
    ".level-label{font-size:11px;paint-order:stroke;stroke:var(--page);stroke-width:3px;stroke-linejoin:"
    "round}\n"
    ".scatter .label{fill:var(--k)}.scatter .label.s0{font-size:14px;font-weight:700}\n"
    ".scatter .key{font-size:12px;fill:var(--text)}\n"
    ".scatter .level{stroke:var(--dim);stroke-width:1;stroke-dasharray:5 4}.scatter "
    ".level-label{font-style:italic}\n";

/* ---- room ---- */

typedef struct box {
    double x0, y0, x1, y1;
} box;

typedef struct plane {
    double x_low, x_high, y_low, y_high;
    box taken[BOXES_MAX];
    int taken_count;
} plane;

static double place_x(const plane *p, double x)
{
    return LEFT + (RIGHT - LEFT) * log(x / p->x_low) / log(p->x_high / p->x_low);
}

static double place_y(const plane *p, double y)
{
    return BOTTOM - (BOTTOM - TOP) * (y - p->y_low) / (p->y_high - p->y_low);
}

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

/* How wide a text gets; letters of the fonts named above differ little. */
static double text_width(const char *label, bool large)
{
    return (large ? 8.4 : 6.3) * (double)strlen(label);
}

/* The first free place around a mark of the given radius: right, left, above, below, then the corners. */
static bool find_room(plane *p, double x, double y, double radius, const char *label, bool large,
                      double *at_x, double *at_y)
{
    static const int sides[8][2] = {{1, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, -1}, {-1, -1}, {1, 1}, {-1, 1}};
    const double width = text_width(label, large), height = large ? 15 : 12, gap = radius + 3;
    for (int i = 0; i < 8; i++) {
        const double middle = y + sides[i][1] * (gap + height / 2);
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

static bool can_show(const scatter_point *point)
{
    return isfinite(point->x) && isfinite(point->y) && point->x > 0 && point->x < 1e30 &&
           fabs(point->y) < 1e30;
}

static bool find_range(const scatter_chart *c, plane *p)
{
    p->x_low = p->y_low = INFINITY;
    p->x_high = p->y_high = -INFINITY;
    for (size_t i = 0; i < c->point_count; i++)
        if (can_show(&c->points[i])) {
            p->x_low = fmin(p->x_low, c->points[i].x);
            p->x_high = fmax(p->x_high, c->points[i].x);
            p->y_low = fmin(p->y_low, c->points[i].y);
            p->y_high = fmax(p->y_high, c->points[i].y);
        }
    for (size_t i = 0; i < c->level_count; i++)
        if (isfinite(c->levels[i].y)) {
            p->y_low = fmin(p->y_low, c->levels[i].y);
            p->y_high = fmax(p->y_high, c->levels[i].y);
        }
    return p->x_low <= p->x_high;
}

static void draw_axes(text *out, const scatter_chart *c, plane *p)
{
    double ticks[CHART_MAX_TICKS];
    int count = chart_ticks(p->y_low, p->y_high, 6, ticks);
    p->y_low = ticks[0];
    p->y_high = ticks[count - 1];
    for (int i = 0; i < count; i++)
        text_format(out,
                    "<line class=\"rule\" x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\"/><text "
                    "class=\"tick-y\" x=\"%d\" y=\"%.1f\">%g</text>",
                    LEFT, place_y(p, ticks[i]), RIGHT, place_y(p, ticks[i]), LEFT - 8,
                    place_y(p, ticks[i]) + 4, ticks[i]);
    count = chart_log_ticks(p->x_low, p->x_high, ticks);
    p->x_low = ticks[0];
    p->x_high = ticks[count - 1];
    for (int i = 0; i < count; i++)
        text_format(out,
                    "<line class=\"rule\" x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/><text "
                    "class=\"tick-x\" x=\"%.1f\" y=\"%d\">%g</text>",
                    place_x(p, ticks[i]), TOP, place_x(p, ticks[i]), BOTTOM, place_x(p, ticks[i]),
                    BOTTOM + 18, ticks[i]);
    text_format(out,
                "<line class=\"axis\" x1=\"%d\" y1=\"%d\" x2=\"%d\" y2=\"%d\"/><text class=\"tick-x\" "
                "x=\"%d\" y=\"%d\">",
                LEFT, BOTTOM, RIGHT, BOTTOM, (LEFT + RIGHT) / 2, BOTTOM + 40);
    text_escaped(out, c->x_unit);
    text_format(out, "</text><text x=\"%d\" y=\"%d\">", 10, TOP - 14);
    text_escaped(out, c->y_unit);
    text_add(out, "</text>");
}

/* A mark, its tag left open: a large diamond for series 0, else a circle. */
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
            if (c->points[i].series == s && can_show(&c->points[i])) {
                text_format(out, "%s%.1f %.1f", open ? "L" : "M", place_x(p, c->points[i].x),
                            place_y(p, c->points[i].y));
                open = true;
            }
        text_add(out, open ? "\"/>" : "M0 0\"/>");
    }
}

static void draw_mark(text *out, const scatter_chart *c, const plane *p, const scatter_point *point)
{
    const double x = place_x(p, point->x), y = place_y(p, point->y);
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
        if ((point->series == 0) != large || !can_show(point) || point->label[0] == '\0')
            continue;
        if (!find_room(p, place_x(p, point->x), place_y(p, point->y), large ? 9 : 5, point->label, large, &x,
                       &y))
            continue;
        text_format(out, "<text class=\"label s%d\" x=\"%.1f\" y=\"%.1f\">", point->series, x, y);
        text_escaped(out, point->label);
        text_add(out, "</text>");
    }
}

/* Dashed heights, each with its words above or below it, as far right as there is room. */
static void draw_levels(text *out, const scatter_chart *c, plane *p)
{
    for (size_t i = 0; i < c->level_count; i++) {
        if (!isfinite(c->levels[i].y))
            continue;
        const double y = place_y(p, c->levels[i].y), width = text_width(c->levels[i].label, false);
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
    text_format(out,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"scatter\" viewBox=\"0 0 %d %d\" "
                "width=\"%d\" role=\"img\"",
                SCATTER_WIDTH, height, SCATTER_WIDTH);
    text_format(out, " aria-label=\"%s\"><style>", label);
    text_add(out, scatter_css);
    text_add(out, css);
    text_format(out, "</style><rect class=\"paper\" width=\"%d\" height=\"%d\" rx=\"12\"/>", SCATTER_WIDTH,
                height);
}

void scatter_draw(text *out, const scatter_chart *c, int top)
{
    plane p = {.taken_count = 0};
    text_format(out, "<g transform=\"translate(0 %d)\"><text class=\"title\" x=\"10\" y=\"24\">", top);
    text_escaped(out, c->title);
    text_format(out, "</text><text x=\"%d\" y=\"24\" text-anchor=\"end\">", RIGHT);
    text_escaped(out, c->note);
    text_add(out, "</text>");
    if (!find_range(c, &p)) {
        text_add(out, "<text x=\"58\" y=\"100\">n/a: nothing was measured.</text></g>");
        return;
    }
    draw_legend(out, c);
    draw_axes(out, c, &p);
    for (size_t i = 0; i < c->point_count; i++)
        if (can_show(&c->points[i])) {
            const double x = place_x(&p, c->points[i].x), y = place_y(&p, c->points[i].y),
                         r = c->points[i].series == 0 ? 8 : 5;
            take(&p, (box){x - r, y - r, x + r, y + r});
        }
    draw_joins(out, c, &p);
    for (int pass = 0; pass < 2; pass++) /* the named ones on top */
        for (size_t i = 0; i < c->point_count; i++)
            if (can_show(&c->points[i]) && (c->points[i].series == 0) == (pass == 1))
                draw_mark(out, c, &p, &c->points[i]);
    draw_labels(out, c, &p, true);
    draw_levels(out, c, &p);
    draw_labels(out, c, &p, false);
    text_add(out, "</g>");
}
