/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/camera.h -- a posed camera: lens model, image size, pose, and its motion while a rolling shutter
   reads the image out.

   Camera axes are COLMAP's: x right, y down, z forward. The image spans [0, width] x [0, height], and the
   centre of the top-left pixel is (0.5, 0.5). Lens formulas: docs/cameras.md.

   Threads: every function here is a pure function of its arguments and may be called from any thread.
   `camera` is borrowed for the call. Cameras are copied as they are; whether one can be used is checked where
   it is used, by gbt_model_render(). */
#ifndef GBTRACE_CAMERA_H
#define GBTRACE_CAMERA_H

#include <stdbool.h>

#include "gbtrace/api.h"

GBT_API_BEGIN

/** Lens models, with COLMAP's numbers and parameter orders; those that COLMAP does not have follow. */
typedef enum gbt_camera_model {
    GBT_CAMERA_SIMPLE_PINHOLE = 0,              /* f cx cy */
    GBT_CAMERA_PINHOLE = 1,                     /* fx fy cx cy */
    GBT_CAMERA_SIMPLE_RADIAL = 2,               /* f cx cy k */
    GBT_CAMERA_RADIAL = 3,                      /* f cx cy k1 k2 */
    GBT_CAMERA_OPENCV = 4,                      /* fx fy cx cy k1 k2 p1 p2 */
    GBT_CAMERA_OPENCV_FISHEYE = 5,              /* fx fy cx cy k1 k2 k3 k4 */
    GBT_CAMERA_FULL_OPENCV = 6,                 /* fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6 */
    GBT_CAMERA_FOV = 7,                         /* fx fy cx cy omega */
    GBT_CAMERA_SIMPLE_RADIAL_FISHEYE = 8,       /* f cx cy k */
    GBT_CAMERA_RADIAL_FISHEYE = 9,              /* f cx cy k1 k2 */
    GBT_CAMERA_THIN_PRISM_FISHEYE = 10,         /* fx fy cx cy k1 k2 p1 p2 k3 k4 sx1 sy1 */
    GBT_CAMERA_RAD_TAN_THIN_PRISM_FISHEYE = 11, /* fx fy cx cy k0 to k5 p0 p1 s0 to s3 */
    GBT_CAMERA_SIMPLE_DIVISION = 12,            /* f cx cy k */
    GBT_CAMERA_DIVISION = 13,                   /* fx fy cx cy k */
    GBT_CAMERA_SIMPLE_FISHEYE = 14,             /* f cx cy */
    GBT_CAMERA_FISHEYE = 15,                    /* fx fy cx cy */
    GBT_CAMERA_EUCM = 16,                       /* fx fy cx cy alpha beta */
    GBT_CAMERA_EQUIRECTANGULAR = 17,            /* w h of the whole panorama. params[14] and params[15], 0 in
                                                   data sets, are the image point of the panorama's top-left
                                                   corner: this image may be a part of it */
    GBT_CAMERA_MODEL_COUNT,                     /* number of the models above, which a data set can contain */
    GBT_CAMERA_ORTHOGRAPHIC = 100 /* sx sy cx cy, sx and sy in pixels per scene unit: parallel rays. Not in
                                     COLMAP */
} gbt_camera_model;

enum { GBT_CAMERA_MAX_PARAMS = 16 };

/** Which pixels of an image are exposed at the same time. */
typedef enum gbt_camera_shutter {
    GBT_CAMERA_SHUTTER_GLOBAL, /* all of them; the default */
    GBT_CAMERA_SHUTTER_ROWS,   /* those of one row: a rolling shutter */
    GBT_CAMERA_SHUTTER_COLUMNS /* those of one column: a rolling shutter */
} gbt_camera_shutter;

typedef struct gbt_camera {
    gbt_camera_model model;
    int width, height;                    /* pixels, > 0 */
    double params[GBT_CAMERA_MAX_PARAMS]; /* in the model's order, then 0; lengths in pixels, focal lengths
                                             > 0 */
    double rotation[9];                   /* world to camera, row-major, orthonormal within 1e-3, det +1 */
    double center[3];                     /* camera centre, in the coordinates of the data set or file */
    gbt_camera_shutter shutter; /* with a rolling shutter, the pose is that of the middle row or column */
    double motion[6]; /* rolling shutter: motion from the image's first edge to its last (downwards or to the
                         right), at constant velocity along a line; components as in gbt_camera_moved() */
} gbt_camera;

/** Number of lens models, GBT_CAMERA_ORTHOGRAPHIC included, and the model at `index` in their list, 0 to
    count - 1. */
int gbt_camera_model_count(void);
gbt_camera_model gbt_camera_model_at(int index);

/** Number of parameters of a model, their names ("f cx cy"), and its name (COLMAP's where it has one); 0 and
    NULL for an unknown model. */
int gbt_camera_param_count(gbt_camera_model model);
const char *gbt_camera_param_names(gbt_camera_model model);
const char *gbt_camera_model_name(gbt_camera_model model);

/**
 * Direction, in camera axes, of the ray through a point of the image.
 *
 * @param px, py   [in]  image point, pixels; a pixel (i, j) is sampled at (i + 0.5, j + 0.5)
 * @param dir_cam  [out] unit vector; untouched on failure
 * @return false where the lens model has no ray (outside its field of view, or the inversion does not
 *         converge)
 *
 * Threads: any. Cost: closed form for models without distortion, else Newton in double with an iteration cap.
 */
bool gbt_camera_unproject(const gbt_camera *camera, double px, double py, double dir_cam[3]);

/**
 * The ray through a point of the image, in world axes.
 *
 * @param origin [out] the camera centre (with a rolling shutter: at the moment that this image point is
 *                     exposed); for an orthographic camera the ray's point on the image plane through the
 *                     centre
 * @param dir    [out] unit vector; both untouched on failure
 * @return as gbt_camera_unproject()
 */
bool gbt_camera_ray(const gbt_camera *camera, double px, double py, double origin[3], double dir[3]);

/**
 * Image point of a world point, pixels: the inverse of gbt_camera_ray(). With a rolling shutter it is found
 * by iteration: each step projects with the pose at the image point found before. Where the camera moves so
 * fast that it sees a point twice, the result is one of the two image points, or none.
 *
 * @return false where the camera does not see the point; `pixel` may lie outside the image
 */
bool gbt_camera_pixel(const gbt_camera *camera, const double point[3], double pixel[2]);

/** Image point, pixels, of a point in camera axes; false where the model does not see it. `pixel` may lie
    outside the image. gbt_camera_unproject() inverts these formulas. */
bool gbt_camera_project(const gbt_camera *camera, const double point_cam[3], double pixel[2]);

/** The same camera for an image of another size: lengths in pixels are scaled per axis (single-f models need
    equal ratios within 1 px). Both sizes >= 1; for others, and for an unknown model, an unchanged copy. */
gbt_camera gbt_camera_resized(const gbt_camera *camera, int width, int height);

/**
 * The camera whose pixels are every `step`-th of this one's, in both directions, from pixel (x, y) on: ray
 * (i, j) of `out` is ray (x + step i, y + step j) of `camera`. Its size is floor(size / step) for any x and y
 * in [0, step). A rolling shutter's motion is scaled to the rows or columns that are left.
 *
 * @return false for an unknown model, or when no pixel would be left; `out` is untouched then
 */
bool gbt_camera_every(const gbt_camera *camera, int step, int x, int y, gbt_camera *out);

/**
 * The camera whose pixel (i, j) has its centre at the point (i + 0.5 + dx, j + 0.5 + dy) of this camera's
 * image.
 *
 * @return false for an unknown model; `out` is untouched then
 */
bool gbt_camera_shifted(const gbt_camera *camera, double dx, double dy, gbt_camera *out);

/** The camera of a part of the image: `width` x `height` pixels with pixel (x, y) of this image at the top
    left; it may reach beyond the image. Returns false as gbt_camera_shifted() does, or without a pixel. */
bool gbt_camera_cropped(const gbt_camera *camera, int x, int y, int width, int height, gbt_camera *out);

/**
 * Set the pose of `camera`: its centre at `origin`, `target` in the middle of the image, `up` towards the top
 * of the image.
 *
 * @return false, and nothing changed, when `target` is at `origin`, `up` is along the view (within 1e-9 rad),
 *         or a value is not finite
 */
bool gbt_camera_look_at(const double origin[3], const double target[3], const double up[3],
                        gbt_camera *camera);

/**
 * The camera after a small motion in its own axes. Pose gradients (gbtrace/model.h) are taken with respect to
 * this motion.
 *
 * @param motion [in] (v, omega): v moves the centre along the camera's axes (right, down, forward), scene
 *                    units; omega turns the camera about the same axes through its centre, right-handed,
 *                    radians. The new centre is center + R^T v, the new rotation exp([omega]x)^T R, with R
 *                    the world-to-camera rotation and [omega]x a = omega x a
 */
gbt_camera gbt_camera_moved(const gbt_camera *camera, const double motion[6]);

/** The global-shutter camera with the pose at which an image point is exposed. Without a rolling shutter it
    is a copy of `camera`. */
gbt_camera gbt_camera_at(const gbt_camera *camera, double px, double py);

/**
 * tan of half the horizontal and vertical field of view of a pinhole camera with the same focal lengths:
 * width / (2 fx), height / (2 fy). For a panorama fx and fy are its pixels per radian at the centre. 0 for
 * parallel rays.
 */
void gbt_camera_half_fov_tan(const gbt_camera *camera, double tan_half[2]);

GBT_API_END
#endif
