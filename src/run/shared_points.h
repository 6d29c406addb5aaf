/* SPDX-License-Identifier: Apache-2.0 */
/* run/shared_points.h -- what the photos have in common: the sparse points that most cameras see. */
#ifndef GBT_RUN_SHARED_POINTS_H
#define GBT_RUN_SHARED_POINTS_H

#include <stddef.h>

#include "gbtrace/camera.h"
#include "gbtrace/status.h"

typedef struct shared_points {
    float *position; /* [count][3], scene-local; owned */
    size_t count;    /* 0: cameras that look apart, or too few points */
} shared_points;

/**
 * The points inside the pictures of at least two thirds as many cameras as see the point that most see.
 * Nothing is hidden by anything. None where no point is in the pictures of half the cameras, or where fewer
 * than 20 points are shared. Of many points every n-th is asked.
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
 * By how much the view of a pinhole must be widened (tangents) to show all but 1 % of the points, 5 % of half
 * the picture within its border. Points behind the camera do not count.
 *
 * @param scratch [count]
 * @return at least 1
 */
double shared_points_zoom(const shared_points *shared, const gbt_camera *camera, double *scratch);

#endif
