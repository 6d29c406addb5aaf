/* SPDX-License-Identifier: Apache-2.0 */
/* trace/rays.h -- the rays of one view: of a camera that stands still, or moves while it is read out, or has
   an open aperture; or given rays. */
#ifndef GBT_TRACE_RAYS_H
#define GBT_TRACE_RAYS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/camera_lens.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/** Coordinates of a ray's origin are below it: squares of them have to stay finite in float. */
#define RAY_ORIGIN_LIMIT 1e17

enum { RAY_LENSES = 64 /* a photo trained on every eighth pixel of rows and columns is 64 lenses */ };

/** What a lens makes of the pixel centres: directions in camera axes, [height * width][3]; owned. */
typedef struct ray_lens {
    gbt_camera camera;
    double *dir; /* NULL: none yet */
} ray_lens;

/** Row-major. A ray with a zero direction is invalid, and for the tracer also one that is not ray_is_sound():
    it sees the background, and its transmittance is 1. */
typedef struct ray_image {
    int width, height;
    float *origin; /* [3] when shared by all rays (common_origin), else [height * width][3]; scene-local
                      units; owned */
    float *dir;    /* [height * width][3], unit (to float rounding) or zero; owned */
    bool common_origin;
    float *far; /* [height * width] or NULL: nothing at this distance or behind it is seen (a surface stands
                   there); owned */
    /* A part of each ray, when `near` is not NULL; [height * width] both, owned: */
    float *near;      /* nothing nearer than this distance is seen; not below `far`: nothing at all */
    float *T_front;   /* transmittance of what lies before the part: T starts from it */
    camera_lens lens; /* prepared, of the shot's camera; fx is 0 when the rays were given */
    /* Kept by ray_image_from_shot() for the next poses of the same lenses, of any size. */
    ray_lens lenses[RAY_LENSES];
    int next_lens; /* the one to be replaced */
} ray_image;

/** How one picture is taken. Start from ray_shot_of(). Lengths in scene-local units. */
typedef struct ray_shot {
    gbt_camera camera; /* lens, size, pose, and its motion while a rolling shutter reads it out */
    bool one_start;    /* all rays of a rolling shutter start at the centre of the camera's own pose, and keep
                          their directions. Default false */
    double aperture_radius; /* >= 0; 0, the default, is a pinhole */
    double focus_distance;  /* > 0 when there is an aperture: depth of the plane in focus, or its radius where
                               it is a sphere */
    int samples; /* per pixel, over the aperture; >= 1. Default 64; without an aperture one is enough, and is
                    all there is */
    uint64_t seed;          /* of the points on the aperture. Default 0 */
    const ray_image *given; /* borrowed: these rays, in place of all above. Default NULL */
} ray_shot;

static inline ray_shot ray_shot_of(const gbt_camera *camera)
{
    return (ray_shot){.camera = *camera, .samples = 64};
}

/** Number of different ray images of a shot: its picture is their mean. */
static inline int ray_shot_sample_count(const ray_shot *shot)
{
    return shot->given == NULL && shot->aperture_radius > 0 ? shot->samples : 1;
}

/** GBT_OK, or GBT_ERR_ARGUMENT with what is wrong: see ray_image_from_shot(). */
gbt_status ray_shot_check(const ray_shot *shot, gbt_error *err);

/**
 * The rays of sample `sample` of a shot through the pixel centres, in world axes.
 *
 * Everything is computed in double and rounded once. A pixel where the lens has no ray gets a zero direction.
 * Formulas: docs/cameras.md.
 * - Line i of n (row or column) of a rolling shutter is taken (i + 0.5) / n of the readout after its start.
 * - The aperture is cut into N cells of the same area; sample s of N leaves it at a point of cell s, drawn
 *   evenly for (seed, s, pixel). It goes through the point that the ray through the middle of the aperture
 *   has in focus.
 *
 * @param sample [in] 0 .. ray_shot_sample_count() - 1
 * @param out    [in,out] start from {0}, free with ray_image_free(); its arrays are reused when the size
 *                        is the same, its lenses always; empty on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (a size < 1, a camera that sees nothing, a pose that is not finite or not
 *         a rotation, rays that start beyond 1e17, an aperture without a focus), GBT_ERR_NO_MEMORY
 * Threads: runs in parallel over rows; same bits for every thread count.
 * Cost: 0.4 to 1 ms of one core per 10^5 rays of a pinhole or orthographic camera, also when it moves by
 * rows; 2 ms by columns; 7 ms with an aperture; a distorted lens 20 to 60 ms more unless `out` still has its
 * directions.
 */
gbt_status ray_image_from_shot(const ray_shot *shot, int sample, ray_image *out, gbt_error *err);

/** The rays of a camera that stands still: ray_image_from_shot() of ray_shot_of(camera). */
gbt_status ray_image_from_camera(const gbt_camera *camera, ray_image *out, gbt_error *err);

/** Arrays for width x height rays, not set; those of `out` when they fit. Empty on failure. */
gbt_status ray_image_reserve(ray_image *out, int width, int height, bool common_origin, gbt_error *err);

void ray_image_free(ray_image *rays); /* zeroes the struct */

static inline size_t ray_image_count(const ray_image *rays)
{
    return (size_t)rays->width * (size_t)rays->height;
}

/** Origin of ray `i`, [3]. */
static inline const float *ray_image_origin(const ray_image *rays, size_t i)
{
    return rays->common_origin ? rays->origin : rays->origin + 3 * i;
}

/** Whether `square`, or each element of a vector, is the squared length of a unit vector. What rounding alone
    changes is far within the limits. */
#define RAY_SQUARE_IS_SOUND(square) (((square) > 0.99f) & ((square) < 1.01f))

/** False for NaN, as is ray_origin_is_sound(). */
static inline bool ray_direction_is_sound(const float d[3])
{
    const float square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    return RAY_SQUARE_IS_SOUND(square);
}

static inline bool ray_origin_is_sound(const float o[3])
{
    const float limit = (float)RAY_ORIGIN_LIMIT;
    return fabsf(o[0]) < limit && fabsf(o[1]) < limit && fabsf(o[2]) < limit;
}

/** Whether the ray is traced. Others see the background. */
static inline bool ray_is_sound(const float o[3], const float d[3])
{
    return ray_direction_is_sound(d) && ray_origin_is_sound(o);
}

/** Largest |coordinate| of an origin: what trace_build() wants to know. */
float ray_image_reach(const ray_image *rays);

#endif
