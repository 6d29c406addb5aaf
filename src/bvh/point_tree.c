/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/point_tree.c -- sites of equal positions, Embree trees over them, and the search that all point queries
   share. */
#include "bvh/point_tree.h"

#include "base/fail.h"
#include "base/memory.h"
#include "bvh/device.h"

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
    if (slot == NULL || site_of == NULL || tree->site == NULL || tree->first == NULL ||
        tree->member == NULL || (tree->radius != NULL && tree->site_radius == NULL))
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
    /* first[s] walks to the end of its list while the list is filled, and is then the start of the next:
       moved back by one below. */
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

void site_bounds(const point_tree *tree, size_t site, double lower[3], double upper[3])
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

void site_write_bounds(struct RTCBounds *out, const double lower[3], const double upper[3], double pad)
{
    out->lower_x = round_down(lower[0] - pad);
    out->upper_x = round_up(upper[0] + pad);
    out->lower_y = round_down(lower[1] - pad);
    out->upper_y = round_up(upper[1] + pad);
    out->lower_z = round_down(lower[2] - pad);
    out->upper_z = round_up(upper[2] + pad);
}

static void center_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const point_tree *tree = args->geometryUserPtr;
    embree_receive(args->geometryUserPtr);
    double center[3];
    for (int j = 0; j < 3; j++)
        center[j] = tree->site[3 * (size_t)args->primID + j] * tree->scale;
    site_write_bounds(args->bounds_o, center, center, 0);
}

static void ball_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const point_tree *tree = args->geometryUserPtr;
    embree_receive(args->geometryUserPtr);
    double lower[3], upper[3];
    site_bounds(tree, args->primID, lower, upper);
    site_write_bounds(args->bounds_o, lower, upper, 0);
}

gbt_status site_scene_build(const point_tree *tree, RTCBoundsFunction bounds, RTCIntersectFunctionN intersect,
                            RTCScene *out, gbt_error *err)
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
        return base_fail(err, GBT_ERR_ARGUMENT, "points: too many (wanted fewer than 2^32 - 1, got %zu)",
                         count);
    for (size_t i = 0; i < count; i++) {
        for (int j = 0; j < 3; j++)
            if (!isfinite(position[3 * i + j]))
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "points: point %zu: bad coordinate (wanted a finite number, got %g)", i,
                                 (double)position[3 * i + j]);
        if (radius != NULL && !(radius[i] >= 0 && isfinite(radius[i])))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "points: point %zu: bad radius (wanted a finite number >= 0, got %g)", i,
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
    for (int j = 0; j < 3; j++) {
        tree->lower[j] = INFINITY;
        tree->upper[j] = -INFINITY;
    }
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

gbt_status point_tree_build(const float *position, const float *radius, size_t count, point_tree **out,
                            gbt_error *err)
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
        status = site_scene_build(tree, center_bounds, NULL, &tree->centers, err);
        if (status == GBT_OK && radius != NULL)
            status = site_scene_build(tree, ball_bounds, NULL, &tree->balls, err);
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

/* ---- search ---- */

float site_search_radius(const point_tree *tree, double radius)
{
    const double scaled = radius * tree->scale * (1 + 0x1p-20) + 1e-18;
    return scaled < 1e18 ? (float)scaled : INFINITY;
}

void sites_search(const point_tree *tree, RTCScene scene, const double query[3], double radius,
                  RTCPointQueryFunction visit, void *search)
{
    if (tree->site_count == 0)
        return;
    const double x = query[0] * tree->scale, y = query[1] * tree->scale, z = query[2] * tree->scale;
    struct RTCPointQuery point = {.radius = site_search_radius(tree, radius)};
    if (fmax(fabs(x), fmax(fabs(y), fabs(z))) > scaled_limit) {
        for (size_t s = 0; s < tree->site_count; s++)
            visit(&(struct RTCPointQueryFunctionArguments){
                .query = &point, .userPtr = search, .primID = (unsigned)s});
        return;
    }
    point.x = (float)x;
    point.y = (float)y;
    point.z = (float)z;
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene, &point, &context, visit, search);
}
