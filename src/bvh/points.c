/* bvh/points.c -- exact queries on balls.

   position --> [group equal positions] --> sites --> Embree trees over boxes of sites
                                                        |  candidates: a superset, in float32
                                                        v
                            [decide in double from the float32 input] --> answers, ordered by (distance, index) or by index

   A site is one distinct position with the ascending list of the points on it. Embree sees coordinates scaled by a power of two so that
   the largest is about 1: scaling is exact, and squares in its float32 arithmetic neither overflow nor vanish. Three trees:
     centers  boxes of no size, for queries on centres: float32 distances to them need no padding
     balls    boxes of the balls, only when there are radii
     rays     the same boxes padded for the slab test; built at the first ray, because padding spoils trees with far outliers */
#include "bvh/points.h"

#include <fenv.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "bvh/device.h"
#include "bvh/embree_api.h"

/* In scaled coordinates. Beyond it, float32 squares would not stay finite: boxes are clamped to it, and queries from outside test every
   site; so do all rays when a box was clamped. */
static const double scaled_limit = 0x1p40;

/* Rays from farther out (in scene sizes) test every site: the clip to the scene in double would no longer be finer than the padding. */
static const double ray_origin_limit = 0x1p24;

enum { MAX_NEIGHBOURS = 64, SPACING_GRAIN = 512 };

struct point_tree {
    const float *radius; /* borrowed; NULL for points */
    size_t count, site_count;
    /* In double, because Embree calls for boxes in a mode that takes float32 numbers below 1.2e-38 for 0. */
    double *site;        /* [site_count][3], unscaled */
    double *site_radius; /* [site_count]: largest radius on the site; NULL for points */
    uint32_t *first;     /* [site_count + 1]: site s holds member[first[s] .. first[s+1]) */
    uint32_t *member;    /* [count]: point indices, ascending inside a site */
    double scale;       /* power of two */
    double lower[3], upper[3]; /* of all balls, scaled, clamped */
    double reach;              /* largest |coordinate| of these, at least 1/2 */
    RTCScene centers, balls;
    pthread_mutex_t rays_lock; /* guards the next one */
    RTCScene rays;
};

/* ---- sites ---- */

/* Equal floats have equal bits here: the sum turns -0 into +0. */
static uint64_t hash_position(const float p[3])
{
    union {
        float value[3];
        uint32_t bits[3];
    } key = {.value = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f}};
    uint64_t h = ((uint64_t)key.bits[0] << 32 | key.bits[1]) * 0x9E3779B97F4A7C15u;
    h = (h ^ h >> 29 ^ key.bits[2]) * 0xBF58476D1CE4E5B9u;
    h = (h ^ h >> 32) * 0x94D049BB133111EBu;
    return h ^ h >> 29;
}

static bool same_position(const double site[3], const float p[3])
{
    return site[0] == (double)p[0] && site[1] == (double)p[1] && site[2] == (double)p[2];
}

/* Sites in the order of their first points; member lists by counting, so they ascend. */
static gbt_status group_points(point_tree *tree, const float *position, gbt_error *err)
{
    const size_t count = tree->count;
    size_t slots = 16;
    while (slots < 2 * count)
        slots *= 2;
    gbt_status status = GBT_ERR_NO_MEMORY;
    uint32_t *slot = mem_calloc(slots, sizeof *slot, "points.slots", err); /* site + 1, or 0 */
    uint32_t *site_of = mem_alloc(count, sizeof *site_of, "points.site_of", err);
    tree->site = mem_alloc(count, 3 * sizeof *tree->site, "points.site", err);
    tree->first = mem_calloc(count + 1, sizeof *tree->first, "points.first", err);
    tree->member = mem_alloc(count, sizeof *tree->member, "points.member", err);
    if (tree->radius != NULL)
        tree->site_radius = mem_calloc(count, sizeof *tree->site_radius, "points.site_radius", err);
    if (slot == NULL || site_of == NULL || tree->site == NULL || tree->first == NULL || tree->member == NULL ||
        (tree->radius != NULL && tree->site_radius == NULL))
        goto done;

    for (size_t i = 0; i < count; i++) {
        const float *p = position + 3 * i;
        size_t at = hash_position(p) & (slots - 1);
        while (slot[at] != 0 && !same_position(tree->site + 3 * (size_t)(slot[at] - 1), p))
            at = (at + 1) & (slots - 1);
        if (slot[at] == 0) {
            for (int j = 0; j < 3; j++)
                tree->site[3 * tree->site_count + j] = (double)p[j];
            slot[at] = (uint32_t)++tree->site_count;
        }
        site_of[i] = slot[at] - 1;
        tree->first[site_of[i] + 1]++;
        if (tree->radius != NULL)
            tree->site_radius[site_of[i]] = fmax(tree->site_radius[site_of[i]], (double)tree->radius[i]);
    }
    for (size_t s = 0; s < tree->site_count; s++)
        tree->first[s + 1] += tree->first[s];
    /* first[s] walks to the end of its list while the list is filled, and is then the start of the next: moved back by one below. */
    for (size_t i = 0; i < count; i++)
        tree->member[tree->first[site_of[i]]++] = (uint32_t)i;
    for (size_t s = tree->site_count; s > 0; s--)
        tree->first[s] = tree->first[s - 1];
    tree->first[0] = 0;
    status = GBT_OK;
done:
    mem_free(slot);
    mem_free(site_of);
    return status;
}

/* ---- boxes ---- */

/* Scaled bounds of a site's balls in double, a little outside the true ones (2^-50 of what was added), clamped. */
static void site_bounds(const point_tree *tree, size_t site, double lower[3], double upper[3])
{
    const double radius = tree->site_radius != NULL ? tree->site_radius[site] * tree->scale : 0;
    for (int j = 0; j < 3; j++) {
        const double center = tree->site[3 * site + j] * tree->scale;
        const double half = radius > 0 ? radius + 0x1p-50 * (fabs(center) + radius) : 0;
        lower[j] = fmax(center - half, -scaled_limit);
        upper[j] = fmin(center + half, scaled_limit);
    }
}

static float round_down(double x)
{
    const float f = (float)x;
    return (double)f > x ? nextafterf(f, -INFINITY) : f;
}

static float round_up(double x)
{
    const float f = (float)x;
    return (double)f < x ? nextafterf(f, INFINITY) : f;
}

static void write_bounds(struct RTCBounds *out, const double lower[3], const double upper[3], double pad)
{
    out->lower_x = round_down(lower[0] - pad), out->upper_x = round_up(upper[0] + pad);
    out->lower_y = round_down(lower[1] - pad), out->upper_y = round_up(upper[1] + pad);
    out->lower_z = round_down(lower[2] - pad), out->upper_z = round_up(upper[2] + pad);
}

static void center_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const point_tree *tree = args->geometryUserPtr;
    embree_receive(args->geometryUserPtr);
    double center[3];
    for (int j = 0; j < 3; j++)
        center[j] = tree->site[3 * (size_t)args->primID + j] * tree->scale;
    write_bounds(args->bounds_o, center, center, 0);
}

static void ball_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const point_tree *tree = args->geometryUserPtr;
    embree_receive(args->geometryUserPtr);
    double lower[3], upper[3];
    site_bounds(tree, args->primID, lower, upper);
    write_bounds(args->bounds_o, lower, upper, 0);
}

/* Twice the pad of a box against exact ray origins: ours are rounded to float32 after the clip. */
static double ray_pad(const point_tree *tree)
{
    return 2 * (double)bvh_box_pad((float)tree->reach);
}

static void ray_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const point_tree *tree = args->geometryUserPtr;
    embree_receive(args->geometryUserPtr);
    double lower[3], upper[3];
    site_bounds(tree, args->primID, lower, upper);
    write_bounds(args->bounds_o, lower, upper, ray_pad(tree));
    struct RTCBounds *b = args->bounds_o;
    b->lower_x = nextafterf(b->lower_x, -INFINITY), b->upper_x = nextafterf(b->upper_x, INFINITY);
    b->lower_y = nextafterf(b->lower_y, -INFINITY), b->upper_y = nextafterf(b->upper_y, INFINITY);
    b->lower_z = nextafterf(b->lower_z, -INFINITY), b->upper_z = nextafterf(b->upper_z, INFINITY);
}

static gbt_status build_scene(const point_tree *tree, RTCBoundsFunction bounds, RTCIntersectFunctionN intersect, RTCScene *out,
                              gbt_error *err)
{
    RTCDevice device = bvh_device(err);
    if (device == NULL)
        return bvh_check("points", err);
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    gbt_status status = bvh_check("points", err);
    if (status == GBT_OK) {
        rtcSetGeometryUserPrimitiveCount(geometry, (unsigned)tree->site_count);
        rtcSetGeometryUserData(geometry, (void *)tree);
        rtcSetGeometryBoundsFunction(geometry, bounds, NULL);
        if (intersect != NULL)
            rtcSetGeometryIntersectFunction(geometry, intersect);
        embree_publish((void *)tree);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcCommitScene(scene);
        status = bvh_check("points", err);
    }
    if (geometry != NULL)
        rtcReleaseGeometry(geometry); /* the scene holds its own reference */
    if (status == GBT_OK)
        *out = scene;
    else if (scene != NULL)
        rtcReleaseScene(scene);
    return status;
}

/* ---- build ---- */

static gbt_status check_points(const float *position, const float *radius, size_t count, gbt_error *err)
{
    if (count >= UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "points: too many (wanted fewer than 2^32 - 1, got %zu)", count);
    for (size_t i = 0; i < count; i++) {
        for (int j = 0; j < 3; j++)
            if (!isfinite(position[3 * i + j]))
                return base_fail(err, GBT_ERR_ARGUMENT, "points: point %zu: bad coordinate (wanted a finite number, got %g)", i,
                                 (double)position[3 * i + j]);
        if (radius != NULL && !(radius[i] >= 0 && isfinite(radius[i])))
            return base_fail(err, GBT_ERR_ARGUMENT, "points: point %zu: bad radius (wanted a finite number >= 0, got %g)", i,
                             (double)radius[i]);
    }
    return GBT_OK;
}

static void measure(point_tree *tree)
{
    double largest = 0, largest_radius = 0;
    for (size_t i = 0; i < 3 * tree->site_count; i++)
        largest = fmax(largest, fabs(tree->site[i]));
    for (size_t s = 0; s < tree->site_count && tree->site_radius != NULL; s++)
        largest_radius = fmax(largest_radius, tree->site_radius[s]);
    int exponent = 0;
    frexp(largest > 0 ? largest : largest_radius, &exponent);
    tree->scale = ldexp(1, -exponent);
    for (int j = 0; j < 3; j++)
        tree->lower[j] = INFINITY, tree->upper[j] = -INFINITY;
    tree->reach = 0.5;
    for (size_t s = 0; s < tree->site_count; s++) {
        double lower[3], upper[3];
        site_bounds(tree, s, lower, upper);
        for (int j = 0; j < 3; j++) {
            tree->lower[j] = fmin(tree->lower[j], lower[j]);
            tree->upper[j] = fmax(tree->upper[j], upper[j]);
            tree->reach = fmax(tree->reach, fmax(-lower[j], upper[j]));
        }
    }
}

gbt_status point_tree_build(const float *position, const float *radius, size_t count, point_tree **out, gbt_error *err)
{
    *out = NULL;
    GBT_TRY(check_points(position, radius, count, err));
    point_tree *tree = mem_calloc(1, sizeof *tree, "points", err);
    if (tree == NULL)
        return GBT_ERR_NO_MEMORY;
    tree->radius = radius;
    tree->count = count;
    pthread_mutex_init(&tree->rays_lock, NULL);
    gbt_status status = group_points(tree, position, err);
    if (status == GBT_OK && count > 0) {
        measure(tree);
        status = build_scene(tree, center_bounds, NULL, &tree->centers, err);
        if (status == GBT_OK && radius != NULL)
            status = build_scene(tree, ball_bounds, NULL, &tree->balls, err);
    }
    if (status != GBT_OK) {
        point_tree_free(tree);
        return status;
    }
    *out = tree;
    return GBT_OK;
}

void point_tree_free(point_tree *tree)
{
    if (tree == NULL)
        return;
    RTCScene scenes[3] = {tree->centers, tree->balls, tree->rays};
    for (int i = 0; i < 3; i++)
        if (scenes[i] != NULL)
            rtcReleaseScene(scenes[i]);
    pthread_mutex_destroy(&tree->rays_lock);
    mem_free(tree->site);
    mem_free(tree->site_radius);
    mem_free(tree->first);
    mem_free(tree->member);
    mem_free(tree);
}

/* ---- point queries ---- */

static bool finite3(const float v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

static double distance_squared_to(const point_tree *tree, uint32_t site, const double query[3])
{
    const double *p = tree->site + 3 * (size_t)site;
    const double x = p[0] - query[0], y = p[1] - query[1], z = p[2] - query[2];
    return x * x + y * y + z * z;
}

/* A radius for Embree that no site at `radius` or nearer can miss: its float32 squares are wrong by a few 2^-24 of themselves, and by
   1e-45 where they vanish. */
static float search_radius(const point_tree *tree, double radius)
{
    const double scaled = radius * tree->scale * (1 + 0x1p-20) + 1e-18;
    return scaled < 1e18 ? (float)scaled : INFINITY;
}

/* Call `visit` for (at least) every site whose box in `scene` is within `radius` of the query. */
static void search_sites(const point_tree *tree, RTCScene scene, const double query[3], double radius, RTCPointQueryFunction visit,
                         void *search)
{
    if (tree->site_count == 0)
        return;
    const double x = query[0] * tree->scale, y = query[1] * tree->scale, z = query[2] * tree->scale;
    struct RTCPointQuery point = {.radius = search_radius(tree, radius)};
    if (fmax(fabs(x), fmax(fabs(y), fabs(z))) > scaled_limit) {
        for (size_t s = 0; s < tree->site_count; s++)
            visit(&(struct RTCPointQueryFunctionArguments){.query = &point, .userPtr = search, .primID = (unsigned)s});
        return;
    }
    point.x = (float)x, point.y = (float)y, point.z = (float)z;
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene, &point, &context, visit, search);
}

typedef struct nearest_search {
    const point_tree *tree;
    double query[3];
    size_t k, skip, found;
    uint32_t *index;          /* [k], ordered by (distance, index) */
    double *distance_squared; /* [k] */
} nearest_search;

/* False when the point is worse than all k that are known. */
static bool insert_nearest(nearest_search *s, uint32_t index, double d2)
{
    if (s->found == s->k) {
        const size_t last = s->k - 1;
        if (d2 > s->distance_squared[last] || (d2 == s->distance_squared[last] && index > s->index[last]))
            return false;
    } else {
        s->found++;
    }
    size_t at = s->found - 1;
    for (; at > 0 && (d2 < s->distance_squared[at - 1] || (d2 == s->distance_squared[at - 1] && index < s->index[at - 1])); at--) {
        s->distance_squared[at] = s->distance_squared[at - 1];
        s->index[at] = s->index[at - 1];
    }
    s->distance_squared[at] = d2;
    s->index[at] = index;
    return true;
}

static bool visit_nearest(struct RTCPointQueryFunctionArguments *args)
{
    nearest_search *s = args->userPtr;
    const point_tree *tree = s->tree;
    const double d2 = distance_squared_to(tree, args->primID, s->query);
    if (s->found == s->k && d2 > s->distance_squared[s->k - 1])
        return false;
    /* The list ascends and all of it is at one distance: after the first that is refused, so are the rest. */
    for (uint32_t m = tree->first[args->primID]; m < tree->first[args->primID + 1]; m++)
        if (tree->member[m] != s->skip && !insert_nearest(s, tree->member[m], d2))
            break;
    if (s->found < s->k)
        return false;
    const float radius = search_radius(tree, sqrt(s->distance_squared[s->k - 1]));
    if (!(radius < args->query->radius))
        return false;
    args->query->radius = radius; /* sites at exactly the k-th distance stay inside: they may have a lower index */
    return true;
}

static size_t find_nearest(const point_tree *tree, const double query[3], size_t k, size_t skip, uint32_t *index, double *distance_squared)
{
    nearest_search search = {.tree = tree, .query = {query[0], query[1], query[2]}, .k = k, .skip = skip, .index = index,
                             .distance_squared = distance_squared};
    search_sites(tree, tree->centers, query, INFINITY, visit_nearest, &search);
    return search.found;
}

size_t point_tree_nearest(const point_tree *tree, const float query[3], size_t k, size_t skip, uint32_t *index, double *distance_squared)
{
    if (k == 0 || !finite3(query))
        return 0;
    const double exact[3] = {(double)query[0], (double)query[1], (double)query[2]};
    return find_nearest(tree, exact, k, skip, index, distance_squared);
}

/* ---- lists ---- */

void point_list_free(point_list *list)
{
    mem_free(list->index);
    *list = (point_list){0};
}

static int compare_index(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

typedef struct list_search {
    const point_tree *tree;
    double query[3];
    double radius; /* added to every ball's radius; a query on centres when there is no tree->radius or `centers` is set */
    bool centers;
    point_list *out;
    gbt_status status; /* the first failure; the search then runs to its end and keeps nothing */
    gbt_error *err;
    double dir[3], t_min, t_max; /* of a segment that starts at `query` */
} list_search;

static void push(list_search *s, uint32_t index)
{
    if (s->status != GBT_OK)
        return;
    s->status = mem_reserve((void **)&s->out->index, &s->out->capacity, s->out->count, s->out->count + 1, sizeof *s->out->index,
                            "points.list", s->err);
    if (s->status == GBT_OK)
        s->out->index[s->out->count++] = index;
}

/* Push the points of a site whose ball, grown by s->radius, reaches as far as the distance. */
static void push_reaching(list_search *s, uint32_t site, double d2)
{
    const point_tree *tree = s->tree;
    for (uint32_t m = tree->first[site]; m < tree->first[site + 1]; m++) {
        const uint32_t index = tree->member[m];
        const double reach = s->radius + (s->centers || tree->radius == NULL ? 0 : (double)tree->radius[index]);
        if (d2 <= reach * reach)
            push(s, index);
    }
}

static bool visit_list(struct RTCPointQueryFunctionArguments *args)
{
    list_search *s = args->userPtr;
    push_reaching(s, args->primID, distance_squared_to(s->tree, args->primID, s->query));
    return false; /* the radius has not changed */
}

static gbt_status finish_list(list_search *s)
{
    if (s->status != GBT_OK)
        s->out->count = 0;
    else if (s->out->count > 1)
        qsort(s->out->index, s->out->count, sizeof *s->out->index, compare_index);
    return s->status;
}

static gbt_status list_sites(const point_tree *tree, const float query[3], float radius, bool centers, point_list *out, gbt_error *err)
{
    out->count = 0;
    if (!finite3(query))
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad query (wanted finite coordinates, got %g %g %g)", (double)query[0],
                         (double)query[1], (double)query[2]);
    if (!(radius >= 0))
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad search radius (wanted >= 0, got %g)", (double)radius);
    list_search search = {.tree = tree, .query = {(double)query[0], (double)query[1], (double)query[2]}, .radius = (double)radius,
                          .centers = centers, .out = out, .err = err};
    RTCScene scene = centers || tree->radius == NULL ? tree->centers : tree->balls;
    search_sites(tree, scene, search.query, search.radius, visit_list, &search);
    return finish_list(&search);
}

gbt_status point_tree_within(const point_tree *tree, const float query[3], float radius, point_list *out, gbt_error *err)
{
    return list_sites(tree, query, radius, true, out, err);
}

gbt_status point_tree_containing(const point_tree *tree, const float query[3], point_list *out, gbt_error *err)
{
    return list_sites(tree, query, 0, false, out, err);
}

gbt_status point_tree_overlapping(const point_tree *tree, const float query[3], float radius, point_list *out, gbt_error *err)
{
    return list_sites(tree, query, radius, false, out, err);
}

/* ---- rays ---- */

/* Squared distance from a site to the segment: at t = (m . dir) / (dir . dir), m = c - origin, held to [t_min, t_max]. */
static double segment_distance_squared(const list_search *s, uint32_t site)
{
    const double *p = s->tree->site + 3 * (size_t)site;
    const double *d = s->dir;
    const double x = p[0] - s->query[0], y = p[1] - s->query[1], z = p[2] - s->query[2];
    const double t = fmin(fmax((x * d[0] + y * d[1] + z * d[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), s->t_min), s->t_max);
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
    push_reaching(s, args->primID, segment_distance_squared(s, args->primID));
    /* The ray is left as it is, so Embree goes on to every box. */
}

static gbt_status ray_scene(const point_tree *tree, RTCScene *out, gbt_error *err)
{
    point_tree *shared = (point_tree *)tree; /* the lock makes this one late change safe */
    pthread_mutex_lock(&shared->rays_lock);
    const gbt_status status = shared->rays != NULL ? GBT_OK : build_scene(tree, ray_bounds, visit_ray, &shared->rays, err);
    *out = shared->rays;
    pthread_mutex_unlock(&shared->rays_lock);
    return status;
}

/* The part of a scaled segment near the scene, in double: false when there is none. Near: within `margin` of the bounds of all balls. */
static bool clip(const point_tree *tree, const double origin[3], const double dir[3], double margin, double *t_min, double *t_max)
{
    for (int j = 0; j < 3; j++) {
        const double to_lower = tree->lower[j] - margin - origin[j], to_upper = tree->upper[j] + margin - origin[j];
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
    /* The longest component of the direction is made 1/2 to 1 by a power of two, which is exact; t follows, and the length of the scene. */
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
    for (int j = 0; j < 3; j++)
        start[j] = (float)(scaled_origin[j] + t_min * dir[j]), along[j] = (float)dir[j];
    /* A ball may touch the very end of the segment: what is lost there by rounding, the padding of its box gives back. */
    const float length = round_up((t_max - t_min) * (1 + 0x1p-20));
    if (!bvh_ray_ok(start, along, 0, length))
        return base_fail(s->err, GBT_ERR_INTERNAL, "points: the clipped ray is not finite");
    struct RTCRayHit rayhit = {.ray = {.org_x = start[0], .org_y = start[1], .org_z = start[2], .tnear = 0,
                                       .dir_x = along[0], .dir_y = along[1], .dir_z = along[2], .tfar = length, .mask = ~0u},
                               .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .primID = RTC_INVALID_GEOMETRY_ID}};
    embree_context_init(&search->context);
    embree_intersect(scene, &search->context, &rayhit);
    return GBT_OK;
}

gbt_status point_tree_crossed(const point_tree *tree, const float origin[3], const float dir[3], float t_min, float t_max, point_list *out,
                              gbt_error *err)
{
    out->count = 0;
    if (!finite3(origin) || !finite3(dir) || (dir[0] == 0 && dir[1] == 0 && dir[2] == 0) || isnan(t_min) || isnan(t_max))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "points: bad ray (wanted finite numbers and a direction, got origin %g %g %g, direction %g %g %g, from %g to %g)",
                         (double)origin[0], (double)origin[1], (double)origin[2], (double)dir[0], (double)dir[1], (double)dir[2],
                         (double)t_min, (double)t_max);
    if (tree->site_count == 0 || t_min > t_max || t_min == INFINITY || t_max == -INFINITY)
        return GBT_OK;
    ray_search search = {.list = {.tree = tree, .out = out, .err = err, .t_min = (double)t_min, .t_max = (double)t_max}};
    list_search *s = &search.list;
    double scaled[3];
    bool far = tree->reach >= scaled_limit; /* boxes were clamped: balls go on where the clip ends */
    for (int j = 0; j < 3; j++) {
        s->query[j] = (double)origin[j], s->dir[j] = (double)dir[j];
        scaled[j] = s->query[j] * tree->scale;
        far = far || fabs(scaled[j]) > ray_origin_limit * tree->reach;
    }
    if (far) {
        for (size_t site = 0; site < tree->site_count; site++)
            push_reaching(s, (uint32_t)site, segment_distance_squared(s, (uint32_t)site));
    } else {
        const gbt_status status = cross_sites(tree, scaled, &search);
        if (status != GBT_OK)
            return status;
    }
    return finish_list(s);
}

/* ---- spacing ---- */

typedef struct spacing_job {
    const point_tree *tree;
    size_t k;
    float *spacing;
} spacing_job;

static void space_sites(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const spacing_job *job = context;
    const point_tree *tree = job->tree;
    uint32_t index[MAX_NEIGHBOURS + 1];
    double d2[MAX_NEIGHBOURS + 1];
    /* Threads of oneTBB may have inherited Embree's mode that flushes small numbers to 0: then the bits would depend on the thread. */
    fenv_t before;
    fegetenv(&before);
    fesetenv(FE_DFL_ENV);
    for (size_t site = begin; site < end; site++) {
        const uint32_t first = tree->first[site], last = tree->first[site + 1];
        double spacing = 0;
        if (last - first <= job->k) { /* else k others are here */
            const size_t found = find_nearest(tree, tree->site + 3 * site, job->k + 1, SIZE_MAX, index, d2);
            double sum = 0;
            for (size_t i = 1; i < found; i++) /* 0 is a point of the site itself */
                sum += d2[i];
            if (found > 1)
                spacing = sqrt(sum / (double)(found - 1));
        }
        for (uint32_t m = first; m < last; m++)
            job->spacing[tree->member[m]] = (float)spacing;
    }
    fesetenv(&before);
}

gbt_status point_tree_spacing(const point_tree *tree, size_t k, float *spacing, gbt_error *err)
{
    if (k < 1 || k > MAX_NEIGHBOURS)
        return base_fail(err, GBT_ERR_ARGUMENT, "points: bad number of neighbours (wanted 1..%d, got %zu)", (int)MAX_NEIGHBOURS, k);
    spacing_job job = {.tree = tree, .k = k, .spacing = spacing};
    parallel_blocks(tree->site_count, SPACING_GRAIN, space_sites, &job);
    return GBT_OK;
}
