/* SPDX-License-Identifier: Apache-2.0 */
/* stability/draw.h -- pictures for the cases of the study "stability": by the tracer, by the rasterizer, in
   double. */
#ifndef GBT_STABILITY_DRAW_H
#define GBT_STABILITY_DRAW_H

#include "raster/raster.h"
#include "stability/stability.h"
#include "trace/trace.h"

/* As everything that takes a case: no-ops after a failure, which the case keeps. */

/** What one renderer needs and makes; start from {0}, free with drawing_free(). */
typedef struct drawing {
    trace_scene traced; /* kernel may be set before the first picture */
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

/** Both pictures of a camera; `rays` is scratch. */
void draw_camera(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                 const gbt_camera *camera, ray_image *rays);

/** The picture in double: [rays][3], free with mem_free(); NULL after a failure. */
double *draw_exact(stability *s, const gaussians *g, const trace_settings *settings, const ray_image *rays,
                   double *transmittance);

/** A pinhole at `center` that looks along z, y down, its middle in the middle. */
gbt_camera draw_pinhole(int width, int height, double focal, const double center[3]);

/** `width` x `height` rays to fill with draw_ray(), each from its own origin. */
void draw_rays(stability *s, ray_image *rays, int width, int height);

/** Direction of any length. */
void draw_ray(ray_image *rays, size_t i, const double origin[3], const double dir[3]);

/** Room for `count` round grey Gaussians of size 1 and opacity 1 at the origin, not turned; padded. */
void draw_some(stability *s, gaussians *g, size_t count);

/** Set Gaussian i. quat NULL: not turned. */
void draw_set(gaussians *g, size_t i, const double mean[3], const double scale[3], const double quat[4],
              double opacity, const double color[3]);

/** A random unit quaternion and a random unit vector. */
void draw_random_turn(uint64_t seed, uint64_t stream, uint64_t i, double quat[4]);
void draw_random_direction(uint64_t seed, uint64_t stream, uint64_t i, double dir[3]);

/** A turn about y by `yaw` and then about x by `pitch` (radians), as world to camera. */
void draw_turned(double yaw, double pitch, double rotation[9]);

/** Largest difference; NaN when a value is not finite. */
double draw_difference(const float *a, const float *b, size_t count);
double draw_error(const float *a, const double *exact, size_t count);
double draw_psnr(const float *a, const double *exact, size_t count); /* of values in [0, 1], at most 200 dB */

/** How many values are not finite. */
size_t draw_count_bad(const float *values, size_t count);
size_t draw_count_bad_fields(const gaussians *g);

#endif
