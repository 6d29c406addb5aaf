/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_group.c -- what a set of cameras has in common: up direction, focus, distance, lens. */
#include "render/camera_group.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/camera_axes.h"
#include "base/compare.h"
#include "base/memory.h"
#include "base/symmetric.h"
#include "base/vec.h"

/* The cameras count as coplanar when their spread (std-dev) across the plane is below flat_share of the next
   larger one. The plane's normal is taken as "up" only if it is close to the mean of the cameras' up axes. */
static const double flat_share = 0.2, flat_cosine = 0.7;
/* If the focus is nearer to the cameras than this share of the distance to the points, the cameras only
   rotated in place: their axes meet at their own position. */
static const double on_the_spot_share = 0.02;
static const double tan_widest = 2; /* limit for lenses wider than any useful pinhole: 127 degrees */

/** The value with `rank` smaller ones among `count` values. Sorts the array. */
static double ranked(double *values, size_t count, size_t rank)
{
    qsort(values, count, sizeof *values, compare_doubles);
    return values[rank];
}

/** The upper median. Sorts the array. */
static double median(double *values, size_t count) { return ranked(values, count, count / 2); }

static void mean_center(const gbt_camera *cameras, size_t count, double out[3])
{
    memset(out, 0, 3 * sizeof *out);
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            out[k] += cameras[i].center[k] / (double)count;
}

/** Mean of one axis of the cameras (1: down, 2: forward). The closer its length is to 1, the more they agree.
 */
static void mean_axis(const gbt_camera *cameras, size_t count, int axis, double out[3])
{
    memset(out, 0, 3 * sizeof *out);
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            out[k] += cameras[i].rotation[3 * axis + k] / (double)count;
}

static void find_up(const gbt_camera *cameras, size_t count, const double middle[3], double up[3])
{
    double spread[9] = {0}, axes[9], down[3];
    mean_axis(cameras, count, 1, down);
    for (int k = 0; k < 3; k++)
        up[k] = -down[k];
    if (!(dvec_length(up) > 1e-6))
        for (int k = 0; k < 3; k++)
            up[k] = -cameras[0].rotation[3 + k];
    dvec_normalize(up);
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 9; k++)
            spread[k] +=
                (cameras[i].center[k / 3] - middle[k / 3]) * (cameras[i].center[k % 3] - middle[k % 3]);
    symmetric_eigen(spread, axes, 3, 1e-15);
    int low = 0;
    for (int k = 1; k < 3; k++)
        if (spread[4 * k] < spread[4 * low])
            low = k;
    const double one = spread[4 * ((low + 1) % 3)], other = spread[4 * ((low + 2) % 3)],
                 next = fmin(one, other), largest = fmax(one, other);
    const double normal[3] = {axes[low], axes[3 + low], axes[6 + low]}, cosine = dvec_dot(normal, up);
    /* Three cameras always lie in one plane, and collinear cameras lie in many. */
    if (count > 3 && next > flat_share * flat_share * largest &&
        spread[4 * low] < flat_share * flat_share * next && fabs(cosine) > flat_cosine)
        for (int k = 0; k < 3; k++)
            up[k] = cosine < 0 ? -normal[k] : normal[k];
}

/** A point in the mean viewing direction, at the median depth of the points in front; false if none is in
    front, or if there is no clear mean direction. */
static bool amid_points(const gbt_camera *cameras, size_t count, const double middle[3], const float *points,
                        size_t point_count, double *depth, double out[3])
{
    double forward[3];
    size_t found = 0;
    mean_axis(cameras, count, 2, forward);
    if (dvec_length(forward) < 0.2)
        return false;
    dvec_normalize(forward);
    for (size_t i = 0; i < point_count; i++) {
        const double way[3] = {(double)points[3 * i] - middle[0], (double)points[3 * i + 1] - middle[1],
                               (double)points[3 * i + 2] - middle[2]};
        const double along = dvec_dot(way, forward);
        if (along > 0)
            depth[found++] = along;
    }
    if (found == 0)
        return false;
    const double distance = median(depth, found);
    for (int k = 0; k < 3; k++)
        out[k] = middle[k] + distance * forward[k];
    return true;
}

static void find_lens(const gbt_camera *cameras, size_t count, double *scratch, gbt_camera *out)
{
    size_t known = 0;
    for (size_t i = 0; i < count; i++) {
        double tan_half[2];
        gbt_camera_half_fov_tan(&cameras[i], tan_half);
        if (tan_half[0] > 0 && tan_half[1] > 0)
            scratch[known++] = fmin(fmin(tan_half[0], tan_half[1]), tan_widest);
    }
    const double tan_short = known > 0 ? median(scratch, known) : 0.5;
    const int width = cameras[0].width, height = cameras[0].height;
    const double focal = 0.5 * (width < height ? width : height) / tan_short;
    *out = (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = width,
                        .height = height,
                        .params = {focal, focal, 0.5 * width, 0.5 * height},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

static double median_distance(const gbt_camera *cameras, size_t count, const double point[3], double *scratch)
{
    for (size_t i = 0; i < count; i++) {
        double way[3];
        for (int k = 0; k < 3; k++)
            way[k] = cameras[i].center[k] - point[k];
        scratch[i] = dvec_length(way);
    }
    return median(scratch, count);
}

/** From `middle` to the point at the nearest tenth: a median would be drawn out by distant backgrounds. 0
    without points. */
static double near_point_distance(const float *points, size_t count, const double middle[3], double *scratch)
{
    for (size_t i = 0; i < count; i++) {
        double way[3];
        for (int k = 0; k < 3; k++)
            way[k] = (double)points[3 * i + (size_t)k] - middle[k];
        scratch[i] = dvec_length(way);
    }
    return count > 0 ? ranked(scratch, count, count / 10) : 0;
}

gbt_status camera_group_make(const gbt_camera *cameras, size_t count, const float *points, size_t point_count,
                             camera_group *out, gbt_error *err)
{
    double middle[3],
        *scratch = mem_alloc(count > point_count ? count : point_count, sizeof *scratch, "cameras", err);
    if (scratch == NULL)
        return GBT_ERR_NO_MEMORY;
    memset(out, 0, sizeof *out);
    mean_center(cameras, count, middle);
    find_up(cameras, count, middle, out->up);
    const double far = near_point_distance(points, point_count, middle, scratch),
                 least = fmax(on_the_spot_share * far, 1e-12);
    if (!(camera_axes_meet(cameras, count, middle, out->focus) &&
          median_distance(cameras, count, out->focus, scratch) > least) &&
        !amid_points(cameras, count, middle, points, point_count, scratch, out->focus))
        memset(out->focus, 0, sizeof out->focus);
    out->distance = median_distance(cameras, count, out->focus, scratch);
    if (!(out->distance > least))
        out->distance = far > 0 ? far : 1;
    find_lens(cameras, count, scratch, &out->lens);
    mem_free(scratch);
    return GBT_OK;
}

gbt_camera camera_group_lens(const camera_group *group, int width, int height)
{
    gbt_camera out = group->lens;
    const int shorter = width < height ? width : height,
              before = out.width < out.height ? out.width : out.height;
    out.params[0] = out.params[1] = group->lens.params[0] * shorter / before;
    out.width = width;
    out.height = height;
    out.params[2] = 0.5 * width;
    out.params[3] = 0.5 * height;
    return out;
}
