/* SPDX-License-Identifier: Apache-2.0 */
/* raster/raster.h -- splatting: the same Gaussians drawn tile by tile, as the cross-check and the counterpart
   of the tracer.

   Two forms. RASTER_EWA has the conventions of 3D Gaussian splatting: each Gaussian becomes a 2D Gaussian by
   the affine projection at its centre (Zwicker 2001; Kerbl 2023, eq 5), dilated by 0.3 px^2, and all pixels
   blend in the order of the centres' depths. RASTER_PER_RAY keeps the tiles but takes response and order from
   the ray of each pixel, as docs/tracing.md defines them, so that the two forms differ in projection and
   order alone. The rasterizer shares the cameras and the Gaussian arrays with the tracer, nothing else. */
#ifndef GBT_RASTER_RASTER_H
#define GBT_RASTER_RASTER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/gaussians.h"
#include "base/image.h"
#include "base/sky.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef enum raster_form { RASTER_EWA, RASTER_PER_RAY } raster_form;

/** Start from raster_settings_default(). */
typedef struct raster_settings {
    raster_form form;        /* default RASTER_EWA */
    float alpha_min;         /* a hit counts when alpha >= this; > 0. Default 1/255 */
    float alpha_max;         /* alpha is cut here, (0, 1). Default 0.99 */
    float transmittance_min; /* stop before the hit that would bring T below this. Default 1e-4 */
    float near; /* EWA: centres at this depth z or nearer are not drawn, default 0.2; per ray: the tracer's
                   t_near */
    float dilation;       /* EWA: variance added to the projection, px^2. Default 0.3 */
    bool exact_cut;       /* EWA: draw to where alpha falls to alpha_min, not to 3 std-devs. Default false */
    bool order_by_center; /* per ray: blend in the order of the centres' depths, as EWA does. Default false */
    float background[3];  /* default 0 */
    sky sky;              /* added to it as a function of the ray's direction. Default nothing */
} raster_settings;

raster_settings raster_settings_default(void);

typedef struct raster_counters {
    uint64_t pixels, drawn, pairs, blended; /* Gaussians drawn; pairs of Gaussian and tile; of Gaussian and
                                               pixel, blended */
} raster_counters;

/** The last view and the memory of passes, reused from view to view. Start from {0}. */
typedef struct raster_scene {
    struct raster_state *state; /* internal */
    const atomic_bool *stop; /* optional (NULL): once true a pass ends with GBT_ERR_INTERRUPTED; borrowed */
} raster_scene;

/** Whether a camera is one that raster_forward() takes: PINHOLE or SIMPLE_PINHOLE, standing still. */
bool raster_takes(const gbt_camera *camera);

/** EWA: the limits of x / z and y / z of a centre in the Jacobian of the projection: the picture and 0.15 of
    it on each side. `camera`: one that raster_takes(). */
void raster_limits(const gbt_camera *camera, double low[2], double high[2]);

/**
 * Draw `g` as `camera` sees it.
 *
 * @param g             [in]  borrowed until the last pass over this view; padded (gaussians_pad). Those with
 *         non-finite fields are not drawn
 * @param camera        [in]  PINHOLE or SIMPLE_PINHOLE
 * @param keep_tape     [in]  true when raster_backward() will follow
 * @param rgb           [out] 3 channels, size of the camera, allocated by the caller; with the background
 * @param transmittance [out] optional (NULL), [height * width]
 * @param counters      [in,out] optional, added to
 * @return GBT_OK, GBT_ERR_ARGUMENT (a camera with another lens, settings out of range, size of rgb),
 *         GBT_ERR_NO_MEMORY (2^32 pairs of Gaussian and tile, 2^24 Gaussians in one tile, too),
 *         GBT_ERR_INTERRUPTED (scene->stop)
 * Threads: uses all; same bits for every thread count and instruction set. Formulas, and what differs from
 * other rasterizers: docs/crosscheck.md. Memory: about 92 bytes per Gaussian (per ray: 172), 12 per pair; for
 * the adjoint 42 (58) more per pair and 8 per pixel.
 */
gbt_status raster_forward(raster_scene *scene, const gaussians *g, const gbt_camera *camera,
                          const raster_settings *settings, bool keep_tape, image *rgb, float *transmittance,
                          raster_counters *counters, gbt_error *err);

/**
 * Adjoint of the last raster_forward(keep_tape); the tape is kept, so it may be called again.
 *
 * The gradient is that of the formulas: exactly 0 where alpha is cut at alpha_max, and where x / z is kept at
 * its limit in the Jacobian. Per ray the depth of the response is a constant of the derivative (envelope
 * theorem, trace/reference.h).
 *
 * @param d_rgb       [in]  dL/d(rgb)
 * @param d_gaussians [out] resized like the source and overwritten: dL/dfield (scales linear, quaternion
 *                          tangent)
 * @param weight      [out] optional (NULL), [count]: sum over pixels of T alpha, how much each Gaussian was
 *                          seen
 * @return GBT_OK, GBT_ERR_ARGUMENT (no such forward pass before, size of d_rgb), GBT_ERR_NO_MEMORY,
 *         GBT_ERR_INTERRUPTED (scene->stop)
 * Threads: uses all; same bits for every thread count.
 */
gbt_status raster_backward(raster_scene *scene, const image *d_rgb, gaussians *d_gaussians, float *weight,
                           gbt_error *err);

void raster_scene_free(raster_scene *scene);

#endif
