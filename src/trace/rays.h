/* trace/rays.h -- the rays of one view. */
#ifndef GBT_TRACE_RAYS_H
#define GBT_TRACE_RAYS_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/** Row-major. A ray with a zero direction is invalid: it sees the background, and its transmittance is 1. */
typedef struct ray_image {
    int width, height;
    float *origin;      /* [3] when shared by all rays (common_origin), else [height * width][3]; scene-local units; owned */
    float *dir;         /* [height * width][3], unit (to float rounding) or zero; owned */
    bool common_origin;
    /* Kept by ray_image_from_camera() for the next pose of the same lens; NULL for a pinhole. */
    double *camera_dir; /* [height * width][3] in camera axes; owned */
    gbt_camera camera;  /* whose lens camera_dir is */
} ray_image;

/**
 * The rays through the pixel centres of a camera, in world axes.
 *
 * Directions are computed in double and rounded once. A pixel where the lens has no ray gets a zero direction.
 *
 * @param out [in,out] start from {0}, free with ray_image_free(); its arrays are used again when the size is the same; empty on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (a size < 1, a camera that sees nothing, a pose that is not finite), GBT_ERR_NO_MEMORY
 * Threads: runs in parallel over rows; same bits for every thread count.
 * Cost: about 1 ms of one core per 10^5 rays; a distorted lens 20 to 60 times that when it is not the lens of the call before.
 */
gbt_status ray_image_from_camera(const gbt_camera *camera, ray_image *out, gbt_error *err);

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

#endif
