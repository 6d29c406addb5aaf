/* SPDX-License-Identifier: Apache-2.0 */
/* stability/stability.h -- the study "stability": scenes on which renderers are known to fail, measured
   against limits.

   A case is a scene file (lab/stability/cases/<name>.json: Gaussians, numbers, and checks with their limits)
   and a function that measures.

   To add one: an entry in STABILITY_CASES, the scene file, and a function
   `gbt_status stability_<tag>(stability *s)` in a file of this folder. The scene files are compiled into the
   library, so that the installed program does not need them. */
#ifndef GBT_STABILITY_STABILITY_H
#define GBT_STABILITY_STABILITY_H

#include <jansson.h>
#include <stdbool.h>

#include "base/gaussians.h"
#include "base/image.h"

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

/** One measured quantity and its limit. */
typedef struct stability_row {
    char id[8]; /* "A1a" */
    int part;   /* index into stability_study.parts */
    char quantity[160];
    bool at_least;       /* the limit is a lower bound */
    double limit, value; /* the limit is finite; a value that is not finite fails */
    double raster;       /* the rasterizer's value; NaN: it has none, or it was not measured */
    bool pass;
    bool open;  /* a known failure: the scene file says that the limit is not met yet */
    bool timed; /* the value is a time. Only the study judges it, not the tests, which may run on shared
                   machines */
    char note[400];
} stability_row;

/** What the rows of one case have in common. */
typedef struct stability_part {
    char id[8], title[96];
    char elsewhere[640], ours[640]; /* what goes wrong in other renderers and why; what is done here */
    double seconds;                 /* wall time of the case */
} stability_part;

typedef struct stability_series {
    const char *name; /* a literal; NULL: series not used */
    size_t count;
    double x[STABILITY_POINTS], y[STABILITY_POINTS];
} stability_series;

typedef struct stability_chart {
    const char *title, *note, *x_unit, *y_unit; /* literals; the note says in one line what there is to see */
    bool log_x, log_y;
    stability_series series[STABILITY_SERIES]; /* 0: ours, 1: the rasterizer, 2 and 3: others */
} stability_chart;

typedef struct stability_study {
    stability_row rows[STABILITY_ROWS_MAX];
    stability_part parts[STABILITY_CASES_MAX];
    stability_chart charts[STABILITY_CHARTS_MAX];
    size_t row_count, part_count, chart_count;
    bool quick; /* use the smaller sizes that scene files give for tests */
} stability_study;

/** A case while it runs. After a failure, which `status` keeps, every call below does nothing and returns 0.
 */
typedef struct stability {
    stability_study *study;
    json_t *scene;
    char path[64];      /* of the scene file, for error messages */
    const char *folder; /* existing folder for results and temporary files */
    gbt_status status;
    gbt_error *err;
} stability;

/* ---- for the cases ---- */

/** The number `name` in the scene file's object "numbers"; in a quick study, in its object "quick" if it is
    there. */
double stability_number(stability *s, const char *name);

/** A list of 1 to `most` numbers, from the same objects; returns how many. */
size_t stability_list(stability *s, const char *name, size_t most, double *out);

/** The Gaussians of the scene file, with padding ("gaussians": mean, scale, quat w x y z with default 1 0 0
    0, opacity, color). Free with gaussians_free(). */
void stability_gaussians(stability *s, gaussians *out);

/**
 * Compare a value with the limit in the scene file, and add a row.
 *
 * @param row    [in] "A1a"; its quantity and limit are in the file's "checks"
 * @param raster [in] the rasterizer's value, NaN if there is none
 * @param note   [in] printf format of a note, "" for none
 */
void stability_check(stability *s, const char *row, double value, double raster, const char *note, ...)
    __attribute__((format(printf, 5, 6)));

/** A new chart, to be filled by stability_point(). Never NULL: if there are too many, a spare one is
    returned. All texts must be literals. */
stability_chart *stability_new_chart(stability *s, const char *title, const char *note, const char *x_unit,
                                     const char *y_unit);

/** Add a point to a series. Points beyond STABILITY_POINTS are dropped. */
void stability_point(stability_chart *chart, int series, double x, double y);

/** Keep the first failure. Returns whether there has been none so far: `if (!stability_ok(s, call(...,
    s->err))) ...`. */
bool stability_ok(stability *s, gbt_status status);

/** Write a picture into the study's folder as "stability_<name>.png". */
void stability_picture(stability *s, const char *name, const image *picture);

/** Report an error in the scene file: `what` is wrong with `field`. */
void stability_scene_fail(stability *s, const char *field, const char *what);

/* ---- for the study ---- */

/**
 * Measure the cases named in `only` ("A1,A9"; NULL: all).
 *
 * @return GBT_OK, even if rows exceed their limits; GBT_ERR_ARGUMENT for an unknown case; GBT_ERR_FORMAT for
 * a faulty scene file; GBT_ERR_IO, GBT_ERR_NO_MEMORY
 */
gbt_status stability_measure(const char *only, bool quick, const char *folder, stability_study *study,
                             gbt_error *err);

/** All charts as one self-contained SVG. */
void stability_draw_charts(const stability_study *study, struct text *out);

/** The text of a scene file by name; NULL if there is none. CMake generates it from lab/stability/cases/. */
const char *stability_file(const char *name);

#define X(tag, id, file) gbt_status stability_##tag(stability *s);
STABILITY_CASES(X)
#undef X

#endif
