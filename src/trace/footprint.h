/* SPDX-License-Identifier: Apache-2.0 */
/* trace/footprint.h -- rays with a width: each Gaussian as the pixels of one view can resolve it, and the
   adjoint of that.

   A pixel sees not a line but a narrow cone, whose cross-section at the Gaussian has the variance w = v p^2:
   p is the size of a pixel there, v its variance in squared pixels. What a ray sees of a Gaussian at its
   nearest point is the Gaussian's marginal across the ray; its mean over the cone is that marginal with w
   added to its covariance, and adding w to the marginal of every ray is adding w to the 3D covariance. So a
   cone costs nothing while tracing: the rotation stays, s_i'^2 = s_i^2 + w. What a Gaussian covers, opacity
   times area across the ray, is kept: o' = o sqrt(a / a') with a = det S^2 |S^-1 R^T d|^2, d from the camera
   to the centre. Splats have such filters in Yu 2024. */
#ifndef GBT_TRACE_FOOTPRINT_H
#define GBT_TRACE_FOOTPRINT_H

#include "base/camera_lens.h"
#include "base/gaussians.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

/** How a view samples the scene. */
typedef struct footprint_view {
    enum footprint_kind {
        FOOTPRINT_PERSPECTIVE,
        FOOTPRINT_ANGULAR,
        FOOTPRINT_PANORAMA,
        FOOTPRINT_PARALLEL
    } kind;
    double center[3], axis[3]; /* of the camera; axis: forward, or down for a panorama; unit */
    double pixel; /* size of a pixel at distance 1: on the axis (perspective), everywhere (angular), on the
                     horizon (panorama); at any distance (parallel) */
} footprint_view;

/** Distorted lenses are taken as the lens without distortion. A camera that sees nothing has pixels of size
    0. */
footprint_view footprint_view_of(const gbt_camera *camera);

/** footprint_view_of() with the prepared lens of the camera; NULL: it sees nothing. */
footprint_view footprint_view_with(const gbt_camera *camera, const camera_lens *lens);

enum { FOOTPRINT_LANES = 8 };

/** Least cosine of the angle to the axis of a perspective camera: pixels farther out than this angle, 75.5
    degrees, get the size that they would have at it. */
#define FOOTPRINT_COSINE_MIN 0.25

/** Sizes of a pixel at points, scene units: the square root of the area that its cone cuts there; for
    fisheyes, the radial size. Behind a perspective camera they are those in front of it, mirrored. */
void footprint_pixels(const footprint_view *view, double point[3][FOOTPRINT_LANES],
                      double pixel[FOOTPRINT_LANES]);

/** One Gaussian, in double; the quaternion is taken as unit. */
typedef struct footprint_gaussian {
    double mean[3], scale[3], quat[4], opacity;
} footprint_gaussian;

/** The Gaussian widened: scale and opacity are replaced. Pixels count as no smaller than `pixel_min`. */
void footprint_widen(const footprint_view *view, double variance, double pixel_min, footprint_gaussian *g);

/**
 * Widen every Gaussian of a view.
 *
 * @param variance  [in]  v, px^2, >= 0
 * @param pixel_min [in]  optional (NULL), [g->count]: the smallest pixel that the Gaussian was made for;
 *                        closer views show no more of it
 * @param out       [out] resized like `g`, padded; must not be `g`
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count. Cost: about 10 ns per Gaussian.
 */
gbt_status footprint_forward(const footprint_view *view, float variance, const float *pixel_min,
                             const gaussians *g, gaussians *out, gbt_error *err);

/** Adjoint of footprint_forward() in place: `d` is dL/d(out) on entry and dL/d(g) on return. The gradient of
    the quaternion is tangent to the unit sphere; those of the colours do not change. */
void footprint_backward(const footprint_view *view, float variance, const float *pixel_min,
                        const gaussians *g, gaussians *d);

#endif
