/* SPDX-License-Identifier: Apache-2.0 */
/* data/raw.h -- what a reader fills: views and points in the data set's own world, in double, before
   recentring; and the checks that every source shares. */
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
    size_t rank;       /* place in the sorted list, set by raw_sort_views(); stays when others are left out */
    uint32_t *seen;    /* [seen_count] the sparse points that are in the photo, by their tracks; owned */
    size_t seen_count, seen_capacity;
} raw_view;

typedef struct raw_scene {
    size_t view_count, view_capacity;
    raw_view *views;
    size_t point_count;
    double *position; /* [point_count][3], all usable */
    float *color;     /* [point_count][3] in [0, 1] */
    bool has_color;
    size_t points_dropped;     /* not finite, or beyond RAW_COORDINATE_LIMIT */
    size_t tracks_missing;     /* track entries that name an image which is not there */
    size_t trailing_bytes;     /* behind the last record */
    size_t photos_missing;     /* views left out because their photo is not there */
    bool has_masks;            /* there is a folder of masks */
    size_t file_bytes;         /* of the files that were read */
    char missing_names[256];   /* the first of them, ended by "..." when there are more */
    bool has_split;            /* the data set says which views are held out */
    size_t angles_disagreeing; /* transforms.json cameras whose camera_angle_x contradicts fl_x (which wins)
                                */
    char *missing_lines; /* the names of all views left out, each ended by a new line; NULL: none; owned */
    size_t missing_bytes, missing_capacity;
} raw_scene;

/** Larger coordinates mean nothing: a double keeps no tenth of a millimetre there, and float squares of them
    overflow. */
#define RAW_COORDINATE_LIMIT 1e12

enum { RAW_IMAGE_LIMIT = 65500, RAW_NAME_LIMIT = 4096 };

enum { RAW_MARK_FILE = 0, RAW_MARK_FRAME = '#' };

/** Where a message points: "FILE@OFFSET" (mark '@'), "FILE:LINE" (mark ':'), "FILE: frame N" (RAW_MARK_FRAME)
    or "FILE" (RAW_MARK_FILE). */
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

/** Room for one more view, zeroed; counted only by the caller. NULL without memory. */
raw_view *raw_next_view(raw_scene *raw, gbt_error *err);

/** Room for `count` points; point_count stays 0 and raw_add_point() fills. */
gbt_status raw_reserve_points(raw_scene *raw, size_t count, gbt_error *err);

/** Append a point, or count it as dropped when a coordinate is not usable. There must be room. */
void raw_add_point(raw_scene *raw, const double position[3], const float color[3]);

/** The point that raw_add_point() is going to be given is in the photo of raw->views[view]. One that is
   dropped is not. */
gbt_status raw_add_sighting(raw_scene *raw, size_t view, const double position[3], gbt_error *err);

/** How near the points in its photo come: the first percentile of their depths, for some are wrong; where the
    lens looks beside and behind itself, too, the fifth part of a percentile of their distances. 0: none is in
    front of the camera. */
gbt_status raw_nearest_depth(const raw_scene *raw, const raw_view *view, double *depth, gbt_error *err);

/** A relative path of 1..RAW_NAME_LIMIT bytes without control characters and without a ".." part. `what` is
    what messages call it. */
gbt_status raw_check_name(const char *what, const char *name, size_t length, raw_place place, gbt_error *err);

/** Size in 1..RAW_IMAGE_LIMIT, all parameters usable, focal lengths > 0. */
gbt_status raw_check_camera(const gbt_camera *camera, raw_place place, gbt_error *err);

/** Count a view whose photo is not there, and remember its name. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status raw_count_missing(raw_scene *raw, const char *name, gbt_error *err);

/** Two views of one name cannot be told apart later. Sorts the views by the bytes of their names, and ranks
    them. */
gbt_status raw_sort_views(raw_scene *raw, const char *file, gbt_error *err);

#endif
