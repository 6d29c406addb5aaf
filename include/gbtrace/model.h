/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/model.h -- a scene in memory: open it, render it into your own arrays, take gradients back to the
   camera and to plain Gaussians.

   Coordinates are those of the data set, or of the file or arrays that the Gaussians came from; cameras use
   the same coordinates. Images are always ray traced, also for models that were trained with the rasterizer.
   docs/library.md has a tour, examples/ has complete programs. */
#ifndef GBTRACE_MODEL_H
#define GBTRACE_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/api.h"
#include "gbtrace/camera.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

/**
 * A loaded scene, with the buffers of its last render.
 *
 * Threads: one call at a time per model; different models may be used from different threads at the same
 * time. Each call runs on all threads that gbt_set_threads() allows; its results have the same bits for any
 * number of them. Models may be closed in any order.
 */
typedef struct gbt_model gbt_model;

/* ---- open and close ---- */

/**
 * Open a trained model or a file of plain Gaussians.
 *
 * @param path [in]  RUN (a folder with model.gbt), a model file, plain Gaussians in any format of
 *                   gbt_export_format_at(), or a result folder of 3DGS. The data set is not needed
 * @param out  [out] free with gbt_model_close(); NULL on failure
 * @param err  [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (the path is too long), GBT_ERR_IO (cannot be read, or holds no model),
 *         GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status gbt_model_open(const char *path, gbt_model **out, gbt_error *err);

/** Plain Gaussians in the caller's arrays, with the parameters of 3DGS. A colour is max(0, 0.5 + sum_k sh_k
    Y_k(d)), with d the unit direction from the camera to the mean. */
typedef struct gbt_gaussians {
    size_t count;           /* 1 to 2^32 - 1 */
    int sh_degree;          /* 0 to 3 */
    const float *mean;      /* [count][3], within +-1e17 */
    const float *scale_log; /* [count][3], natural log of the std-devs, [-30, 30] */
    const float *quat;      /* [count][4], w x y z, of any length from 1e-18 to 1e18; local to world */
    const float *opacity;   /* [count], [0, 1] */
    const float *sh;        /* [count][(sh_degree + 1)^2][3], within +-1e18: red, green and
                               blue of each function, in the order of 3DGS files */
} gbt_gaussians;

/**
 * A model of plain Gaussians.
 *
 * The arrays are copied. Quaternions are normalised; a scale below 1e-4 of the largest scale of its Gaussian
 * is raised to that value.
 *
 * @param g   [in]  borrowed for the call
 * @param out [out] free with gbt_model_close(); NULL on failure
 * @param err [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first invalid value), GBT_ERR_NO_MEMORY
 */
gbt_status gbt_model_from_gaussians(const gbt_gaussians *g, gbt_model **out, gbt_error *err);

/**
 * Replace the Gaussians of a model of plain Gaussians, by any number of them; settings stay, a kept render is
 * dropped.
 *
 * @return as gbt_model_from_gaussians(); on failure nothing changes
 */
gbt_status gbt_model_set_gaussians(gbt_model *model, const gbt_gaussians *g, gbt_error *err);

/**
 * The plain Gaussians of a model as they are rendered: quaternions of length 1, scales raised as in
 * gbt_model_from_gaussians(), and without a file's unusable rows. A model made from these arrays with the
 * same settings renders the same images up to float rounding.
 *
 * @param mean, scale_log, quat, opacity, sh [out] shapes as in gbt_gaussians, with `gaussians` of
 *                                           gbt_model_get_info() as count; NULL: skipped
 * @return GBT_OK, or GBT_ERR_ARGUMENT: the model's networks make its Gaussians for each view (use
 * gbt_export() first)
 */
gbt_status gbt_model_get_gaussians(const gbt_model *model, float *mean, float *scale_log, float *quat,
                                   float *opacity, float *sh, gbt_error *err);

/** NULL is fine. */
void gbt_model_close(gbt_model *model);

/* ---- ask ---- */

/** What a model is. */
typedef struct gbt_model_info {
    size_t gaussians;       /* plain Gaussians: their number; with networks: the largest number that a view
                               can have */
    size_t anchors;         /* 0 for plain Gaussians */
    int sh_degree;          /* 0 to 3; -1: colours come from networks */
    uint64_t iterations;    /* of training; 0 when unknown */
    double low[3], high[3]; /* bounding box of all anchors, or of all means */
} gbt_model_info;

/** Summary of a model. Cost: a pass over the anchors or Gaussians. */
gbt_model_info gbt_model_get_info(const gbt_model *model);

/** Settings of all renders of a model. */
typedef struct gbt_model_settings {
    float background[3]; /* colour behind the scene, finite. Default: the model's; for plain Gaussians black,
                            or white if a result folder says so. A learned sky is added to it until this
                            colour is changed */
    float footprint; /* variance of the pixel footprint (rays as wide as pixels, docs/antialiasing.md), px^2,
                        [0, 4]; 0: thin rays. Default: as trained; 0.1 for plain Gaussians */
    float t_near;    /* nearest distance at which anything is rendered, scene units, [0, 1e17]. Default: as
                        trained; for plain Gaussians 0.01, or what the file says */
    float alpha_min; /* smaller responses are skipped, [1e-30, 1). Default 1/255 */
    float alpha_max; /* larger responses are clamped to this, [alpha_min, 1). Default 0.99 */
    float transmittance_min; /* a ray ends before its transmittance would fall below this, (0, 1). Default
                                1e-4 */
} gbt_model_settings;

gbt_model_settings gbt_model_get_settings(const gbt_model *model);

/** Set them for all later renders; a kept render is dropped. Returns GBT_OK, or GBT_ERR_ARGUMENT for a value
    out of range; nothing changes then. */
gbt_status gbt_model_set_settings(gbt_model *model, const gbt_model_settings *settings, gbt_error *err);

/** One view of the data set that a model was trained on. */
typedef struct gbt_model_view {
    const char *name;  /* of the photo, as in the data set; borrowed until the views are opened again or the
                          model is closed */
    bool held_out;     /* not used for training */
    gbt_camera camera; /* at the size that training used */
    float t_near;      /* value for gbt_model_set_settings(): the one that training and gbt_render() use for
                          this photo */
} gbt_model_view;

/**
 * Read the cameras of the data set that a model was trained on, or of another data set in the same
 * coordinates. Views that were open are closed, also on failure. Photos are not read.
 *
 * @param data  [in]  data set folder; NULL: the one that the model names, relative to the current directory;
 *                    for a result folder of 3DGS the one in its cfg_args, or its cameras.json
 * @param count [out] number of views; 0 on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (`data` is NULL and the model names no cameras), GBT_ERR_IO (the data set
 * is missing), GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status gbt_model_open_views(gbt_model *model, const char *data, size_t *count, gbt_error *err);

/** View `index`, below the count of gbt_model_open_views(). Returns GBT_OK, or GBT_ERR_ARGUMENT when there is
    no such view. */
gbt_status gbt_model_get_view(const gbt_model *model, size_t index, gbt_model_view *out, gbt_error *err);

/* ---- render ---- */

/** Output of a render: the caller's arrays, row-major. NULL: not computed; rgb is required. */
typedef struct gbt_picture {
    float *rgb;           /* [height][width][3], with the background; may exceed 1 */
    float *depth;         /* [height][width], distance along the ray, scene units, averaged over the hits by
                             their blending weights; 0 where nothing is hit */
    float *transmittance; /* [height][width], the share of the background in the pixel, [0, 1] */
} gbt_picture;

/**
 * Render an image from a camera: a ray through the centre of each pixel. A render that was kept before is
 * dropped, also on failure.
 *
 * @param camera [in]  any lens model, rays starting within 1e17 of the coordinates' origin; pixels without a
 *                     ray get the background
 * @param keep   [in]  true: keep what gbt_model_gradient() needs, about a byte per blended hit
 * @param out    [out] arrays of camera->width x camera->height pixels
 * @param err    [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (an unusable camera), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL; after a failure
 *         the contents of the arrays are undefined
 * Cost: each call selects and decodes what is in view and builds a tree over it, then traces the rays. So
 * many rays in one image cost less than the same rays in many small ones.
 */
gbt_status gbt_model_render(gbt_model *model, const gbt_camera *camera, bool keep, const gbt_picture *out,
                            gbt_error *err);

/** Output gradients of plain Gaussians: the caller's arrays, shapes as in gbt_gaussians, overwritten. NULL:
    not computed. They are derivatives by the values that the caller gave; for a model from a file, by those
    that gbt_model_get_gaussians() returns. */
typedef struct gbt_gaussians_gradient {
    float *mean;      /* [count][3] */
    float *scale_log; /* [count][3] */
    float *quat;      /* [count][4], by the quaternions as given (not normalised), so orthogonal to each */
    float *opacity;   /* [count] */
    float *sh;        /* [count][(sh_degree + 1)^2][3] */
} gbt_gaussians_gradient;

/**
 * Adjoint of the last gbt_model_render(), which must have had `keep`: from dL/d(rgb) to the pose of its
 * camera and to plain Gaussians. It can be called once for each such render, before any change of the
 * settings or the Gaussians; a call with unusable arguments does not count, unless the gradient itself
 * exceeds the range of float.
 *
 * The pose is differentiated by the motion (v, omega) of gbt_camera_moved() at 0: v moves the camera along
 * its own axes (right, down, forward), omega turns it about them, radians. Let W be the rotation from world
 * to camera, c the camera's centre, e the point for which view-dependent colours are evaluated (c; for an
 * orthographic camera the middle of its image), mu_i and q_i the Gaussians' means and quaternions. With
 * derivatives by means and quaternions taken at fixed colours,
 *
 *     dL/dv     = W (dL/de - sum_i dL/dmu_i)
 *     dL/domega = W ((e - c) x dL/de - sum_i [(mu_i - c) x dL/dmu_i + vec(dL/dq_i q_i*) / 2])
 *
 * because moving the camera is the same as moving all Gaussians the opposite way, except for the colours:
 * dL/de is the gradient through the directions of the spherical harmonics, or through the direction and
 * distance inputs of the networks. Pixel footprints move with the camera and are included in these sums.
 * Jumps of the image are not differentiated: a little one where a response crosses alpha_min or a ray reaches
 * its end, and one where two overlapping Gaussians change their order along a ray. dL/domega leaves out the
 * rotation of a background that depends on direction (a learned sky).
 *
 * @param d_rgb       [in]  [height][width][3], finite
 * @param d_pose      [out] dL/d(v, omega); optional (NULL)
 * @param d_gaussians [out] optional (NULL); plain Gaussians only
 * @param err         [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (no kept render, d_rgb not finite, d_gaussians for a model with networks,
 *         a gradient beyond the range of float), GBT_ERR_NO_MEMORY
 * Cost: about that of the render.
 */
gbt_status gbt_model_gradient(gbt_model *model, const float *d_rgb, double d_pose[6],
                              const gbt_gaussians_gradient *d_gaussians, gbt_error *err);

GBT_API_END
#endif
