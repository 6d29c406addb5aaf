/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_pose.c -- poses of a camera: from a look-at target, after a small motion, interpolated between
   two poses, and during a rolling-shutter read-out. */
#include "base/camera_pose.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/vec.h"

static bool is_finite(const double point[3])
{
    for (int i = 0; i < 3; i++)
        if (!isfinite(point[i]))
            return false;
    return true;
}

bool gbt_camera_look_at(const double origin[3], const double target[3], const double up[3],
                        gbt_camera *camera)
{
    double forward[3], right[3], down[3], upward[3];
    for (int i = 0; i < 3; i++)
        forward[i] = target[i] - origin[i], upward[i] = up[i];
    dvec_normalize(forward);
    dvec_normalize(upward);
    dvec_cross(forward, upward, right);
    if (!is_finite(origin) || !(dvec_length(right) > 1e-9)) /* false for NaN too */
        return false;
    dvec_normalize(right);
    dvec_cross(forward, right, down);
    for (int i = 0; i < 3; i++) {
        camera->rotation[i] = right[i];
        camera->rotation[3 + i] = down[i];
        camera->rotation[6 + i] = forward[i];
        camera->center[i] = origin[i];
    }
    return true;
}

static void multiply(const double a[9], const double b[9], double out[9])
{
    for (int row = 0; row < 3; row++)
        dmat_apply_transposed(b, a + 3 * row, out + 3 * row);
}

static bool is_rotation(const double m[9])
{
    double third[3];
    dvec_cross(m, m + 3, third);
    double off = fabs(dvec_dot(m, m) - 1) + fabs(dvec_dot(m + 3, m + 3) - 1) + fabs(dvec_dot(m, m + 3));
    for (int i = 0; i < 3; i++)
        off += fabs(third[i] - m[6 + i]);
    return off < 1e-6; /* false for NaN */
}

/* Axis and angle in [0, pi]. The antisymmetric part is 2 sin(angle) axis, the trace 1 + 2 cos(angle); near pi
   the former vanishes, and the axis is the longest column of R + R^T - (trace - 1) I = 2 (1 - cos(angle))
   axis axis^T. */
static double axis_angle(const double r[9], double axis[3])
{
    const double odd[3] = {r[7] - r[5], r[2] - r[6], r[3] - r[1]}, trace = r[0] + r[4] + r[8];
    const double angle = atan2(dvec_length(odd), trace - 1);
    memcpy(axis, odd, sizeof odd);
    if (trace < 0) {
        double best = -1;
        for (int column = 0; column < 3; column++) {
            double c[3];
            for (int i = 0; i < 3; i++)
                c[i] = r[3 * i + column] + r[3 * column + i] - (i == column ? trace - 1 : 0);
            if (dvec_dot(c, c) > best) {
                best = dvec_dot(c, c);
                const double sign = dvec_dot(c, odd) < 0 ? -1 : 1;
                for (int i = 0; i < 3; i++)
                    axis[i] = sign * c[i];
            }
        }
    }
    dvec_normalize(axis);
    return angle;
}

bool camera_motion_prepare(const gbt_camera *start, const gbt_camera *end, camera_motion *out)
{
    double back[9], turn[9];
    if (!is_rotation(start->rotation) || !is_rotation(end->rotation) || !is_finite(start->center) ||
        !is_finite(end->center))
        return false;
    for (int i = 0; i < 9; i++)
        back[i] = start->rotation[3 * (i % 3) + i / 3];
    multiply(end->rotation, back, turn);
    out->angle = axis_angle(turn, out->axis);
    memcpy(out->start_rotation, start->rotation, sizeof out->start_rotation);
    for (int i = 0; i < 3; i++) {
        out->start_center[i] = start->center[i];
        out->way[i] = end->center[i] - start->center[i];
    }
    return true;
}

void camera_motion_at(const camera_motion *motion, double t, double rotation[9], double center[3])
{
    const double half = 0.5 * t * motion->angle, s = sin(half);
    const double q[4] = {cos(half), s * motion->axis[0], s * motion->axis[1], s * motion->axis[2]};
    double turn[9];
    dquat_to_matrix(q, turn);
    multiply(turn, motion->start_rotation, rotation);
    for (int i = 0; i < 3; i++)
        center[i] = motion->start_center[i] + t * motion->way[i];
}

/* Apply the fraction `part` of a motion to a pose: centre + R^T v and exp(omega)^T R. */
static void move(const double motion[6], double part, double rotation[9], double center[3])
{
    double step[3], axis[3] = {motion[3], motion[4], motion[5]}, back[9], moved[9];
    dmat_apply_transposed(rotation, motion, step);
    const double half = 0.5 * part * dvec_length(axis);
    dvec_normalize(axis);
    const double s = -sin(half), q[4] = {cos(half), s * axis[0], s * axis[1], s * axis[2]};
    dquat_to_matrix(q, back);
    multiply(back, rotation, moved);
    memcpy(rotation, moved, sizeof moved);
    for (int i = 0; i < 3; i++)
        center[i] += part * step[i];
}

gbt_camera gbt_camera_moved(const gbt_camera *camera, const double motion[6])
{
    gbt_camera out = *camera;
    move(motion, 1, out.rotation, out.center);
    return out;
}

bool camera_is_still(const gbt_camera *camera)
{
    bool moves = false;
    for (int i = 0; i < 6; i++)
        moves = moves || camera->motion[i] != 0;
    return !moves || camera->shutter == GBT_CAMERA_SHUTTER_GLOBAL;
}

camera_pose camera_pose_during(const gbt_camera *camera, double share)
{
    camera_pose out;
    memcpy(out.rotation, camera->rotation, sizeof out.rotation);
    memcpy(out.center, camera->center, sizeof out.center);
    if (share != 0.5 && !camera_is_still(camera))
        move(camera->motion, share - 0.5, out.rotation, out.center);
    return out;
}

camera_pose camera_pose_at(const gbt_camera *camera, double px, double py)
{
    return camera_pose_during(camera, camera->shutter == GBT_CAMERA_SHUTTER_ROWS      ? py / camera->height
                                      : camera->shutter == GBT_CAMERA_SHUTTER_COLUMNS ? px / camera->width
                                                                                      : 0.5);
}

camera_pose *camera_line_poses(const gbt_camera *camera, int *count, gbt_error *err)
{
    *count = camera_is_still(camera)                      ? 1
             : camera->shutter == GBT_CAMERA_SHUTTER_ROWS ? camera->height
                                                          : camera->width;
    camera_pose *poses = mem_alloc((size_t)*count, sizeof *poses, "poses", err);
    for (int i = 0; i < *count && poses != NULL; i++)
        poses[i] = camera_pose_during(camera, (i + 0.5) / *count);
    return poses;
}

bool camera_pose_pixel(const camera_pose *pose, const camera_lens *lens, const double point[3],
                       double pixel[2])
{
    double cam[3];
    for (int i = 0; i < 3; i++)
        cam[i] = point[i] - pose->center[i];
    dmat_apply(pose->rotation, cam, cam);
    return camera_lens_project(lens, cam, pixel);
}

bool camera_pixel(const gbt_camera *camera, const camera_lens *lens, const double point[3], double pixel[2])
{
    enum {
        STEPS_MAX = 50
    }; /* each multiplies the error by the share of the image's height that a point
          moves by during read-out */
    camera_pose pose = camera_pose_during(camera, 0.5);
    if (!camera_pose_pixel(&pose, lens, point, pixel))
        return false;
    if (camera_is_still(camera))
        return true;
    for (int i = 0; i < STEPS_MAX; i++) {
        const double before[2] = {pixel[0], pixel[1]};
        pose = camera_pose_at(camera, pixel[0], pixel[1]);
        if (!camera_pose_pixel(&pose, lens, point, pixel))
            return false;
        if (fabs(pixel[0] - before[0]) + fabs(pixel[1] - before[1]) < 1e-9)
            return true;
    }
    return false;
}

static void stand_at(const camera_pose *pose, gbt_camera *camera)
{
    memcpy(camera->rotation, pose->rotation, sizeof pose->rotation);
    memcpy(camera->center, pose->center, sizeof pose->center);
}

gbt_camera camera_of_readout_part(const gbt_camera *camera, double x, double y, double width, double height)
{
    gbt_camera out = *camera;
    if (camera_is_still(camera))
        return out;
    const bool by_rows = camera->shutter == GBT_CAMERA_SHUTTER_ROWS;
    const double all = by_rows ? camera->height : camera->width, first = (by_rows ? y : x) / all,
                 span = (by_rows ? height : width) / all;
    const camera_pose middle = camera_pose_during(camera, first + 0.5 * span);
    double way[3];
    stand_at(&middle, &out);
    dmat_apply_transposed(camera->rotation, camera->motion, way); /* the path is a straight line in the
                                                                     world */
    dmat_apply(out.rotation, way, out.motion);
    for (int i = 0; i < 6; i++)
        out.motion[i] *= span;
    return out;
}

gbt_camera gbt_camera_at(const gbt_camera *camera, double px, double py)
{
    gbt_camera out = *camera;
    const camera_pose pose = camera_pose_at(camera, px, py);
    stand_at(&pose, &out);
    out.shutter = GBT_CAMERA_SHUTTER_GLOBAL;
    memset(out.motion, 0, sizeof out.motion);
    return out;
}

bool camera_set_readout(const gbt_camera *start, const gbt_camera *end, gbt_camera_shutter shutter,
                        double first, double last, gbt_camera *camera)
{
    camera_motion way;
    if (!camera_motion_prepare(start, end, &way))
        return false;
    camera_motion_at(&way, 0.5 * (first + last), camera->rotation, camera->center);
    dmat_apply(camera->rotation, way.way, camera->motion);
    for (int i = 0; i < 3; i++) {
        camera->motion[i] *= last - first;
        camera->motion[3 + i] = -way.angle * way.axis[i] * (last - first);
    }
    camera->shutter = shutter;
    return true;
}
