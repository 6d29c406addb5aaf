/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/gaussian_scene.c -- boxes of Gaussians as Embree's user geometry, and packets of sixteen rays that
   collect what they cross.

   gaussians --> proxy_boxes --> rtcCommitScene
   rays --> rtcIntersect16 --> callback per box: slab test --> visit() */
#include "bvh/gaussian_scene.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "base/cpu.h"
#include "base/fail.h"
#include "base/memory.h"
#include "bvh/device.h"
#include "bvh/embree_api.h"
#include "bvh/proxy.h"

typedef struct content {
    RTCScene scene;
    RTCGeometry geometry;
    proxy_boxes boxes;
} content;

/* Travels with the rays. */
typedef struct packet packet;
struct packet {
    embree_context context; /* first: Embree hands this to the callback */
    const struct RTCBuildPrimitive *box;
    const struct RTCRayHit16 *rays;
    float inverse[3][SCENE_LANES]; /* 1 / dir, as Embree computes it */
    unsigned (*crossing_lanes)(const packet *p, const struct RTCBuildPrimitive *box);
    gaussian_visit_fn *visit;
    void *user;
};

static void box_bounds(const struct RTCBoundsFunctionArguments *args)
{
    content *c = args->geometryUserPtr;
    embree_receive(c);
    const struct RTCBuildPrimitive *box = &c->boxes.box[args->primID];
    *args->bounds_o = (struct RTCBounds){.lower_x = box->lower_x,
                                         .lower_y = box->lower_y,
                                         .lower_z = box->lower_z,
                                         .upper_x = box->upper_x,
                                         .upper_y = box->upper_y,
                                         .upper_z = box->upper_z};
    embree_publish(c); /* orders these reads before the next build, which writes the boxes */
}

/* Cuts the interval of t of each ray to where it is between two planes. */
static inline __attribute__((always_inline)) void cut_interval(float lower, float upper, const float *origin,
                                                               const float *inverse, float *enter,
                                                               float *leave)
{
    for (int i = 0; i < SCENE_LANES; i++) {
        const float a = (lower - origin[i]) * inverse[i], b = (upper - origin[i]) * inverse[i];
        const float first = a < b ? a : b, last = a < b ? b : a;
        enter[i] = first > enter[i] ? first : enter[i];
        leave[i] = last < leave[i] ? last : leave[i];
    }
}

/* Embree's coherent traversal follows the hull of the packet and reports every box that the hull meets as
   crossed by all rays, and it reports the only box of a scene without any test. So which rays cross a box is
   found here, with the same bits for every instruction set. */
#define CROSSING_VARIANT(isa, attribute)                                                                     \
    attribute static unsigned crossing_lanes_##isa(const packet *p, const struct RTCBuildPrimitive *box)     \
    {                                                                                                        \
        const struct RTCRay16 *ray = &p->rays->ray;                                                          \
        float enter[SCENE_LANES], leave[SCENE_LANES];                                                        \
        memcpy(enter, ray->tnear, sizeof enter);                                                             \
        memcpy(leave, ray->tfar, sizeof leave);                                                              \
        cut_interval(box->lower_x, box->upper_x, ray->org_x, p->inverse[0], enter, leave);                   \
        cut_interval(box->lower_y, box->upper_y, ray->org_y, p->inverse[1], enter, leave);                   \
        cut_interval(box->lower_z, box->upper_z, ray->org_z, p->inverse[2], enter, leave);                   \
        unsigned lanes = 0;                                                                                  \
        for (unsigned i = 0; i < SCENE_LANES; i++) /* three roundings at each end */                         \
            lanes |= (unsigned)(enter[i] <= leave[i] * (1 + 0x1p-21f)) << i;                                 \
        return lanes;                                                                                        \
    }
CROSSING_VARIANT(plain, )
#if defined(__x86_64__)
CROSSING_VARIANT(avx2, __attribute__((target("avx2"))))
CROSSING_VARIANT(avx512, __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512"))))
#endif

/* Embree's intersection callback. It reports no hit: to Embree the ray misses every box, and it goes on to
   the next. */
static void reach_box(const struct RTCIntersectFunctionNArguments *args)
{
    const packet *p = (const packet *)args->context;
    const struct RTCBuildPrimitive *box = &p->box[args->primID];
    unsigned lanes = 0;
    if (args->N == SCENE_LANES) {
        for (unsigned i = 0; i < SCENE_LANES; i++)
            lanes |= (unsigned)(args->valid[i] != 0) << i;
    } else { /* narrower instruction sets split a packet; the id of a ray is its lane */
        for (unsigned i = 0; i < args->N; i++)
            lanes |= (unsigned)(args->valid[i] != 0) << embree_ray_id(args->rayhit, args->N, i);
    }
    lanes &= p->crossing_lanes(p, box);
    if (lanes != 0)
        p->visit(box->primID, lanes, p->user);
}

static void release(content *c)
{
    if (c->geometry != NULL)
        rtcReleaseGeometry(c->geometry);
    if (c->scene != NULL)
        rtcReleaseScene(c->scene);
    c->geometry = NULL;
    c->scene = NULL;
}

static gbt_status commit(content *c, RTCDevice device, gbt_error *err)
{
    if (c->scene == NULL) {
        c->scene = rtcNewScene(device);
        c->geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        GBT_TRY(bvh_check("bvh", err));
        rtcSetGeometryUserData(c->geometry, c);
        rtcSetGeometryBoundsFunction(c->geometry, box_bounds, NULL);
        rtcSetGeometryIntersectFunction(c->geometry, reach_box);
        rtcSetGeometryBuildQuality(c->geometry, RTC_BUILD_QUALITY_MEDIUM);
        rtcSetSceneBuildQuality(c->scene, RTC_BUILD_QUALITY_MEDIUM);
        rtcAttachGeometry(c->scene, c->geometry);
    }
    rtcSetGeometryUserPrimitiveCount(c->geometry, (unsigned)c->boxes.count);
    rtcCommitGeometry(c->geometry);
    embree_publish(c);
    rtcCommitScene(c->scene);
    embree_receive(c);
    return bvh_check("bvh", err);
}

gbt_status gaussian_scene_build(const gaussians *g, float alpha_min, float reach, gaussian_scene *scene,
                                gbt_error *err)
{
    scene->box_count = scene->rejected_count = 0;
    scene->coordinate_max = 0;
    if (g->count == 0)
        return GBT_OK;
    RTCDevice device = bvh_device(err);
    if (device == NULL)
        return bvh_check("bvh", err);
    if (scene->internal == NULL) {
        scene->internal = mem_calloc(1, sizeof(content), "bvh scene", err);
        if (scene->internal == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    content *c = scene->internal;
    GBT_TRY(proxy_boxes_make(g, alpha_min, reach, &c->boxes, err));
    if (c->boxes.count > 0) {
        const gbt_status status = commit(c, device, err);
        if (status != GBT_OK) {
            release(c); /* half a tree is of no use */
            return status;
        }
    }
    scene->box_count = c->boxes.count;
    scene->rejected_count = c->boxes.rejected_count;
    scene->coordinate_max = c->boxes.coordinate_max;
    return GBT_OK;
}

/* Writes one ray into its lane, in a form that Embree accepts. False for a ray that it cannot trace: that
   crosses nothing. */
static bool set_lane(packet *p, struct RTCRay16 *ray, unsigned i, const float origin[3], const float dir[3],
                     float t_near, float t_far)
{
    const int exponent = bvh_ray_exponent(dir);
    float scaled[3] = {dir[0], dir[1], dir[2]};
    if (exponent != 0) {
        for (int axis = 0; axis < 3; axis++)
            scaled[axis] = ldexpf(dir[axis], -exponent);
        t_near = ldexpf(t_near, exponent);
        t_far = ldexpf(t_far, exponent);
    }
    if (!bvh_ray_ok(origin, scaled, t_near, t_far))
        return false;
    ray->org_x[i] = origin[0];
    ray->org_y[i] = origin[1];
    ray->org_z[i] = origin[2];
    ray->dir_x[i] = scaled[0];
    ray->dir_y[i] = scaled[1];
    ray->dir_z[i] = scaled[2];
    ray->tnear[i] = t_near;
    ray->tfar[i] = t_far;
    for (int axis = 0; axis < 3; axis++) /* Embree replaces smaller components by these */
        p->inverse[axis][i] =
            1 / (fabsf(scaled[axis]) < 1e-18f ? copysignf(1e-18f, scaled[axis]) : scaled[axis]);
    return true;
}

void gaussian_scene_visit(const gaussian_scene *scene, const float origin[3][SCENE_LANES],
                          const float dir[3][SCENE_LANES], float t_near, float t_far, unsigned active,
                          gaussian_visit_fn *visit, void *user)
{
    if (scene->box_count == 0)
        return;
    const content *c = scene->internal;
    struct RTCRayHit16 rays;
    _Alignas(64) int valid[SCENE_LANES] = {0};
    packet p = {.box = c->boxes.box,
                .rays = &rays,
                .crossing_lanes = CPU_CLONE(crossing_lanes, cpu_best_isa()),
                .visit = visit,
                .user = user};
    bool some = false;
    memset(&rays, 0, sizeof rays); /* lanes that are not traced are read by the box test too */
    for (unsigned i = 0; i < SCENE_LANES; i++) {
        const float x[3] = {origin[0][i], origin[1][i], origin[2][i]},
                    w[3] = {dir[0][i], dir[1][i], dir[2][i]};
        rays.ray.mask[i] = ~0u;
        rays.ray.id[i] = i;
        rays.hit.geomID[i] = rays.hit.primID[i] = RTC_INVALID_GEOMETRY_ID;
        if ((active >> i & 1) == 0 || !set_lane(&p, &rays.ray, i, x, w, t_near, t_far))
            continue;
        valid[i] = -1;
        some = true;
    }
    if (!some)
        return;
    embree_context_init(&p.context);
    embree_intersect16(c->scene, &p.context, valid, &rays);
}

void gaussian_scene_free(gaussian_scene *scene)
{
    content *c = scene->internal;
    if (c != NULL) {
        release(c);
        proxy_boxes_free(&c->boxes);
        mem_free(c);
    }
    memset(scene, 0, sizeof *scene);
}
