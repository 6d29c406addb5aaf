/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/model.h -- a scene in memory: open it, render it into your own arrays, take gradients back to the
   camera and to plain Gaussians.

   Coordinates are those of the data set, or of the file or arrays that the Gaussians came from; cameras are
   posed in the same. Pictures are always traced, also of models that were trained with the rasterizer.
   docs/library.md has a tour, examples/ whole programs. */
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
 * A loaded scene and the memory of its last picture.
 *
 * Threads: one call at a time on each model; different models may be used from different threads at the same
 * time. Inside, a call uses all processors that gbt_set_threads() allows, and its results have the same bits
 * for any number of them.
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
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status gbt_model_open(const char *path, gbt_model **out, gbt_error *err);

/** Plain Gaussians in the caller's arrays, as 3DGS has them. A colour is max(0, 0.5 + sum_k sh_k Y_k(d)), d
    from the camera to the mean. */
typedef struct gbt_gaussians {
    size_t count;           /* >= 1 */
    int sh_degree;          /* 0 to 3 */
    const float *mean;      /* [count][3] */
    const float *scale_log; /* [count][3], natural log of the std-devs, [-30, 30] */
    const float *quat;      /* [count][4], w x y z, of any length from 1e-18 */
    const float *opacity;   /* [count], [0, 1] */
    const float *sh;        /* [count][(sh_degree + 1)^2][3], coefficients in the order of 3DGS files */
} gbt_gaussians;

/**
 * A model of plain Gaussians.
 *
 * The arrays are copied. Quaternions are normalised; a scale below 1e-4 of its Gaussian's largest is raised
 * to that.
 *
 * @param g   [in]  borrowed for the call; every value finite
 * @param out       [out] free with gbt_model_close(); NULL on failure
 * @param err       [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (names the first value that is not usable), GBT_ERR_NO_MEMORY
 */
gbt_status gbt_model_from_gaussians(const gbt_gaussians *g, gbt_model **out, gbt_error *err);

/**
 * Give a model of plain Gaussians other ones, as many as you like; settings stay.
 *
 * @return as gbt_model_from_gaussians(); on failure nothing changes
 */
gbt_status gbt_model_set_gaussians(gbt_model *model, const gbt_gaussians *g, gbt_error *err);

/**
 * The plain Gaussians of a model as they are drawn: quaternions of length 1, scales raised as
 * gbt_model_from_gaussians() does, and of a file without the rows that are not usable. In a model that is
 * made of them and has the same settings the picture is the same but for the rounding of floats.
 *
 * @param mean, scale_log, quat, opacity, sh [out] shapes as in gbt_gaussians, with `gaussians` of
 *                                           gbt_model_get_info() as count; NULL: not wanted
 * @return GBT_OK, or GBT_ERR_ARGUMENT: networks make its Gaussians for each view (gbt_export() first)
 */
gbt_status gbt_model_get_gaussians(const gbt_model *model, float *mean, float *scale_log, float *quat,
                                   float *opacity, float *sh, gbt_error *err);

/** NULL is fine. */
void gbt_model_close(gbt_model *model);

/* ---- ask ---- */

/** What a model is. */
typedef struct gbt_model_info {
    size_t gaussians;       /* plain ones: how many; of networks: at most so many are drawn */
    size_t anchors;         /* 0: plain Gaussians */
    int sh_degree;          /* 0 to 3; -1: networks make the colours */
    uint64_t iterations;    /* of training; 0 where nobody knows */
    double low[3], high[3]; /* box of all anchors, or means */
} gbt_model_info;

/** What it is. Cost: a pass over the anchors or Gaussians. */
gbt_model_info gbt_model_get_info(const gbt_model *model);

/** How pictures are made. */
typedef struct gbt_model_settings {
    float background[3]; /* behind everything. Default the model's; of plain Gaussians black, or white as a
                            result folder says. A sky that was learned is added to it until it is changed */
    float footprint; /* rays are as wide as pixels: variance of a pixel, px^2, [0, 4]; 0: thin rays. Default
                        as trained; 0.1 for plain Gaussians */
    float t_near;    /* nearest distance at which anything is seen, >= 0. Default as trained; of plain
                        Gaussians 0.01, or what the file says */
    float alpha_min; /* smallest response that counts, [1e-30, 1). Default 1/255 */
    float alpha_max; /* responses are cut here, [alpha_min, 1). Default 0.99 */
    float transmittance_min; /* a ray ends before less than this is left, (0, 1). Default 1e-4 */
} gbt_model_settings;

gbt_model_settings gbt_model_get_settings(const gbt_model *model);

/** Set them for all that follows. GBT_OK, or GBT_ERR_ARGUMENT for a value out of range: then nothing
    changes. */
gbt_status gbt_model_set_settings(gbt_model *model, const gbt_model_settings *settings, gbt_error *err);

/** One view of the data set that a model was trained on. */
typedef struct gbt_model_view {
    const char *name;  /* of the photo, as the data set has it; borrowed until the views are opened again, or
                          the model closed */
    bool held_out;     /* training did not see it */
    gbt_camera camera; /* at the size that training used */
    float t_near;      /* for gbt_model_set_settings(): of training, and of gbt_render(), for this photo */
} gbt_model_view;

/**
 * Read the cameras of the data set that a model was trained on, or of another of the same place.
 *
 * @param data  [in]  data set folder; NULL: the one that the model names, seen from the present folder; of a
 *                    result folder of 3DGS that of its cfg_args, or its cameras.json
 * @param count [out] how many views there are; 0 on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (Gaussians that know no cameras, and `data` is NULL), GBT_ERR_IO (it is
 * not there), GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 */
gbt_status gbt_model_open_views(gbt_model *model, const char *data, size_t *count, gbt_error *err);

/** View `index` of those that gbt_model_open_views() counted. GBT_OK, or GBT_ERR_ARGUMENT when there is
    none. */
gbt_status gbt_model_get_view(const gbt_model *model, size_t index, gbt_model_view *out, gbt_error *err);

/* ---- render ---- */

/** Where a picture goes: the caller's arrays, row-major, written in place. NULL: not wanted. */
typedef struct gbt_picture {
    float *rgb;   /* [height][width][3], with the background; required */
    float *depth; /* [height][width], expected distance along the ray, of what is hit; 0 where nothing is */
    float *transmittance; /* [height][width], what is left for the background, [0, 1] */
} gbt_picture;

/**
 * Render what a camera sees.
 *
 * @param camera [in]  any lens model; pixels without a ray get the background
 * @param keep   [in]  gbt_model_gradient() follows. It costs about a byte per blended hit
 * @param out    [out] arrays for camera->width x camera->height pixels
 * @param err    [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (an unusable camera), GBT_ERR_NO_MEMORY, GBT_ERR_INTERNAL; the arrays hold
 *         anything after a failure
 */
gbt_status gbt_model_render(gbt_model *model, const gbt_camera *camera, bool keep, const gbt_picture *out,
                            gbt_error *err);

/** Where gradients of plain Gaussians go: the caller's arrays, shapes as in gbt_gaussians, overwritten. NULL:
    not wanted. Of the values that were given; of a model from a file, of those that gbt_model_get_gaussians()
    gives. */
typedef struct gbt_gaussians_gradient {
    float *mean;      /* [count][3] */
    float *scale_log; /* [count][3] */
    float *quat;      /* [count][4], of the quaternions as they were given: at right angles to each */
    float *opacity;   /* [count] */
    float *sh;        /* [count][(sh_degree + 1)^2][3] */
} gbt_gaussians_gradient;

/**
 * Adjoint of the last gbt_model_render() with `keep`, once for each: from dL/d(rgb) to the pose of its
 * camera, and to plain Gaussians.
 *
 * The pose is differentiated by the motion (v, omega) of gbt_camera_moved() at 0: v moves the camera along
 * its own axes (right, down, forward), omega turns it about them, radians. With W the rotation from world to
 * camera, c the camera's centre, e the eye for which colours are made (c; of an orthographic camera the
 * middle of its picture), mu_i, q_i the Gaussians' means and quaternions, and every derivative by a mean or
 * quaternion the one at fixed colours:
 *
 *     dL/dv     = W (dL/de - sum_i dL/dmu_i)
 *     dL/domega = W ((e - c) x dL/de - sum_i [(mu_i - c) x dL/dmu_i + vec(dL/dq_i q_i*) / 2])
 *
 * because moving the camera is moving all Gaussians the other way, but for the eye: dL/de goes through the
 * directions of the spherical harmonics, or through the direction and distance that the networks are given.
 * Pixels' footprints move with the camera and are in these sums. It is the gradient of the picture between
 * cuts: where a response crosses alpha_min, or a ray its end, a picture jumps a little, and no gradient says
 * so. That a background which depends on direction (a learned sky) turns is left out of dL/domega.
 *
 * @param d_rgb       [in]  [height][width][3], finite
 * @param d_pose      [out] dL/d(v, omega); optional (NULL)
 * @param d_gaussians [out] optional (NULL); plain Gaussians only
 * @param err         [out] optional
 * @return GBT_OK, GBT_ERR_ARGUMENT (no kept render, d_rgb not finite, gradients of networks wanted),
 *         GBT_ERR_NO_MEMORY
 * Cost: about that of the render.
 */
gbt_status gbt_model_gradient(gbt_model *model, const float *d_rgb, double d_pose[6],
                              const gbt_gaussians_gradient *d_gaussians, gbt_error *err);

GBT_API_END
#endif
