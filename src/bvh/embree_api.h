/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/embree_api.h -- the only place that includes Embree, and the only one that knows whether it is Embree 3
   or 4.

   What differs: the header's path, the context that travels with a ray, and how one ray is traced. Everything
   else that this folder uses (devices, scenes, point queries, rtcBuildBVH) has the same name and meaning in
   both and is called directly. */
#ifndef GBT_BVH_EMBREE_API_H
#define GBT_BVH_EMBREE_API_H

#include <stddef.h>

#if GBT_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

/** Travels with a ray into the callbacks as `args->context`. Put it first in a struct to hand data of your
    own to them. */
#if GBT_EMBREE_MAJOR >= 4
typedef struct RTCRayQueryContext embree_context;
#else
typedef struct RTCIntersectContext embree_context;
#endif

static inline void embree_context_init(embree_context *context)
{
#if GBT_EMBREE_MAJOR >= 4
    rtcInitRayQueryContext(context);
#else
    rtcInitIntersectContext(context);
#endif
}

/** Nearest hit of one ray. The caller has checked the ray with bvh_ray_ok(): Debian 12's Embree aborts on a
    bad one. */
static inline void embree_intersect(RTCScene scene, embree_context *context, struct RTCRayHit *rayhit)
{
#if GBT_EMBREE_MAJOR >= 4
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = context;
    rtcIntersect1(scene, rayhit, &arguments);
#else
    rtcIntersect1(scene, context, rayhit);
#endif
}

/** Any hit of one ray: ray->tfar is -infinity afterwards when there is one. The ray is checked as for
    embree_intersect(). */
static inline void embree_occluded(RTCScene scene, embree_context *context, struct RTCRay *ray)
{
#if GBT_EMBREE_MAJOR >= 4
    struct RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = context;
    rtcOccluded1(scene, ray, &arguments);
#else
    rtcOccluded1(scene, context, ray);
#endif
}

/** Nearest hits of sixteen rays that start and run close together (hint "coherent"); `valid` is -1 for the
    rays to trace, else 0, 64-byte aligned. Each such ray is checked as for embree_intersect(). */
static inline void embree_intersect16(RTCScene scene, embree_context *context, const int valid[16],
                                      struct RTCRayHit16 *rayhits)
{
#if GBT_EMBREE_MAJOR >= 4
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    arguments.context = context;
    rtcIntersect16(valid, scene, rayhits, &arguments);
#else
    context->flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene, context, rayhits);
#endif
}

/** `id` of ray i of the N in a callback. Embree's own accessor is C++; its layout, one array of N per field,
    is the same in both. */
static inline unsigned embree_ray_id(const struct RTCRayHitN *rayhits, unsigned N, unsigned i)
{
    const size_t fields_before = offsetof(struct RTCRay, id) / sizeof(float);
    return ((const unsigned *)rayhits)[fields_before * N + i];
}

/** For ThreadSanitizer, around work that Embree spreads over threads: publish before it what the callbacks
    will read, and receive it at the start of a callback. The sanitizer cannot see how Embree's own library
    hands work to threads, and would report a race. In other builds both do nothing. */
#if defined(__SANITIZE_THREAD__)
void __tsan_acquire(void *address);
void __tsan_release(void *address);
static inline void embree_publish(void *data) { __tsan_release(data); }
static inline void embree_receive(void *data) { __tsan_acquire(data); }
#else
static inline void embree_publish(void *data) { (void)data; }
static inline void embree_receive(void *data) { (void)data; }
#endif

#endif
