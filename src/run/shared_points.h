/* SPDX-License-Identifier: Apache-2.0 */
/* run/shared_points.h -- the sparse points that most cameras see, which define the common subject of the
   photos. */
#ifndef GBT_RUN_SHARED_POINTS_H
#define GBT_RUN_SHARED_POINTS_H

#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef struct shared_points {
    float *position; /* [count][3], scene-local; owned */
    size_t count;    /* 0: the cameras look in different directions, or there are too few points */
} shared_points;

/**
 * Let m be the largest number of cameras whose image contains the same point. The shared points are those in
 * the images of at least 2/3 m cameras; occlusion is ignored. There are none if m is less than half the
 * cameras, or if fewer than 20 points qualify. Of many points only every n-th is tested.
 *
 * @param cameras [in] [count], count >= 1
 * @param points  [in] [point_count][3], scene-local
 * @param out     [out] free with shared_points_free()
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status shared_points_find(const gbt_camera *cameras, size_t count, const float *points,
                              size_t point_count, shared_points *out, gbt_error *err);
void shared_points_free(shared_points *shared); /* zeroes the struct */

/**
 * Factor by which the field of view of a pinhole camera (its tangents) must be widened to show all but 1 % of
 * the points, with a margin of 5 % of half the image. Points behind the camera are ignored.
 *
 * @param scratch [count]
 * @return at least 1
 */
double shared_points_zoom(const shared_points *shared, const gbt_camera *camera, double *scratch);

#endif
