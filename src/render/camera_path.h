/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_path.h -- the cameras of a film, one a frame: around what the photos show, or smoothly
   through given cameras. */
#ifndef GBT_RENDER_CAMERA_PATH_H
#define GBT_RENDER_CAMERA_PATH_H

#include "render/camera_group.h"
#include "run/shared_points.h"
#include "trace/rays.h"

enum { CAMERA_PATH_FRAMES_MAX = 100000 };

typedef struct camera_path {
    ray_shot *shots; /* [count], all of one size; owned */
    size_t count;
    double fps; /* frames per second; 0: not said */
} camera_path;

gbt_status camera_path_alloc(camera_path *out, size_t count, gbt_error *err); /* shots are not set */
void camera_path_free(camera_path *path);                                     /* zeroes the struct */

typedef struct orbit_shape {
    double radius; /* from the axis; 0: as the cameras at about that angle */
    double height; /* above the focus along `up`; NaN: as the cameras at about that angle */
    bool at_focus; /* look at the focus; else as the cameras at about that angle */
} orbit_shape;

/**
 * Around the focus at even angles about the axis through it along `up`: as far from the axis and as high as
 * the cameras are at about that angle, looking where they look (the points of their axes nearest to the
 * focus), or as `shape` says. Frame `count` would be frame 0.
 *
 * Where the cameras leave out more than a quarter of the circle nothing is known of what would be seen from
 * there: the way then goes along the arc that they cover (of many, all but the outermost 4 % at both ends; at
 * least 40 degrees) and back, slowest where it turns.
 *
 * @param cameras [in] [count] that stand around, count >= 1
 * @param lens    [in] of every frame; its pose is not used
 * @param frames  [in] 1 to CAMERA_PATH_FRAMES_MAX
 * @param out     [out] free with camera_path_free()
 */
gbt_status camera_path_orbit(const gbt_camera *cameras, size_t count, const camera_group *group,
                             const gbt_camera *lens, const orbit_shape *shape, size_t frames,
                             camera_path *out, gbt_error *err);

/** Widen the lens of all frames alike, to 1.5 times at most (tangents), until each shows the points
    (shared_points_zoom()). */
gbt_status camera_path_show(camera_path *path, const shared_points *points, gbt_error *err);

/**
 * Smoothly through all keys, from the first to the last.
 *
 * One Catmull-Rom curve (centripetal, Yuksel 2011: no loops, no cusps) through the points (centre, 2 L q), q
 * the unit quaternion with the sign nearer to the one before; q is made unit again. Then frames at even steps
 * of sqrt(|dx|^2 + (L angle)^2 + (L log zoom)^2), L = turn_length: turning by an angle counts as much as
 * moving far enough to turn the view of something L away by it, zooming as much as going nearer to something
 * L away. Focal lengths go from key to key with the curve, by even ratios, the rest of the lens evenly.
 * Between keys of one pose the camera stays.
 *
 * @param keys        [in] [count], count >= 1, of one model and size
 * @param turn_length [in] L, > 0
 * @param frames      [in] 1 to CAMERA_PATH_FRAMES_MAX
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status camera_path_through(const gbt_camera *keys, size_t count, double turn_length, size_t frames,
                               camera_path *out, gbt_error *err);

/**
 * Put cameras in an order to go through: as they are (by name: often as they were taken), unless going on to
 * the nearest one each time, from the first on, makes a way less than two thirds as long. Lengths as in
 * camera_path_through(), of one lens.
 *
 * @param cameras [in, out] [count]
 * Cost: O(count^2).
 */
gbt_status camera_path_order(gbt_camera *cameras, size_t count, double turn_length, gbt_error *err);

#endif
