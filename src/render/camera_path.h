/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_path.h -- the cameras of a film, one per frame: an orbit around what the photos show, or a
   smooth path through given cameras. */
#ifndef GBT_RENDER_CAMERA_PATH_H
#define GBT_RENDER_CAMERA_PATH_H

#include "render/camera_group.h"
#include "run/shared_points.h"
#include "trace/rays.h"

enum { CAMERA_PATH_FRAMES_MAX = 100000 };

typedef struct camera_path {
    ray_shot *shots; /* [count], all of one size; owned */
    size_t count;
    double fps; /* frames per second; 0: not given */
} camera_path;

gbt_status camera_path_alloc(camera_path *out, size_t count, gbt_error *err); /* shots are not set */
void camera_path_free(camera_path *path);                                     /* zeroes the struct */

typedef struct orbit_shape {
    double radius; /* from the axis; 0: as the cameras near that angle */
    double height; /* above the focus along `up`; NaN: as the cameras near that angle */
    bool at_focus; /* look at the focus; else where the cameras near that angle look */
} orbit_shape;

/**
 * An orbit about the axis through the focus along `up`, at even angles.
 *
 * At every angle the camera has the distance from the axis, the height and the target (the points of the
 * viewing axes nearest to the focus) of the given cameras near that angle, or what `shape` says. Frame
 * `count` would be frame 0 again.
 *
 * If the cameras leave a gap of more than a quarter of the circle, what would be seen from there is unknown.
 * The path then swings to and fro along the arc that they cover, slowest at the turning points. When there
 * are many, the outermost 4 % at both ends are not counted; the arc has at least 40 degrees.
 *
 * @param cameras [in] [count] cameras around the focus, count >= 1
 * @param lens    [in] of every frame; its pose is not used
 * @param frames  [in] 1 to CAMERA_PATH_FRAMES_MAX
 * @param out     [out] free with camera_path_free()
 */
gbt_status camera_path_orbit(const gbt_camera *cameras, size_t count, const camera_group *group,
                             const gbt_camera *lens, const orbit_shape *shape, size_t frames,
                             camera_path *out, gbt_error *err);

/** Widen the lens of all frames by one factor, at most 1.5 in the tangent, until each frame shows the points
    (shared_points_zoom()). */
gbt_status camera_path_show(camera_path *path, const shared_points *points, gbt_error *err);

/**
 * A smooth path through all keys, from the first to the last.
 *
 * One centripetal Catmull-Rom curve (Yuksel 2011: no loops, no cusps) through the points (centre, 2 L q),
 * with q the unit quaternion of the sign nearer to its predecessor; q is normalized again on the curve.
 * Frames are evenly spaced by sqrt(|dx|^2 + (L angle)^2 + (L log zoom)^2), L = turn_length: a rotation counts
 * as much as the sideways motion that would turn the view of an object at distance L by the same angle, and
 * zooming as much as moving closer to such an object. Between keys, focal lengths are interpolated
 * geometrically and the other lens parameters linearly. Between keys of the same pose the camera does not
 * move.
 *
 * @param keys        [in] [count], count >= 1, of one model and size
 * @param turn_length [in] L, > 0
 * @param frames      [in] 1 to CAMERA_PATH_FRAMES_MAX
 * @return GBT_OK, GBT_ERR_NO_MEMORY
 */
gbt_status camera_path_through(const gbt_camera *keys, size_t count, double turn_length, size_t frames,
                               camera_path *out, gbt_error *err);

/**
 * Choose the order in which a path visits the cameras. The given order (by name, often the order of capture)
 * stays, unless going from the first camera to the nearest one left each time gives a path less than two
 * thirds as long. Lengths are those of camera_path_through(), without zoom.
 *
 * @param cameras [in, out] [count]
 * Cost: O(count^2).
 */
gbt_status camera_path_order(gbt_camera *cameras, size_t count, double turn_length, gbt_error *err);

#endif
