/* SPDX-License-Identifier: Apache-2.0 */
/* render/camera_path.c -- the cameras of a film, one per frame.

   Two kinds of path. An orbit goes around the focus of a set of cameras and takes radius, height and aim at
   each angle from the cameras near that angle. A path through key cameras is a Catmull-Rom spline of position
   and rotation, measured in small steps so that frames are evenly spaced along it. */
#include "render/camera_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/camera_model.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"

gbt_status camera_path_alloc(camera_path *out, size_t count, gbt_error *err)
{
    *out = (camera_path){.count = count};
    if (count < 1 || count > CAMERA_PATH_FRAMES_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "frames: %zu (wanted 1 to %d)", count,
                         (int)CAMERA_PATH_FRAMES_MAX);
    out->shots = mem_calloc(count, sizeof *out->shots, "camera path", err);
    return out->shots != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

void camera_path_free(camera_path *path)
{
    mem_free(path->shots);
    *path = (camera_path){0};
}

/* ---- orbit ---- */

/** A camera in cylindrical coordinates about the orbit's axis. */
typedef struct station {
    double angle, radius, height; /* angle in (-pi, pi], 0 at the first camera */
    double aim[3];                /* from the focus to the point of the viewing axis nearest to it */
} station;

typedef struct circle {
    double focus[3], axis[3], across[2][3]; /* axis and across: right-handed, unit */
    double start, arc;                      /* radians; arc 2 pi: the full circle */
    station *stations;                      /* [count], sorted by angle; owned */
    size_t count;
} circle;

static int compare_angles(const void *a, const void *b)
{
    return compare_doubles(&((const station *)a)->angle, &((const station *)b)->angle);
}

static void make_axes(const double up[3], const double towards[3], circle *c)
{
    const double along = dvec_dot(towards, up);
    memcpy(c->axis, up, sizeof c->axis);
    for (int k = 0; k < 3; k++)
        c->across[0][k] = towards[k] - along * up[k];
    if (!(dvec_length(c->across[0]) > 1e-9 * dvec_length(towards))) { /* straight above the focus: any
                                                                         direction will do */
        const int least = fabs(up[0]) <= fabs(up[1]) && fabs(up[0]) <= fabs(up[2]) ? 0
                          : fabs(up[1]) <= fabs(up[2])                             ? 1
                                                                                   : 2;
        for (int k = 0; k < 3; k++)
            c->across[0][k] = (k == least) - up[least] * up[k];
    }
    dvec_normalize(c->across[0]);
    dvec_cross(c->axis, c->across[0], c->across[1]);
}

/** The arc that the stations cover: the circle without the largest gap between neighbours. When there are
    many, the outermost 4 % at either end are dropped. */
static void find_arc(circle *c)
{
    static const double gap_most = PI / 2, arc_least = 40 * PI / 180;
    const size_t n = c->count, spare = n / 25;
    size_t first = 0;
    double gap = c->stations[0].angle + 2 * PI - c->stations[n - 1].angle;
    for (size_t i = 1; i < n; i++)
        if (c->stations[i].angle - c->stations[i - 1].angle > gap) {
            gap = c->stations[i].angle - c->stations[i - 1].angle;
            first = i;
        }
    /* The full circle begins at the first camera, whose angle is 0. */
    c->start = 0;
    c->arc = 2 * PI;
    if (gap <= gap_most)
        return;
    const size_t low = first + spare, high = first + n - 1 - spare;
    c->start = c->stations[low % n].angle + (low >= n ? 2 * PI : 0);
    c->arc = c->stations[high % n].angle + (high >= n ? 2 * PI : 0) - c->start;
    if (c->arc < arc_least) {
        c->start -= (arc_least - c->arc) / 2;
        c->arc = arc_least;
    }
}

static gbt_status circle_make(const gbt_camera *cameras, size_t count, const camera_group *g, circle *c,
                              gbt_error *err)
{
    *c = (circle){.count = count};
    memcpy(c->focus, g->focus, sizeof c->focus);
    c->stations = mem_alloc(count, sizeof *c->stations, "orbit", err);
    if (c->stations == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++) {
        double way[3];
        for (int k = 0; k < 3; k++)
            way[k] = cameras[i].center[k] - g->focus[k];
        if (i == 0)
            make_axes(g->up, way, c);
        const double x = dvec_dot(way, c->across[0]), y = dvec_dot(way, c->across[1]);
        /* The radius has a lower limit: a camera straight above the focus would leave no way around it. */
        station *s = &c->stations[i];
        *s = (station){atan2(y, x), fmax(dvec_length2(x, y), 0.05 * g->distance), dvec_dot(way, g->up), {0}};
        const double *forward = cameras[i].rotation + 6, depth = -dvec_dot(way, forward);
        for (int k = 0; k < 3 && depth > 0; k++)
            s->aim[k] = way[k] + depth * forward[k];
    }
    qsort(c->stations, count, sizeof *c->stations, compare_angles);
    find_arc(c);
    return GBT_OK;
}

/** Position and target at an angle: weighted means over the cameras, by a Gaussian-like (von Mises) weight
    with a spread of 20 degrees about that angle. */
static void circle_at(const circle *c, const orbit_shape *shape, double angle, double out[3],
                      double target[3])
{
    static const double spread = 0.122; /* radians squared */
    double weight = 0, radius = 0, height = 0, aim[3] = {0};
    for (size_t i = 0; i < c->count; i++) {
        const double w = exp((cos(angle - c->stations[i].angle) - 1) / spread);
        weight += w;
        radius += w * c->stations[i].radius;
        height += w * c->stations[i].height;
        for (int k = 0; k < 3; k++)
            aim[k] += w * c->stations[i].aim[k];
    }
    for (int k = 0; k < 3; k++)
        target[k] = c->focus[k] + (shape->at_focus ? 0 : aim[k] / weight);
    radius = shape->radius > 0 ? shape->radius : radius / weight;
    height = isnan(shape->height) ? height / weight : shape->height;
    for (int k = 0; k < 3; k++)
        out[k] = c->focus[k] + height * c->axis[k] +
                 radius * (cos(angle) * c->across[0][k] + sin(angle) * c->across[1][k]);
}

gbt_status camera_path_orbit(const gbt_camera *cameras, size_t count, const camera_group *group,
                             const gbt_camera *lens, const orbit_shape *shape, size_t frames,
                             camera_path *out, gbt_error *err)
{
    circle c;
    GBT_TRY(camera_path_alloc(out, frames, err));
    GBT_TRY(circle_make(cameras, count, group, &c, err));
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < frames && status == GBT_OK; i++) {
        const double turn = (double)i / (double)frames;
        const double angle =
            c.arc < 2 * PI ? c.start + c.arc * 0.5 * (1 - cos(2 * PI * turn)) : c.start + c.arc * turn;
        gbt_camera camera = *lens;
        double at[3], target[3];
        circle_at(&c, shape, angle, at, target);
        if (!gbt_camera_look_at(at, target, c.axis, &camera))
            status = base_fail(err, GBT_ERR_FORMAT,
                               "path: cannot orbit: the cameras are at the point that they look at");
        out->shots[i] = ray_shot_of(&camera);
    }
    mem_free(c.stations);
    return status;
}

gbt_status camera_path_show(camera_path *path, const shared_points *points, gbt_error *err)
{
    static const double zoom_most = 1.5;
    double zoom = 1, *scratch = mem_alloc(points->count + 1, sizeof *scratch, "orbit", err);
    if (scratch == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < path->count; i++)
        zoom = fmax(zoom, shared_points_zoom(points, &path->shots[i].camera, scratch));
    mem_free(scratch);
    for (size_t i = 0; i < path->count; i++)
        for (int k = 0; k < 2; k++)
            path->shots[i].camera.params[k] /= fmin(zoom, zoom_most);
    return GBT_OK;
}

/* ---- through key cameras ---- */

enum {
    POSE = 7, /* centre, and 2 L times the quaternion */
    ZOOM = POSE,
    DIMENSIONS,
    STEPS = 64 /* per segment, to measure its length */
};

typedef struct pose_curve {
    const gbt_camera *keys;
    size_t *key; /* [count]: index of the camera; of consecutive equal ones only the first is kept */
    double (*point)[DIMENSIONS]; /* [count]: centre, 2 L q, L log zoom */
    double (*slope)[DIMENSIONS]; /* [count]: of the pose only, by the spline parameter */
    double *gap; /* [count - 1]: parameter step between knots, from their poses; 0: the pose stays */
    size_t count;
    double turn_length;
} pose_curve;

/** Euclidean distance in the first `dimensions` coordinates: POSE or DIMENSIONS. */
static double distance_of(const double *a, const double *b, int dimensions)
{
    double sum = 0;
    for (int k = 0; k < dimensions; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(sum);
}

/** The camera as a point of the curve. Of q and -q, which are the same rotation, the one nearer to that of
    `before` is taken (NULL: either). `focal` is the params[0] at which zoom is 1; in every model params[0] is
    a length in pixels. */
static void point_of(const gbt_camera *camera, double focal, double turn_length, const double *before,
                     double out[DIMENSIONS])
{
    double q[4], dot = 0;
    dquat_of_matrix(camera->rotation, q);
    for (int k = 0; k < 4 && before != NULL; k++)
        dot += q[k] * before[3 + k];
    for (int k = 0; k < 3; k++)
        out[k] = camera->center[k];
    for (int k = 0; k < 4; k++)
        out[3 + k] = (dot < 0 ? -2 : 2) * turn_length * q[k];
    out[ZOOM] = turn_length * log(camera->params[0] / focal);
}

/** Slope of the chord from point i to the next, by the spline parameter; 0 where the pose stays. */
static double chord_of(const pose_curve *c, size_t i, int k)
{
    return c->gap[i] > 0 ? (c->point[i + 1][k] - c->point[i][k]) / c->gap[i] : 0;
}

/** Slopes of the non-uniform Catmull-Rom spline: at a knot that of the parabola through it and its two
    neighbours, at the ends that of the chord. Beside a gap of 0 the slope is 0, so that a camera that only
    zooms does not move. */
static void find_slopes(pose_curve *c)
{
    for (size_t i = 0; i < c->count; i++)
        for (int k = 0; k < POSE; k++) {
            const double left = i > 0 ? chord_of(c, i - 1, k) : 0;
            const double right = i + 1 < c->count ? chord_of(c, i, k) : left;
            const double sum = i > 0 && i + 1 < c->count ? c->gap[i - 1] + c->gap[i] : 0;
            if (i == 0 || i + 1 == c->count)
                c->slope[i][k] = i == 0 ? right : left;
            else
                c->slope[i][k] = sum > 0 ? (left * c->gap[i] + right * c->gap[i - 1]) / sum : 0;
        }
}

static gbt_status curve_make(const gbt_camera *keys, size_t count, double turn_length, pose_curve *c,
                             gbt_error *err)
{
    *c = (pose_curve){.keys = keys, .turn_length = turn_length};
    c->key = mem_alloc(count, sizeof *c->key, "path", err);
    c->point = mem_alloc(count, sizeof *c->point, "path", err);
    c->slope = mem_alloc(count, sizeof *c->slope, "path", err);
    c->gap = mem_alloc(count, sizeof *c->gap, "path", err);
    if (c->key == NULL || c->point == NULL || c->slope == NULL || c->gap == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++) {
        const size_t n = c->count;
        point_of(&keys[i], keys[0].params[0], turn_length, n > 0 ? c->point[n - 1] : NULL, c->point[n]);
        const double way = n > 0 ? distance_of(c->point[n], c->point[n - 1], DIMENSIONS) : 0;
        if (n > 0 && !(way > 1e-9 * turn_length))
            continue;
        if (n > 0)
            c->gap[n - 1] = sqrt(distance_of(c->point[n], c->point[n - 1], POSE));
        c->key[c->count++] = i;
    }
    find_slopes(c);
    return GBT_OK;
}

static void curve_free(pose_curve *c)
{
    mem_free(c->key);
    mem_free(c->point);
    mem_free(c->slope);
    mem_free(c->gap);
}

/** The curve at u in [0, 1] of a segment: centre, unit quaternion times 2 L, L log zoom. Zoom is linear
    between keys, as the other lens parameters are, and so has kinks at the keys. */
static void curve_at(const pose_curve *c, size_t segment, double u, double out[DIMENSIONS])
{
    if (c->count == 1) {
        memcpy(out, c->point[0], DIMENSIONS * sizeof *out);
        return;
    }
    const double v = 1 - u, h00 = v * v * (1 + 2 * u), h01 = u * u * (3 - 2 * u),
                 h10 = u * v * v * c->gap[segment], h11 = -u * u * v * c->gap[segment];
    double length = 0;
    for (int k = 0; k < POSE; k++)
        out[k] = h00 * c->point[segment][k] + h01 * c->point[segment + 1][k] + h10 * c->slope[segment][k] +
                 h11 * c->slope[segment + 1][k];
    for (int k = 3; k < POSE; k++)
        length += out[k] * out[k];
    for (int k = 3; k < POSE; k++)
        out[k] *= 2 * c->turn_length / sqrt(length);
    out[ZOOM] = v * c->point[segment][ZOOM] + u * c->point[segment + 1][ZOOM];
}

static void set_camera(const pose_curve *c, size_t segment, double u, gbt_camera *out)
{
    double at[DIMENSIONS], q[4];
    const gbt_camera *from = &c->keys[c->key[segment]], *to = &c->keys[c->key[segment + (c->count > 1)]];
    const int focal_count = camera_focal_count(from->model);
    *out = *from;
    for (int k = 0; k < GBT_CAMERA_MAX_PARAMS; k++)
        out->params[k] = k < focal_count ? from->params[k] * pow(to->params[k] / from->params[k], u)
                                         : (1 - u) * from->params[k] + u * to->params[k];
    curve_at(c, segment, u, at);
    memcpy(out->center, at, sizeof out->center);
    for (int k = 0; k < 4; k++)
        q[k] = at[3 + k] / (2 * c->turn_length);
    dquat_to_matrix(q, out->rotation);
}

/** Cumulative length up to each of the STEPS steps of all segments; [segments * STEPS + 1]. */
static void measure(const pose_curve *c, double *length)
{
    double before[DIMENSIONS], at[DIMENSIONS];
    curve_at(c, 0, 0, before);
    length[0] = 0;
    for (size_t i = 1; i <= (c->count - 1) * STEPS; i++) {
        curve_at(c, (i - 1) / STEPS, (double)((i - 1) % STEPS + 1) / STEPS, at);
        length[i] = length[i - 1] + distance_of(before, at, DIMENSIONS);
        memcpy(before, at, sizeof before);
    }
}

static void place_frames(const pose_curve *c, const double *length, camera_path *out)
{
    const size_t steps = (c->count - 1) * STEPS;
    size_t i = 0;
    for (size_t frame = 0; frame < out->count; frame++) {
        const double wanted = out->count > 1 ? length[steps] * (double)frame / (double)(out->count - 1) : 0;
        while (i + 1 < steps && length[i + 1] < wanted)
            i++;
        const double step = steps > 0 ? length[i + 1] - length[i] : 0,
                     within = step > 0 ? fmin(fmax((wanted - length[i]) / step, 0), 1) : 0;
        gbt_camera camera;
        set_camera(c, i / STEPS, ((double)(i % STEPS) + within) / STEPS, &camera);
        out->shots[frame] = ray_shot_of(&camera);
    }
}

gbt_status camera_path_through(const gbt_camera *keys, size_t count, double turn_length, size_t frames,
                               camera_path *out, gbt_error *err)
{
    pose_curve c = {0};
    double *length = NULL;
    GBT_TRY(camera_path_alloc(out, frames, err));
    gbt_status status = curve_make(keys, count, turn_length, &c, err);
    if (status == GBT_OK) {
        length = mem_alloc((c.count - 1) * STEPS + 1, sizeof *length, "path", err);
        status = length != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    }
    if (status == GBT_OK) {
        measure(&c, length);
        place_frames(&c, length, out);
    }
    mem_free(length);
    curve_free(&c);
    return status;
}

/** Distance of two poses, centre and 2 L q, with the nearer sign of q. Zoom does not count: one lens is used
    for the whole path. */
static double way_between(const gbt_camera *a, const gbt_camera *b, double turn_length)
{
    double p[DIMENSIONS], q[DIMENSIONS];
    point_of(a, a->params[0], turn_length, NULL, p);
    point_of(b, b->params[0], turn_length, p, q);
    return distance_of(p, q, DIMENSIONS);
}

gbt_status camera_path_order(gbt_camera *cameras, size_t count, double turn_length, gbt_error *err)
{
    gbt_camera *nearest = mem_alloc(count, sizeof *nearest, "path", err);
    double as_they_are = 0, to_nearest = 0;
    if (nearest == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 1; i < count; i++)
        as_they_are += way_between(&cameras[i - 1], &cameras[i], turn_length);
    memcpy(nearest, cameras, count * sizeof *nearest);
    for (size_t i = 1; i < count; i++) {
        size_t best = i;
        double least = INFINITY;
        for (size_t j = i; j < count; j++) {
            const double way = way_between(&nearest[i - 1], &nearest[j], turn_length);
            if (way < least) {
                least = way;
                best = j;
            }
        }
        const gbt_camera next = nearest[best];
        memmove(nearest + i + 1, nearest + i, (best - i) * sizeof *nearest); /* the rest keep their order:
                                                                                ties are resolved by name */
        nearest[i] = next;
        to_nearest += least;
    }
    if (to_nearest < as_they_are * 2 / 3)
        memcpy(cameras, nearest, count * sizeof *cameras);
    mem_free(nearest);
    return GBT_OK;
}
