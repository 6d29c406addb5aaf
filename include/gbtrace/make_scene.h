/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/make_scene.h -- procedural scenes whose cameras, surfaces and depths are known exactly, written as
   a data set: a COLMAP model, or a transforms.json for rolling shutters. */
#ifndef GBTRACE_MAKE_SCENE_H
#define GBTRACE_MAKE_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

typedef enum gbt_make_scene_lens {
    GBT_MAKE_SCENE_PINHOLE,   /* PINHOLE, the default */
    GBT_MAKE_SCENE_DISTORTED, /* OPENCV with moderate distortion */
    GBT_MAKE_SCENE_FISHEYE,   /* FISHEYE, 180 degrees across the shorter side */
    GBT_MAKE_SCENE_PANORAMA,  /* EQUIRECTANGULAR, all around; the width should be twice the height */
    GBT_MAKE_SCENE_ROLLING    /* PINHOLE with a row-wise rolling shutter, hand-held: it moves and turns during
                                 read-out */
} gbt_make_scene_lens;
/** Names of the lenses, in the order of the enum. */
#define GBT_MAKE_SCENE_LENS_NAMES "pinhole|distorted|fisheye|panorama|rolling"

typedef struct gbt_make_scene_def {
    const char *name;   /* one of gbt_make_scene_names(). Default "tabletop". */
    int width, height;  /* photo size, pixels, [8, 8192]. Default 320 x 240. */
    int view_count;     /* photos, [3, 9999]. Default 64. */
    int points;         /* requested number of sparse points, [1, 10000000]. Default 6000. */
    double point_noise; /* std-dev per axis of a sparse point, as a fraction of its distance to the nearest
                           camera that saw it, [0, 0.1]. Default 0.001. */
    int samples;        /* maximum number of rays per pixel, rounded up to a square number, [1, 1024]. Default
                           16. */
    uint64_t seed;      /* of the camera jitter, the samples and the sparse cloud; the geometry is fixed.
                           Default 1. */
    bool depth;         /* also write exact depth, depth/NNNN.exr. Default false. */
    int gaussians;      /* also write gaussians.ply with this many flat Gaussians on the surfaces, [0,
                           1000000000]. Default 0. */
    gbt_make_scene_lens lens; /* of all cameras. Default GBT_MAKE_SCENE_PINHOLE. */
    uint32_t cookie_;         /* set by gbt_make_scene_def_default() */
} gbt_make_scene_def;

gbt_make_scene_def gbt_make_scene_def_default(void);

/** Names of the scenes, the default first; NULL-terminated, static. */
const char *const *gbt_make_scene_names(void);

/** What a scene shows, in one line; static. NULL for any other name. */
const char *gbt_make_scene_summary(const char *name);

/**
 * Render a procedural scene and write it as a data set that any COLMAP reader takes.
 *
 * Files: images/NNNN.png (8 bit, display-referred), sparse/0/{cameras,images,points3D}.bin (for rolling
 * shutters points.ply and transforms.json, as instant-ngp reads them), SCENE.md (what it shows and how it was
 * made; written first) and, with def->depth, depth/NNNN.exr: one float channel, the distance along the ray
 * through the pixel's centre from the camera centre to the first surface, scene units (not z), 0 where
 * nothing is hit; with def->gaussians, gaussians.ply: plain Gaussians of degree 3, 248 bytes each, spread
 * evenly over the surfaces, with the colours seen from the front. Those of an earlier scene are replaced,
 * others stay. Refused: a folder with images, sparse or transforms.json, but no SCENE.md; rolling shutters in
 * a folder with a sub-folder sparse.
 *
 * Every sparse point is a surface point that at least three views see, moved by Gaussian noise; its
 * observations are the projections of the unmoved point with 0.3 px of noise. One point in a hundred is an
 * outlier: it is moved along the ray of its first view. When the views do not overlap enough, there are fewer
 * points than requested.
 *
 * @param def    [in] copied
 * @param folder [in] created with its parents when missing
 * @param err    [out] optional
 * @return GBT_OK; GBT_ERR_ARGUMENT (value out of range, unknown name: the text lists the names); GBT_ERR_IO
 *         (cannot write); GBT_ERR_NO_MEMORY; GBT_ERR_INTERNAL (Embree failed). After a failure the folder may
 *         hold a part of the files.
 *
 * Threads: callable from any thread with distinct folders; same bytes for every thread count (for EXR files:
 * same values, their headers may contain the time).
 * Cost: at most view_count * width * height * samples camera rays (a pixel stops early when its first quarter
 * of samples agree) and as many shadow rays; below 16 samples the baked light is coarser too. Memory: one
 * image per thread, the scene (some tens of megabytes), and a byte per candidate point and view.
 */
gbt_status gbt_make_scene(const gbt_make_scene_def *def, const char *folder, gbt_error *err);

GBT_API_END
#endif
