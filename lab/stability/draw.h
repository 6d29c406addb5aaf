/* SPDX-License-Identifier: Apache-2.0 */
/* stability/draw.h -- draw pictures for the cases of the study "stability": traced, rasterized, and in
   double. */
#ifndef GBT_STABILITY_DRAW_H
#define GBT_STABILITY_DRAW_H

#include "raster/raster.h"
#include "stability/stability.h"
#include "trace/trace.h"

/* Functions that take a `stability` do nothing after a failure, which it keeps. */

/** State and pictures of one renderer; start from {0}, free with drawing_free(). */
typedef struct drawing {
    trace_scene traced; /* its kernel may be set before the first picture */
    raster_scene splatted;
    image rgb;            /* [height][width][3] */
    float *transmittance; /* [height * width] */
    size_t transmittance_capacity;
} drawing;

void draw_traced(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                 const ray_image *rays);
void draw_splatted(stability *s, drawing *d, const gaussians *g, const raster_settings *settings,
                   const gbt_camera *camera);
void drawing_free(drawing *d);

/** Trace and splat the view of a camera; `rays` is scratch. */
void draw_camera(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                 const gbt_camera *camera, ray_image *rays);

/** Trace in double precision: returns [rays][3], to be freed with mem_free(); NULL after a failure. */
double *draw_exact(stability *s, const gaussians *g, const trace_settings *settings, const ray_image *rays,
                   double *transmittance);

/** A pinhole at `center` that looks along z, with y down and its principal point in the middle of the
    picture. */
gbt_camera draw_pinhole(int width, int height, double focal, const double center[3]);

/** Allocate `width` x `height` rays with separate origins, to be set by draw_ray(). */
void draw_rays(stability *s, ray_image *rays, int width, int height);

/** Set ray i. The direction may have any length. */
void draw_ray(ray_image *rays, size_t i, const double origin[3], const double dir[3]);

/** Allocate `count` Gaussians with padding: grey, round, size 1, opacity 1, at the origin. */
void draw_alloc(stability *s, gaussians *g, size_t count);

/** Set Gaussian i. quat NULL: no rotation. */
void draw_set(gaussians *g, size_t i, const double mean[3], const double scale[3], const double quat[4],
              double opacity, const double color[3]);

/** A random unit quaternion and a random unit vector. */
void draw_random_turn(uint64_t seed, uint64_t stream, uint64_t i, double quat[4]);
void draw_random_direction(uint64_t seed, uint64_t stream, uint64_t i, double dir[3]);

/** World-to-camera rotation: by `yaw` about y, then by `pitch` about x (radians). */
void draw_turned(double yaw, double pitch, double rotation[9]);

/** Largest absolute difference; NaN if a value is not finite. */
double draw_difference(const float *a, const float *b, size_t count);
double draw_error(const float *a, const double *exact, size_t count);
double draw_psnr(const float *a, const double *exact, size_t count); /* values in [0, 1]; at most 200 dB */

/** The number of values that are not finite. */
size_t draw_count_bad(const float *values, size_t count);
size_t draw_count_bad_fields(const gaussians *g);

#endif
