/* SPDX-License-Identifier: Apache-2.0 */
/* stability/stability.h -- the study "stability": scenes on which renderers are known to fail, what each is
   measured by, and the results.

   A case is a scene file (lab/stability/cases/<name>.json: Gaussians, numbers, checks with their limits) and
   a function that measures.
   To add one: a line in STABILITY_CASES, the file, and the function `gbt_status stability_<tag>(stability
   *s)` in a stability_*.c. The files are compiled into the library, so that the installed program has
   them. */
#ifndef GBT_STABILITY_STABILITY_H
#define GBT_STABILITY_STABILITY_H

#include <stdbool.h>

#include "base/gaussians.h"
#include "base/image.h"
#include "data/json_fields.h"

struct text; /* report/text.h */

#define STABILITY_CASES(X) /* X(tag, case, scene file without .json) */                                      \
    X(a1, "A1", "a01_turning")                                                                               \
    X(a2, "A2", "a02_needles")                                                                               \
    X(a3, "A3", "a03_inside")                                                                                \
    X(a4, "A4", "a04_coincident")                                                                            \
    X(a5, "A5", "a05_far_away")                                                                              \
    X(a6, "A6", "a06_many_hits")                                                                             \
    X(a7, "A7", "a07_saturation")                                                                            \
    X(a8, "A8", "a08_bad_values")                                                                            \
    X(a9, "A9", "a09_zoom")                                                                                  \
    X(a10, "A10", "a10_wide_angle")                                                                          \
    X(a11, "A11", "a11_rolling_shutter")                                                                     \
    X(a12, "A12", "a12_extrapolation")                                                                       \
    X(a13, "A13", "a13_poor_points")

enum {
    STABILITY_ROWS_MAX = 128,
    STABILITY_CASES_MAX = 32,
    STABILITY_CHARTS_MAX = 16,
    STABILITY_SERIES = 4,
    STABILITY_POINTS = 1024
};

/** A measured number and its limit. */
typedef struct stability_row {
    char id[8]; /* "A1a" */
    int part;   /* index into stability_study.parts */
    char quantity[160];
    bool at_least;       /* the limit is a lower one */
    double limit, value; /* finite limit; a value that is not finite fails */
    double raster;       /* the same quantity of the rasterizer; NaN: not measured, or it has none */
    bool pass;
    bool open;  /* the scene file says that the limit is not kept yet */
    bool timed; /* the value is a time: the study judges it, tests do not, since machines are shared */
    char note[400];
} stability_row;

/** What the rows of a case have in common. */
typedef struct stability_part {
    char id[8], title[96];
    char elsewhere[640], ours[640]; /* what goes wrong in other renderers and why; what is done here */
    double seconds;                 /* wall time of the case */
} stability_part;

typedef struct stability_series {
    const char *name; /* a literal; NULL: not used */
    size_t count;
    double x[STABILITY_POINTS], y[STABILITY_POINTS];
} stability_series;

typedef struct stability_chart {
    const char *title, *note, *x_unit, *y_unit; /* literals; the note says in one line what to see */
    bool log_x, log_y;
    stability_series series[STABILITY_SERIES]; /* 0: ours, 1: the rasterizer, 2 and 3: others */
} stability_chart;

typedef struct stability_study {
    stability_row rows[STABILITY_ROWS_MAX];
    stability_part parts[STABILITY_CASES_MAX];
    stability_chart charts[STABILITY_CHARTS_MAX];
    size_t row_count, part_count, chart_count;
    bool quick; /* smaller sizes where a scene file gives them */
} stability_study;

/** A case while it is measured. After a failure every call below is a no-op that gives 0, and `status` says
    why. */
typedef struct stability {
    stability_study *study;
    json_t *scene;
    char path[64];      /* of the scene file, for messages */
    const char *folder; /* results and work files go here; it exists */
    gbt_status status;
    gbt_error *err;
} stability;

/* ---- for cases ---- */

/** The number `name` of the scene file's object "numbers"; of its object "quick", if it is there, in a quick
    study. */
double stability_number(stability *s, const char *name);

/** A list of numbers from the same places; returns how many (1 to `most`). */
size_t stability_list(stability *s, const char *name, size_t most, double *out);

/** The Gaussians of the scene file ("gaussians": mean, scale, quat w x y z = 1 0 0 0, opacity, color),
    padded. Free with gaussians_free(). */
void stability_gaussians(stability *s, gaussians *out);

/**
 * Compare a value with the limit that the scene file gives for this row.
 *
 * @param row    [in] "A1a"; its quantity and limit come from "checks" of the file
 * @param raster [in] the rasterizer's value, NaN when there is none
 * @param note   [in] printf format: what else to know, "" for nothing
 */
void stability_check(stability *s, const char *row, double value, double raster, const char *note, ...)
    __attribute__((format(printf, 5, 6)));

/** A chart to fill with stability_point(); never NULL (a spare one when there are too many). All texts are
    literals. */
stability_chart *stability_new_chart(stability *s, const char *title, const char *note, const char *x_unit,
                                     const char *y_unit);

/** Add a point to a series; those beyond STABILITY_POINTS are dropped. */
void stability_point(stability_chart *chart, int series, double x, double y);

/** Keep the first failure. Returns whether all is well so far: `if (!stability_ok(s, call(..., s->err)))
    ...`. */
bool stability_ok(stability *s, gbt_status status);

/** Write a picture into the study's folder as "stability_<name>.png". */
void stability_picture(stability *s, const char *name, const image *picture);

/** The scene file is not as it should be: `what` is wrong with `field`. */
void stability_scene_fail(stability *s, const char *field, const char *what);

/* ---- for the study ---- */

/**
 * Measure the cases named in `only` ("A1,A9"; NULL: all) into `study`.
 *
 * @return GBT_OK also when rows fail their limits; GBT_ERR_ARGUMENT for an unknown case; GBT_ERR_FORMAT for a
 *         scene file that is not as it should be; GBT_ERR_IO, GBT_ERR_NO_MEMORY
 */
gbt_status stability_measure(const char *only, bool quick, const char *folder, stability_study *study,
                             gbt_error *err);

/** All charts as one SVG that stands alone. */
void stability_draw_charts(const stability_study *study, struct text *out);

/** The text of a scene file by name; NULL when there is none. Made by CMake from lab/stability/cases/. */
const char *stability_file(const char *name);

#define X(tag, id, file) gbt_status stability_##tag(stability *s);
STABILITY_CASES(X)
#undef X

#endif
