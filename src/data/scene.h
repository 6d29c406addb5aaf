/* SPDX-License-Identifier: Apache-2.0 */
/* data/scene.h -- a loaded data set: cameras, photos and sparse points in coordinates relative to an origin.

   Readers turn bytes into a raw_scene (data/raw.h). scene_load() finds the files of a data set, runs the
   right reader, subtracts the origin in double precision and splits the views into training and held-out
   ones. */
#ifndef GBT_DATA_SCENE_H
#define GBT_DATA_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/image.h"
#include "base/memory.h"
#include "gbtrace/camera.h"
#include "gbtrace/choices.h"
#include "gbtrace/status.h"

typedef struct scene_view {
    char *name;        /* image name as the data set gives it, may hold sub-folders; owned */
    char *path;        /* file with the pixels; owned. NULL: there is none (data/cameras_json.h) */
    char *mask_path;   /* image whose dark pixels exclude the photo's pixels there; NULL: none; owned */
    gbt_alpha alpha;   /* see scene_set_alpha() */
    int photo_width;   /* from the photo's header; 0: not read yet (photo_check_all()), or unreadable */
    bool has_alpha;    /* likewise; the photo has an alpha channel */
    bool is_exr;       /* likewise; the photo is an EXR file */
    gbt_camera camera; /* pose in scene-local coordinates; width and height as the data set states them */
    bool is_test;      /* held out */
    size_t rank; /* index in the sorted list of all views of the data set, including those without a photo */
    double nearest; /* depth of the nearest sparse points that the photo sees (raw_nearest_depth()); 0: none
                     */
    uint32_t *seen; /* [seen_count] indices of sparse points that the photo sees, by their tracks; a subset
                       where there are many; owned */
    size_t seen_count;
} scene_view;

enum { SCENE_SEEN_MAX = 4000 };

typedef struct scene_points {
    size_t count;
    float *position; /* [count][3], scene-local; all finite */
    float *color;    /* [count][3] in [0, 1] */
    bool has_color;  /* false: `color` is mid grey, because the source has none */
} scene_points;

typedef struct scene {
    char *folder;     /* as given; owned */
    char source[32];  /* "colmap-bin", "colmap-txt", "transforms", "blender" or "ply" */
    double origin[3]; /* subtracted from every coordinate: world = local + origin */
    size_t view_count;
    scene_view *views; /* sorted by name (bytes); those of a cameras.json in file order */
    scene_points points;
    size_t points_dropped;   /* not finite, or beyond RAW_COORDINATE_LIMIT */
    size_t photos_missing;   /* views left out because their photo is missing */
    size_t file_bytes;       /* total size of the data set's files, without photos */
    char missing_names[256]; /* the first of those views */
    bool has_split;          /* the data set itself says which views are held out */
    char *held_out_list; /* [held_out_bytes] with SCENE_SPLIT_LIST, the contents of the list file; else NULL;
                            owned */
    size_t held_out_bytes;
    size_t listed_missing; /* names in that file whose photo is missing */
    char *missing_lines; /* [missing_bytes] names of all views left out, each followed by a newline; owned */
    size_t missing_bytes;
} scene;

typedef enum scene_split_kind {
    SCENE_SPLIT_AUTO, /* as the data set says, else every 8th view is held out */
    SCENE_SPLIT_EVERY,
    SCENE_SPLIT_NONE,
    SCENE_SPLIT_LIST
} scene_split_kind;

typedef struct scene_split {
    scene_split_kind kind;
    int every;  /* SCENE_SPLIT_EVERY: views offset, offset + every, ... of the sorted list are held out; a
                   missing photo does not shift them. >= 2. Default 8 */
    int offset; /* [0, every). Default 0 */
    const char *list_path; /* SCENE_SPLIT_LIST: text file, one image name per line */
    int validate_every;    /* > 0: validation, for choosing settings. Held-out views are removed from
                              the scene; of the others, every N-th is held out instead. Default 0 */
    int validate_offset;   /* [0, validate_every): index of the first view held out for validation */
} scene_split;

/** Parse a split from the command line: "auto", "every=8", "every=8:3", "none" or "list=FILE"; or
    "validate=8" or "validate=8:3", either alone (which implies auto) or followed by a comma and one of those.
    list_path points into `text`. */
gbt_status scene_split_parse(const char *text, scene_split *out, gbt_error *err);

/** GBT_ERR_IO when there is nothing at the path of a data set. */
gbt_status scene_need(const char *path, gbt_error *err);

/**
 * Load a data set folder, a transforms.json or a .ply point cloud.
 *
 * A folder may hold a COLMAP model (in sparse/0, sparse or the folder itself; binary preferred; with images/
 * and perhaps masks/ beside it); or a transforms.json; or a transforms_train.json with the held-out views in
 * transforms_test.json (or _val); or a COLMAP model in colmap/sparse/0. They are tried in this order. Views
 * without a photo are left out, counted and named in a warning; if all are: GBT_ERR_IO. Photos are not read
 * here (scene_read_photo()). The origin is the median of the points (of the camera centres if there are
 * none), which outliers cannot move.
 *
 * @param split [in] NULL: SCENE_SPLIT_AUTO
 * @param out [out] free with scene_free(); zeroed on failure
 * Threads: any, with distinct `out`.
 */
gbt_status scene_load(const char *path, const scene_split *split, scene *out, gbt_error *err);

/** scene_load() of a data set that the same command has loaded before: its warnings are not repeated. */
gbt_status scene_load_known(const char *path, const scene_split *split, scene *out, gbt_error *err);

/** scene_load() with origin 0: coordinates are the world's. Points are rounded to float. */
gbt_status scene_load_in_place(const char *path, const scene_split *split, scene *out, gbt_error *err);

/** Discard the sparse points and what is known about which photos see them. `recentres`: the origin becomes
    that of a scene without points. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status scene_forget_points(scene *s, bool recentres, gbt_error *err);

void scene_free(scene *s);
static inline void scene_view_free(scene_view *view)
{
    mem_free(view->name);
    mem_free(view->path);
    mem_free(view->mask_path);
    mem_free(view->seen);
    *view = (scene_view){0};
}

/**
 * Set how the alpha channel of photos is used: composite them on black or white, or use it as a mask (pixels
 * below half opacity are excluded, the others are opaque). GBT_ALPHA_AUTO is white for Blender's synthetic
 * scenes, as is usual for their scores, else black. Without this call it is black.
 */
void scene_set_alpha(scene *s, gbt_alpha alpha);

/**
 * The background colour that composited photos imply: true and the colour, if a training photo is partly
 * transparent and alpha is not a mask. Cost: opens training photos until it has read up to four with an alpha
 * channel.
 */
bool scene_background(const scene *s, float color[3]);

/**
 * Read one photo as 3-channel float, resized to `width` x `height` by exact area averaging
 * (gbt_camera_resized() resizes the camera accordingly).
 *
 * The photo may differ from the camera's stated size if the aspect agrees within 1 px; it is then resampled
 * in one step. view->alpha says how alpha is used. Values that are not finite become 0.
 */
gbt_status scene_read_photo(const scene_view *view, int width, int height, image *out, gbt_error *err);

/**
 * scene_read_photo(), and which pixels are valid.
 *
 * @param valid [out] NULL when all are, else [height][width] with 0 for pixels whose area contains a value
 *                    that is not finite, or a pixel excluded by the mask or the alpha channel
 *                    (GBT_ALPHA_MASK); free with mem_free()
 */
gbt_status scene_read_photo_valid(const scene_view *view, int width, int height, image *out,
                                  unsigned char **valid, gbt_error *err);

/**
 * scene_read_photo_valid(), and the transparency of the photo where it is composited on a colour.
 *
 * @param transparency [out] 1 channel, 1 - alpha of each pixel, [0, 1]; no pixels (NULL) when the photo is
 *                           opaque, or alpha is a mask; free with image_free()
 */
gbt_status scene_read_photo_transparency(const scene_view *view, int width, int height, image *out,
                                         unsigned char **valid, image *transparency, gbt_error *err);

/** The scene extent of 3DGS (spatial_lr_scale) from the training cameras: 1.1 * max |c - mean c|, but always
    positive. */
double scene_camera_extent(const scene *s);

#endif
