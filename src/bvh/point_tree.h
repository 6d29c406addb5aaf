/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/point_tree.h -- inside of a point_tree (bvh/points.h), for the files that build it and those that ask
   it.

   position --> [group equal positions] --> sites --> Embree trees over boxes of sites     point_tree.c
                                                        |  candidates: a superset, in float32
                                                        v
              [decide in double from the float32 input] --> answers, by (distance, index)  points_nearest.c
                                                            or by index       points_list.c, points_ray.c

   A site is one distinct position with the ascending list of the points on it. Embree sees coordinates scaled
   by a power of two so that the largest is about 1: scaling is exact, and squares in its float32 arithmetic
   neither overflow nor vanish. Three trees:
     centers  boxes of no size, for queries on centres: float32 distances to them need no padding
     balls    boxes of the balls, only when there are radii
     rays     the same boxes padded for the slab test; built at the first ray, because padding spoils trees
              with far outliers */
#ifndef GBT_BVH_POINT_TREE_H
#define GBT_BVH_POINT_TREE_H

#include <math.h>
#include <pthread.h>
#include <stdbool.h>

#include "bvh/embree_api.h"
#include "bvh/points.h"

/* In scaled coordinates. Beyond it, float32 squares would not stay finite: boxes are clamped to it, and
   queries from outside test every site; so do all rays when a box was clamped. */
static const double scaled_limit = 0x1p40;

struct point_tree {
    const float *radius; /* borrowed; NULL for points */
    size_t count, site_count;
    /* In double, because Embree calls for boxes in a mode that takes float32 numbers below 1.2e-38 for 0. */
    double *site;              /* [site_count][3], unscaled */
    double *site_radius;       /* [site_count]: largest radius on the site; NULL for points */
    uint32_t *first;           /* [site_count + 1]: site s holds member[first[s] .. first[s+1]) */
    uint32_t *member;          /* [count]: point indices, ascending inside a site */
    double scale;              /* power of two */
    double lower[3], upper[3]; /* of all balls, scaled, clamped */
    double reach;              /* largest |coordinate| of these, at least 1/2 */
    RTCScene centers, balls;
    pthread_mutex_t rays_lock; /* guards the next one */
    RTCScene rays;
};

static inline bool finite3(const float v[3]) { return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]); }

static inline double distance_squared_to(const point_tree *tree, uint32_t site, const double query[3])
{
    const double *p = tree->site + 3 * (size_t)site;
    const double x = p[0] - query[0], y = p[1] - query[1], z = p[2] - query[2];
    return x * x + y * y + z * z;
}

/** The least float that is not less. */
static inline float round_up(double x)
{
    const float f = (float)x;
    return (double)f < x ? nextafterf(f, INFINITY) : f;
}

/** Scaled bounds of a site's balls in double, a little outside the true ones (2^-50 of what was added),
    clamped. */
void site_bounds(const point_tree *tree, size_t site, double lower[3], double upper[3]);

/** Those, grown by `pad` and rounded outwards, as Embree wants them. */
void site_write_bounds(struct RTCBounds *out, const double lower[3], const double upper[3], double pad);

/** An Embree scene of one box per site. `intersect` may be NULL when no ray comes. */
gbt_status site_scene_build(const point_tree *tree, RTCBoundsFunction bounds, RTCIntersectFunctionN intersect,
                            RTCScene *out, gbt_error *err);

/**
 * A radius for Embree that no site at `radius` or nearer can miss: its float32 squares are wrong by a few
 * 2^-24 of themselves, and by 1e-45 where they vanish.
 */
float site_search_radius(const point_tree *tree, double radius);

/** Call `visit` for (at least) every site whose box in `scene` is within `radius` of the query. */
void sites_search(const point_tree *tree, RTCScene scene, const double query[3], double radius,
                  RTCPointQueryFunction visit, void *search);

/** What the queries that answer with a list have in common: points_list.c. */
typedef struct list_search {
    const point_tree *tree;
    double query[3];
    double radius; /* added to every ball's radius; a query on centres when there is no tree->radius or
                      `centers` is set */
    bool centers;
    point_list *out;
    gbt_status status; /* the first failure; the search then runs to its end and keeps nothing */
    gbt_error *err;
    double dir[3], t_min, t_max; /* of a segment that starts at `query` */
} list_search;

/** Push the points of a site whose ball, grown by s->radius, reaches as far as the distance. */
void list_push_reaching(list_search *s, uint32_t site, double d2);

/** Sort what was found; after a failure there is nothing. */
gbt_status list_finish(list_search *s);

#endif
