/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/mesh.c -- rays against a triangle mesh.

     vertices, triangles --> [check, copy into Embree's buffers] --> commit
          --> rtcIntersect1 finds candidates, a filter decides about each in double

   Embree keeps the only copy of the mesh: distances and normals are computed from its buffers. */
#include "bvh/mesh.h"

#include <float.h>
#include <math.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"
#include "bvh/device.h"
#include "bvh/embree_api.h"

struct mesh_tree {
    RTCScene scene;
    const float *vertices;     /* [][3], in the scene */
    const uint32_t *triangles; /* [][3], in the scene */
};

/* Travels with the ray: the ray as the caller gave it, and the best hit so far. */
typedef struct search {
    embree_context context; /* first: Embree hands this to the filters */
    const mesh_tree *tree;
    const float *origin, *dir;
    float t_max;
    mesh_hit best; /* without the normal */
} search;

static void corner_differences(const mesh_tree *tree, uint32_t triangle, double ab[3], double ac[3])
{
    const uint32_t *corner = tree->triangles + 3 * (size_t)triangle;
    const float *a = tree->vertices + 3 * (size_t)corner[0], *b = tree->vertices + 3 * (size_t)corner[1],
                *c = tree->vertices + 3 * (size_t)corner[2];
    for (int i = 0; i < 3; i++) {
        ab[i] = (double)b[i] - (double)a[i];
        ac[i] = (double)c[i] - (double)a[i];
    }
}

/* Where the line through the ray meets the plane of a triangle: t, and the weights u, v of its second and
   third corner. Embree's own t depends on the instruction set in the last bits; this does not. False when
   they are parallel or the triangle has no area. */
static bool meet(const search *s, uint32_t triangle, double *t, double *u, double *v)
{
    const float *a = s->tree->vertices + 3 * (size_t)s->tree->triangles[3 * (size_t)triangle];
    double ab[3], ac[3], normal[3], from_a[3], dir[3], across[3];
    corner_differences(s->tree, triangle, ab, ac);
    for (int i = 0; i < 3; i++) {
        from_a[i] = (double)s->origin[i] - (double)a[i];
        dir[i] = (double)s->dir[i];
    }
    dvec_cross(ab, ac, normal);
    dvec_cross(from_a, dir, across);
    const double det = dvec_dot(dir, normal);
    *t = -dvec_dot(from_a, normal) / det;
    *u = -dvec_dot(ac, across) / det;
    *v = dvec_dot(ab, across) / det;
    return isfinite(*t) && isfinite(*u) && isfinite(*v);
}

/* Decides about a hit that Embree offers, by the exact t: it is recorded if it is in range and better than
   the best so far. */
static bool take(const struct RTCFilterFunctionNArguments *args)
{
    search *s = (search *)args->context;
    /* One ray at a time: Embree's packets of one have the layout of the plain structs. */
    const uint32_t triangle = ((const struct RTCHit *)args->hit)->primID;
    double t_exact, u, v;
    if (!meet(s, triangle, &t_exact, &u, &v) || fabs(t_exact) > (double)FLT_MAX)
        return false;
    const float t = (float)t_exact;
    if (!(t > 0 && t <= s->t_max && (t < s->best.t || (t == s->best.t && triangle < s->best.triangle))))
        return false;
    /* u and v are not clamped to the triangle: at an edge that would move the point by the error of Embree's
       float. */
    s->best = (mesh_hit){.t = t, .u = u, .v = v, .triangle = triangle};
    return true;
}

/* The filter of both kinds of query. Embree keeps the last hit that is not refused, and afterwards offers
   only nearer or equal ones. Without the choice by number, the shape of the tree would decide between equal
   ones. */
static void filter(const struct RTCFilterFunctionNArguments *args)
{
    if (!take(args))
        args->valid[0] = 0;
}

gbt_status mesh_check_triangles(const uint32_t *triangles, size_t triangle_count, size_t vertex_count,
                                gbt_error *err)
{
    for (size_t i = 0; i < 3 * triangle_count; i++)
        if (triangles[i] >= vertex_count)
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "mesh: triangle %zu: bad vertex number (wanted < %zu, got %u)", i / 3,
                             vertex_count, triangles[i]);
    return GBT_OK;
}

static gbt_status check_mesh(const float *vertices, size_t vertex_count, const uint32_t *triangles,
                             size_t triangle_count, gbt_error *err)
{
    if (vertex_count >= UINT32_MAX || triangle_count >= UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "mesh: %zu vertices and %zu triangles (wanted fewer than 2^32 - 1 of each)",
                         vertex_count, triangle_count);
    for (size_t i = 0; i < 3 * vertex_count; i++)
        if (!(fabsf(vertices[i]) <= MESH_COORDINATE_LIMIT))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "mesh: vertex %zu: bad coordinate (wanted |x| <= %g, got %g)", i / 3,
                             (double)MESH_COORDINATE_LIMIT, (double)vertices[i]);
    return mesh_check_triangles(triangles, triangle_count, vertex_count, err);
}

static gbt_status fill_scene(mesh_tree *tree, RTCDevice device, const float *vertices, size_t vertex_count,
                             const uint32_t *triangles, size_t triangle_count, gbt_error *err)
{
    tree->scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    gbt_status status = bvh_check("mesh", err);
    if (status != GBT_OK)
        goto done;
    /* Embree reads 16 bytes at every vertex. Its own buffers have room for that; those of the caller may
       not. */
    float *vertex = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                            3 * sizeof *vertex, vertex_count);
    uint32_t *index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof *index, triangle_count);
    status = bvh_check("mesh", err);
    if (status != GBT_OK)
        goto done;
    for (size_t i = 0; i < 3 * vertex_count; i++)
        vertex[i] = vertices[i];
    for (size_t i = 0; i < 3 * triangle_count; i++)
        index[i] = triangles[i];
    tree->vertices = vertex;
    tree->triangles = index;
    rtcSetGeometryIntersectFilterFunction(geometry, filter);
    rtcSetGeometryOccludedFilterFunction(geometry, filter);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(tree->scene, geometry);
    rtcSetSceneFlags(tree->scene, RTC_SCENE_FLAG_ROBUST); /* no gaps along shared edges */
    rtcCommitScene(tree->scene);
    status = bvh_check("mesh", err);
done:
    if (geometry != NULL)
        rtcReleaseGeometry(geometry); /* the scene holds its own reference */
    return status;
}

gbt_status mesh_tree_build(const float *vertices, size_t vertex_count, const uint32_t *triangles,
                           size_t triangle_count, mesh_tree **out, gbt_error *err)
{
    *out = NULL;
    GBT_TRY(check_mesh(vertices, vertex_count, triangles, triangle_count, err));
    mesh_tree *tree = mem_calloc(1, sizeof *tree, "mesh", err);
    if (tree == NULL)
        return GBT_ERR_NO_MEMORY;
    if (vertex_count > 0 && triangle_count > 0) {
        RTCDevice device = bvh_device(err);
        const gbt_status status =
            device != NULL ? fill_scene(tree, device, vertices, vertex_count, triangles, triangle_count, err)
                           : bvh_check("mesh", err);
        if (status != GBT_OK) {
            mesh_tree_free(tree);
            return status;
        }
    }
    *out = tree;
    return GBT_OK;
}

/* False when the ray cannot be traced. Embree gets a slightly wider range than asked for, because the filter
   decides in double; and a direction of unusual length scaled by a power of two, which is exact, because
   Embree replaces components below 1e-18 by others. */
static bool prepare(const mesh_tree *tree, const float origin[3], const float dir[3], float t_max, search *s,
                    struct RTCRay *ray)
{
    if (tree->scene == NULL || !(t_max >= 0))
        return false;
    const int exponent = bvh_ray_exponent(dir);
    const float scaled[3] = {ldexpf(dir[0], -exponent), ldexpf(dir[1], -exponent), ldexpf(dir[2], -exponent)};
    const float t_end = ldexpf(t_max * (1 + 0x1p-18f), exponent);
    for (int i = 0; i < 3; i++)
        if (!(fabsf(origin[i]) <= MESH_COORDINATE_LIMIT))
            return false;
    if (!bvh_ray_ok(origin, scaled, 0, t_end))
        return false;
    *ray = (struct RTCRay){.org_x = origin[0],
                           .org_y = origin[1],
                           .org_z = origin[2],
                           .tnear = 0,
                           .dir_x = scaled[0],
                           .dir_y = scaled[1],
                           .dir_z = scaled[2],
                           .tfar = t_end,
                           .mask = ~0u};
    embree_context_init(&s->context);
    s->tree = tree;
    s->origin = origin;
    s->dir = dir;
    s->t_max = t_max;
    s->best = (mesh_hit){.t = INFINITY, .triangle = UINT32_MAX};
    return true;
}

bool mesh_tree_trace(const mesh_tree *tree, const float origin[3], const float dir[3], float t_max,
                     mesh_hit *hit)
{
    search s;
    struct RTCRayHit rayhit = {.hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .primID = RTC_INVALID_GEOMETRY_ID}};
    if (!prepare(tree, origin, dir, t_max, &s, &rayhit.ray))
        return false;
    embree_intersect(tree->scene, &s.context, &rayhit);
    if (s.best.triangle == UINT32_MAX)
        return false;
    double ab[3], ac[3], normal[3];
    corner_differences(tree, s.best.triangle, ab, ac);
    dvec_cross(ab, ac, normal);
    dvec_normalize(normal);
    for (int i = 0; i < 3; i++)
        s.best.normal[i] = (float)normal[i];
    *hit = s.best;
    return true;
}

bool mesh_tree_blocked(const mesh_tree *tree, const float origin[3], const float dir[3], float t_max)
{
    search s;
    struct RTCRay ray;
    if (!prepare(tree, origin, dir, t_max, &s, &ray))
        return false;
    embree_occluded(tree->scene, &s.context, &ray);
    return s.best.triangle != UINT32_MAX;
}

void mesh_tree_free(mesh_tree *tree)
{
    if (tree == NULL)
        return;
    if (tree->scene != NULL)
        rtcReleaseScene(tree->scene);
    mem_free(tree);
}
