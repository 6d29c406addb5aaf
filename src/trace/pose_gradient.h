/* SPDX-License-Identifier: Apache-2.0 */
/* trace/pose_gradient.h -- from the gradients of a view's Gaussians to the gradient of its camera's pose. */
#ifndef GBT_TRACE_POSE_GRADIENT_H
#define GBT_TRACE_POSE_GRADIENT_H

#include "base/gaussians.h"
#include "gbtrace/camera.h"

/**
 * Gradient with respect to the six numbers of a small motion of the camera, (v, omega) in camera axes as
 * gbt_camera_moved() takes them.
 *
 * What a ray sees, and how wide its pixel is, depends on camera and Gaussians together only: a rigid motion
 * of both changes nothing. So moving the camera is moving every Gaussian the other way, and what remains is
 * the eye that colours and shapes are decoded for, which moves along. In world axes, with c the camera's
 * centre, e the eye, q the quaternion and vec() the last three components of a quaternion:
 *     dL/dv     = dL/de - sum_i dL/dmu_i
 *     dL/domega = (e - c) x dL/de - sum_i [(mu_i - c) x dL/dmu_i + vec(dL/dq_i q_i*) / 2]
 * and out = (W dL/dv, W dL/domega), W the rotation from world to camera. It is exact: depth order, cut-offs
 * and t_near move along too.
 *
 * @param g     [in]  Gaussians as decoded, before any footprint
 * @param d     [in]  their gradients, after footprint_backward(); the response's alone, without what their
 *                    colours or shapes owe to the eye
 * @param d_eye [in]  dL/de
 * Threads: uses all; same bits for every thread count. Sums are in double.
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status pose_gradient(const gaussians *g, const gaussians *d, const gbt_camera *camera,
                         const double eye[3], const double d_eye[3], double out[6], gbt_error *err);

#endif
