/* SPDX-License-Identifier: Apache-2.0 */
/* data/scene.h -- what a data set says: cameras, photos, sparse points; recentred in double.

   Readers take bytes and fill a `scene`; scene_load() finds the files of a folder, reads them, recentres and
   splits. */
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
    char *path;        /* where the pixels are; owned. NULL: there are none (data/cameras_json.h) */
    char *mask_path;   /* a picture whose dark pixels say which ones of the photo mean nothing; NULL: none;
                          owned */
    gbt_alpha alpha;   /* see scene_set_alpha() */
    int photo_width;   /* as the photo's header says; 0: not read (photo_check_all()), or unreadable */
    bool has_alpha;    /* likewise: the photo has an alpha channel */
    bool is_exr;       /* likewise: of floats */
    gbt_camera camera; /* pose in scene-local coordinates; width and height as the data set states them */
    bool is_test;      /* held out */
    size_t rank; /* place in the sorted list of all views that the data set names, those without a photo too
                  */
    double nearest; /* depth of the nearest sparse points in the photo, by their tracks (raw_nearest_depth());
                       0: it has none */
    uint32_t *seen; /* [seen_count] sparse points in the photo, by their tracks, some where there are many;
                       owned */
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
    scene_view *views; /* sorted by name (bytes); of a cameras.json in its order */
    scene_points points;
    size_t points_dropped;   /* non-finite ones */
    size_t photos_missing;   /* views left out because their photo is not there */
    size_t file_bytes;       /* of the files that say all this, without photos */
    char missing_names[256]; /* of the first of them */
    bool has_split;          /* the data set itself says which views are held out */
    char *held_out_list; /* [held_out_bytes] SCENE_SPLIT_LIST: the list as it was read; else NULL; owned */
    size_t held_out_bytes;
    char *missing_lines; /* [missing_bytes] names of all views left out, each ended by a new line; owned */
    size_t missing_bytes;
} scene;

typedef enum scene_split_kind {
    SCENE_SPLIT_AUTO, /* as the data set says, else every 8th */
    SCENE_SPLIT_EVERY,
    SCENE_SPLIT_NONE,
    SCENE_SPLIT_LIST
} scene_split_kind;

typedef struct scene_split {
    scene_split_kind kind;
    int every;  /* SCENE_SPLIT_EVERY: of the sorted list, views offset, offset + every, ... are held out, a
                   missing photo does not shift them; >= 2. Default 8 */
    int offset; /* [0, every). Default 0 */
    const char *list_path; /* SCENE_SPLIT_LIST: text file, one image name per line */
    int validate_every;    /* > 0: constants are being chosen. Held-out views are not in the scene, and of the
                              others every N-th, in their order, is held out in their place. Default 0 */
    int validate_offset;   /* [0, validate_every): the first of them */
} scene_split;

/** As on the command line: "auto", "every=8", "every=8:3", "none" or "list=FILE"; "validate=8" or
    "validate=8:3" alone (then auto), or before it and a comma. list_path points into `text`. */
gbt_status scene_split_parse(const char *text, scene_split *out, gbt_error *err);

/**
 * Load a data set folder, or a .ply point cloud.
 *
 * A folder is COLMAP (sparse/0, sparse or the folder itself; binary preferred; images/ and perhaps masks/
 * beside it), or holds a transforms.json, or a transforms_train.json with its own held-out views in
 * transforms_test.json (or _val), or is COLMAP's in colmap/sparse/0. Views without a photo are left out,
 * counted and named in a warning; all of them: GBT_ERR_IO. Photos are not read here (scene_read_photo). The
 * origin is the median of the points (of the camera centres without points), so outliers cannot move it.
 *
 * @param split [in] NULL: SCENE_SPLIT_AUTO
 * @param out [out] free with scene_free(); zeroed on failure
 * Threads: any, with distinct `out`.
 */
gbt_status scene_load(const char *path, const scene_split *split, scene *out, gbt_error *err);

/** scene_load() with the origin 0: coordinates are the world's, rounded to float where they are points. */
gbt_status scene_load_in_place(const char *path, const scene_split *split, scene *out, gbt_error *err);

/** Forget the sparse points, and what they say of photos; `recentres`: the origin becomes that of a scene
    without points. GBT_OK or GBT_ERR_NO_MEMORY. */
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
 * Say what the transparent part of photos is: black or white, on which the photo lies, or a mask (pixels of
 * less than half opacity mean nothing, the others are opaque). GBT_ALPHA_AUTO is white for Blender's
 * synthetic scenes, as everybody scores them, else black. What scene_load() leaves counts as black.
 */
void scene_set_alpha(scene *s, gbt_alpha alpha);

/**
 * What is behind everything, when a training photo is transparent in places and lies on a colour: true, and
 * the colour. Cost: opens every training photo, reads up to four with an alpha channel.
 */
bool scene_background(const scene *s, float color[3]);

/**
 * Read one photo as 3-channel float, resized to `width` x `height` by exact area averaging (camera resized
 * alike: gbt_camera_resized()).
 *
 * The photo may differ from the camera's stated size if the aspect agrees within 1 px; it is then resampled
 * in one step. Alpha is treated as view->alpha says. Values that are not finite are 0.
 */
gbt_status scene_read_photo(const scene_view *view, int width, int height, image *out, gbt_error *err);

/**
 * scene_read_photo(), and which pixels mean something.
 *
 * @param valid [out] NULL when all do, else [height][width]: 0 where a value that is not finite, or a pixel
 *                    that the mask or the alpha channel (GBT_ALPHA_MASK) leaves out, had a part in it; free
 *                    with mem_free()
 */
gbt_status scene_read_photo_valid(const scene_view *view, int width, int height, image *out,
                                  unsigned char **valid, gbt_error *err);

/**
 * scene_read_photo_valid(), and what of the photo's alpha channel lies on a colour.
 *
 * @param transparency [out] 1 channel, how transparent each pixel is, [0, 1]; no pixels (NULL) when all are
 * opaque, or alpha is a mask; free with image_free()
 */
gbt_status scene_read_photo_transparency(const scene_view *view, int width, int height, image *out,
                                         unsigned char **valid, image *transparency, gbt_error *err);

/** Half the diagonal-like extent of the training cameras: 1.1 * max |c - mean c| (spatial_lr_scale); at least
    a small positive number. */
double scene_camera_extent(const scene *s);

#endif
