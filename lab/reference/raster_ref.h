/* SPDX-License-Identifier: Apache-2.0 */
/* reference/raster_ref.h -- EWA splatting in double precision, every Gaussian on every pixel, and its
   adjoint: the reference in tests of raster.h (Kerbl 2023, eqs 5, 6).

   Per Gaussian with mean mu, Sigma = R S^2 R^T, opacity o, and a camera (rotation W, centre c, focal lengths,
   principal point):

       t = W (mu - c), drawn when t_z > near      centre = (fx t_x / t_z + cx, fy t_y / t_z + cy)
       J = [fx / t_z, 0, -fx kx / t_z; 0, fy / t_z, -fy ky / t_z]
       kx = t_x / t_z clamped to the picture plus 0.15 of its width on each side, [-cx - 0.15 width,
            1.15 width - cx] / fx with cx from the picture's edge; ky likewise
       C = J W Sigma W^T J^T + dilation I      p = -1/2 d^T C^-1 d, d = centre - pixel
       alpha = min(alpha_max, o exp(p))

   It is drawn where alpha >= alpha_min, but only in the tiles of 16 x 16 pixels that overlap the square
   centre +- ceil(3 sqrt(largest eigenvalue of C)) (with exact_cut: everywhere). Gaussians are blended in the
   order of (t_z, index), stopping before T would fall below transmittance_min; the background comes last. */
#ifndef GBT_REFERENCE_RASTER_REF_H
#define GBT_REFERENCE_RASTER_REF_H

#include "raster/raster.h"

/**
 * Gaussians in double, so that finite differences can use steps below the resolution of a float:
 * [GAUSSIANS_FIELD_COUNT][count], fields in order.
 */
typedef struct raster_reference {
    size_t count;
    double *fields; /* owned; free with mem_free() */
} raster_reference;

/** Copy of `g` without its padding. */
gbt_status raster_reference_make(const gaussians *g, raster_reference *out, gbt_error *err);

/**
 * Colours of every `step`-th pixel of every `step`-th row, starting with the first.
 *
 * @param settings      [in]  of form RASTER_EWA
 * @param rgb           [out] [pixels][3], row by row, with the background; raster_reference_pixels() of them
 * @return GBT_OK, GBT_ERR_ARGUMENT (a camera with another lens), GBT_ERR_NO_MEMORY
 * Threads: parallel over pixels; same bits for every thread count. Cost: about 5 ns for each pair of pixel
 * and Gaussian.
 */
gbt_status raster_reference_forward(const raster_reference *scene, const gbt_camera *camera,
                                    const raster_settings *settings, int step, double *rgb, gbt_error *err);

/** Adjoint with step 1: adds dL/dfield (scales linear, quaternion tangent). One thread. */
gbt_status raster_reference_backward(const raster_reference *scene, const gbt_camera *camera,
                                     const raster_settings *settings, const double *d_rgb, double *d_fields,
                                     gbt_error *err);

/** The number of pixels that raster_reference_forward() computes. */
static inline size_t raster_reference_pixels(const gbt_camera *camera, int step)
{
    return (size_t)((camera->width + step - 1) / step) * (size_t)((camera->height + step - 1) / step);
}

#endif
