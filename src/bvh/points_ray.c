/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/points_ray.c -- balls that a segment meets. */
#include "base/fail.h"
#include "bvh/device.h"
#include "bvh/point_tree.h"

/* Rays from farther out (in scene sizes) test every site: the clip to the scene in double would no longer be
   finer than the padding. */
static const double ray_origin_limit = 0x1p24;

/* Twice the pad of a box against exact ray origins: ours are rounded to float32 after the clip. */
static double ray_pad(const point_tree *tree) { return 2 * (double)bvh_box_pad((float)tree->reach); }

static void ray_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const point_tree *tree = args->geometryUserPtr;
    embree_receive(args->geometryUserPtr);
    double lower[3], upper[3];
    site_bounds(tree, args->primID, lower, upper);
    site_write_bounds(args->bounds_o, lower, upper, ray_pad(tree));
    struct RTCBounds *b = args->bounds_o;
    b->lower_x = nextafterf(b->lower_x, -INFINITY);
    b->upper_x = nextafterf(b->upper_x, INFINITY);
    b->lower_y = nextafterf(b->lower_y, -INFINITY);
    b->upper_y = nextafterf(b->upper_y, INFINITY);
    b->lower_z = nextafterf(b->lower_z, -INFINITY);
    b->upper_z = nextafterf(b->upper_z, INFINITY);
}

/* Squared distance from a site to the segment: at t = (m . dir) / (dir . dir), m = c - origin, held to
   [t_min, t_max]. */
static double segment_distance_squared(const list_search *s, uint32_t site)
{
    const double *p = s->tree->site + 3 * (size_t)site;
    const double *d = s->dir;
    const double x = p[0] - s->query[0], y = p[1] - s->query[1], z = p[2] - s->query[2];
    const double t =
        fmin(fmax((x * d[0] + y * d[1] + z * d[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), s->t_min),
             s->t_max);
    const double ex = x - t * d[0], ey = y - t * d[1], ez = z - t * d[2];
    return ex * ex + ey * ey + ez * ez;
}

typedef struct ray_search {
    embree_context context; /* first: Embree hands this to the callback */
    list_search list;
} ray_search;

static void visit_ray(const struct RTCIntersectFunctionNArguments *args)
{
    list_search *s = &((ray_search *)args->context)->list;
    list_push_reaching(s, args->primID, segment_distance_squared(s, args->primID));
    /* The ray is left as it is, so Embree goes on to every box. */
}

static gbt_status ray_scene(const point_tree *tree, RTCScene *out, gbt_error *err)
{
    point_tree *shared = (point_tree *)tree; /* the lock makes this one late change safe */
    pthread_mutex_lock(&shared->rays_lock);
    const gbt_status status =
        shared->rays != NULL ? GBT_OK : site_scene_build(tree, ray_bounds, visit_ray, &shared->rays, err);
    *out = shared->rays;
    pthread_mutex_unlock(&shared->rays_lock);
    return status;
}

/* The part of a scaled segment near the scene, in double: false when there is none. Near: within `margin` of
   the bounds of all balls. */
static bool clip(const point_tree *tree, const double origin[3], const double dir[3], double margin,
                 double *t_min, double *t_max)
{
    for (int j = 0; j < 3; j++) {
        const double to_lower = tree->lower[j] - margin - origin[j],
                     to_upper = tree->upper[j] + margin - origin[j];
        if (dir[j] == 0) {
            if (to_lower > 0 || to_upper < 0)
                return false;
            continue;
        }
        const double a = to_lower / dir[j], b = to_upper / dir[j];
        *t_min = fmax(*t_min, fmin(a, b));
        *t_max = fmin(*t_max, fmax(a, b));
    }
    return *t_min <= *t_max;
}

static gbt_status cross_sites(const point_tree *tree, const double scaled_origin[3], ray_search *search)
{
    list_search *s = &search->list;
    /* The longest component of the direction is made 1/2 to 1 by a power of two, which is exact; t follows,
       and the length of the scene. */
    int exponent;
    frexp(fmax(fabs(s->dir[0]), fmax(fabs(s->dir[1]), fabs(s->dir[2]))), &exponent);
    double dir[3];
    for (int j = 0; j < 3; j++)
        dir[j] = ldexp(s->dir[j], -exponent);
    const double t_scale = ldexp(tree->scale, exponent), margin = 4 * ray_pad(tree);
    double t_min = s->t_min * t_scale, t_max = s->t_max * t_scale;
    if (!clip(tree, scaled_origin, dir, margin, &t_min, &t_max))
        return GBT_OK;
    RTCScene scene;
    GBT_TRY(ray_scene(tree, &scene, s->err));
    float start[3], along[3];
    for (int j = 0; j < 3; j++) {
        start[j] = (float)(scaled_origin[j] + t_min * dir[j]);
        along[j] = (float)dir[j];
    }
    /* A ball may touch the very end of the segment: what is lost there by rounding, the padding of its box
       gives back. */
    const float length = round_up((t_max - t_min) * (1 + 0x1p-20));
    if (!bvh_ray_ok(start, along, 0, length))
        return base_fail(s->err, GBT_ERR_INTERNAL, "points: the clipped ray is not finite");
    struct RTCRayHit rayhit = {.ray = {.org_x = start[0],
                                       .org_y = start[1],
                                       .org_z = start[2],
                                       .tnear = 0,
                                       .dir_x = along[0],
                                       .dir_y = along[1],
                                       .dir_z = along[2],
                                       .tfar = length,
                                       .mask = ~0u},
                               .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .primID = RTC_INVALID_GEOMETRY_ID}};
    embree_context_init(&search->context);
    embree_intersect(scene, &search->context, &rayhit);
    return GBT_OK;
}

gbt_status point_tree_crossed(const point_tree *tree, const float origin[3], const float dir[3], float t_min,
                              float t_max, point_list *out, gbt_error *err)
{
    out->count = 0;
    if (!finite3(origin) || !finite3(dir) || (dir[0] == 0 && dir[1] == 0 && dir[2] == 0) || isnan(t_min) ||
        isnan(t_max))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "points: bad ray (wanted finite numbers and a direction, got origin %g %g %g, "
                         "direction %g %g %g, from %g to %g)",
                         (double)origin[0], (double)origin[1], (double)origin[2], (double)dir[0],
                         (double)dir[1], (double)dir[2], (double)t_min, (double)t_max);
    if (tree->site_count == 0 || t_min > t_max || t_min == INFINITY || t_max == -INFINITY)
        return GBT_OK;
    ray_search search = {
        .list = {.tree = tree, .out = out, .err = err, .t_min = (double)t_min, .t_max = (double)t_max}};
    list_search *s = &search.list;
    double scaled[3];
    bool far = tree->reach >= scaled_limit; /* boxes were clamped: balls go on where the clip ends */
    for (int j = 0; j < 3; j++) {
        s->query[j] = (double)origin[j];
        s->dir[j] = (double)dir[j];
        scaled[j] = s->query[j] * tree->scale;
        far = far || fabs(scaled[j]) > ray_origin_limit * tree->reach;
    }
    if (far) {
        for (size_t site = 0; site < tree->site_count; site++)
            list_push_reaching(s, (uint32_t)site, segment_distance_squared(s, (uint32_t)site));
    } else {
        const gbt_status status = cross_sites(tree, scaled, &search);
        if (status != GBT_OK)
            return status;
    }
    return list_finish(s);
}
