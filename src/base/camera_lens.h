/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_lens.h -- a camera's lens, prepared for fast evaluation at many pixels. */
#ifndef GBT_BASE_CAMERA_LENS_H
#define GBT_BASE_CAMERA_LENS_H

#include <stdbool.h>

#include "base/camera_model.h"

enum { LENS_NUMERATOR = 7, LENS_DENOMINATOR = 4 };

typedef struct camera_lens {
    lens_kind kind;
    double fx, fy, cx, cy;
    double shape[2];    /* FOV: omega; division: k; EUCM: alpha, beta */
    bool radial, extra; /* whether there is a radial factor; whether there are tangential or prism terms */
    bool extra_last;    /* extra terms are evaluated at the radially distorted point, not at the undistorted
                           one */
    double numerator[LENS_NUMERATOR]; /* radial factor N(x) / D(x), x = squared radius, constant term 1 */
    double denominator[LENS_DENOMINATOR];
    int numerator_count, denominator_count; /* number of terms up to the last nonzero one, when `radial` or
                                               `extra` */
    double tangent_x, tangent_y; /* x += tx (r2 + 2 x x) + 2 ty x y; y += ty (r2 + 2 y y) + 2 tx x y */
    double prism[4];             /* x += s0 r2 + s1 r4; y += s2 r2 + s3 r4 */
    double radius_max;           /* undistorted radius up to which the radial part is increasing */
    double distorted_max;        /* the distorted radius there; HUGE_VAL at a pole */
} camera_lens;

/**
 * Prepare a lens once for many pixels.
 *
 * @return false for an unknown model, a value that is not finite, a focal length that is not > 0, or shape
 *         parameters outside the model's domain. Such a camera sees nothing.
 * Threads: any. Cost: about a microsecond, some more for the six-coefficient models.
 */
bool camera_lens_prepare(const gbt_camera *camera, camera_lens *lens);

/** gbt_camera_half_fov_tan() for a prepared lens and its image size. */
void camera_lens_half_fov_tan(const camera_lens *lens, int width, int height, double tan_half[2]);

/**
 * Where the ray through an image point starts, in camera axes: the centre (0, 0, 0), or for an orthographic
 * lens a point of the plane Z = 0.
 */
void camera_lens_origin(const camera_lens *lens, double px, double py, double origin_cam[3]);

/** Whether all rays of the lens type have Z > 0 for any parameters. Such a lens focuses on a plane, others on
    a sphere. */
static inline bool camera_lens_looks_forward(const camera_lens *lens)
{
    return lens->kind == LENS_PERSPECTIVE || lens->kind == LENS_FOV || lens->kind == LENS_ORTHOGRAPHIC;
}

/** gbt_camera_unproject() and gbt_camera_project() for a prepared lens, with the same bits. */
bool camera_lens_unproject(const camera_lens *lens, double px, double py, double dir_cam[3]);

/** camera_lens_unproject() for the first `count` pixel centres of a row, with the same bits: dir [count][3],
    0 where there is no ray. Distorted lenses are inverted for several pixels at a time. */
void camera_lens_unproject_row(const camera_lens *lens, double py, int count, double *dir);

bool camera_lens_project(const camera_lens *lens, const double point_cam[3], double pixel[2]);

#endif
