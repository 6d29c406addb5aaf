/* SPDX-License-Identifier: Apache-2.0 */
/* data/raw.h -- the result of a reader, before recentring: views and points in world coordinates, in double;
   and the checks that all readers share. */
#ifndef GBT_DATA_RAW_H
#define GBT_DATA_RAW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef struct raw_view {
    char *name;        /* owned */
    char *path;        /* owned; NULL until the photo has been found */
    char *mask_path;   /* owned; NULL: no mask */
    bool is_test;      /* held out by the data set itself (raw_scene.has_split) */
    gbt_camera camera; /* pose in world coordinates */
    uint32_t id;       /* COLMAP's image id, 0 elsewhere */
    size_t rank; /* index in the sorted list of all views, set by raw_sort_views(); unchanged when other views
                    are left out */
    uint32_t *seen; /* [seen_count] indices of the sparse points whose tracks contain this photo; owned */
    size_t seen_count, seen_capacity;
} raw_view;

typedef struct raw_scene {
    bool is_known; /* no warnings while it is loaded (scene_load_known()) */
    size_t view_count, view_capacity;
    raw_view *views;
    size_t point_count;
    double *position; /* [point_count][3], all finite and within RAW_COORDINATE_LIMIT */
    float *color;     /* [point_count][3] in [0, 1] */
    bool has_color;
    size_t points_dropped;     /* not finite, or beyond RAW_COORDINATE_LIMIT */
    size_t tracks_missing;     /* track entries that name a missing image */
    size_t trailing_bytes;     /* bytes behind the last record of a file */
    size_t photos_missing;     /* views left out because their photo is missing */
    bool has_masks;            /* there is a folder of masks */
    size_t file_bytes;         /* total size of the files that were read */
    char missing_names[256];   /* the first of the views left out, followed by "..." when there are more */
    bool has_split;            /* the data set says which views are held out */
    size_t angles_disagreeing; /* cameras of a transforms.json whose camera_angle_x contradicts fl_x; fl_x is
                                  used */
    bool has_odd_transform;    /* applied_transform of a transforms.json is not a rotation with a scale */
    char *missing_lines; /* the names of all views left out, each followed by a newline; NULL: none; owned */
    size_t missing_bytes, missing_capacity;
} raw_scene;

/** Larger coordinates are rejected: there a double no longer resolves a tenth of a millimetre, and squares in
    float soon overflow. */
#define RAW_COORDINATE_LIMIT 1e12

enum { RAW_IMAGE_LIMIT = 65500, RAW_NAME_LIMIT = 4096 };

enum { RAW_MARK_FILE = 0, RAW_MARK_FRAME = '#' };

/** Where in a file an error is: "FILE@OFFSET" (mark '@'), "FILE:LINE" (mark ':'), "FILE: frame N"
    (RAW_MARK_FRAME) or "FILE" (RAW_MARK_FILE). */
typedef struct raw_place {
    const char *file;
    char mark;
    size_t at;
} raw_place;

gbt_status raw_fail(gbt_error *err, raw_place place, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

void raw_view_free(raw_view *view); /* zeroes the struct */
void raw_free(raw_scene *raw);

/** A zero-terminated copy of `length` bytes, owned by the caller (mem_free()); NULL without memory. */
char *raw_copy_text(const char *text, size_t length, gbt_error *err);

/** Room for one more view, zeroed; the caller increments view_count. NULL without memory. */
raw_view *raw_next_view(raw_scene *raw, gbt_error *err);

/** Allocate room for `count` points. point_count stays 0; raw_add_point() increments it. */
gbt_status raw_reserve_points(raw_scene *raw, size_t count, gbt_error *err);

/** Append a point, or count it as dropped when it has an unusable coordinate. There must be room. */
void raw_add_point(raw_scene *raw, const double position[3], const float color[3]);

/** Record that raw->views[view] sees the point which is passed to raw_add_point() next. Does nothing if that
    point is going to be dropped. */
gbt_status raw_add_sighting_of_next(raw_scene *raw, size_t view, const double position[3], gbt_error *err);

/** How near the sparse points seen in a photo come to its camera: the first percentile of their depths,
    because a few points are wrong; for lenses that also look sideways and back, a fifth of a percentile of
    their distances. 0 when no point is in front of the camera. */
gbt_status raw_nearest_depth(const raw_scene *raw, const raw_view *view, double *depth, gbt_error *err);

/** Check that `name` is a relative path of 1..RAW_NAME_LIMIT bytes without control characters and without a
    ".." part. Messages call it `what`. */
gbt_status raw_check_name(const char *what, const char *name, size_t length, raw_place place, gbt_error *err);

/** Check that width and height are in 1..RAW_IMAGE_LIMIT, all parameters usable and focal lengths > 0. */
gbt_status raw_check_camera(const gbt_camera *camera, raw_place place, gbt_error *err);

/** Count a view whose photo is missing, and remember its name. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status raw_count_missing(raw_scene *raw, const char *name, gbt_error *err);

/** Sort the views by the bytes of their names, and set their ranks. Duplicate names are an error, because
    such views could not be told apart later. */
gbt_status raw_sort_views(raw_scene *raw, const char *file, gbt_error *err);

#endif
