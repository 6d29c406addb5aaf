/* trace/embree16.h -- packets under Embree's own traversal: every box that is crossed, evaluated, then sorted ray by ray. The baseline
   that the tile kernel is measured against. Included by tile_kernel.inc.h. */
#ifndef GBT_TRACE_EMBREE16_H
#define GBT_TRACE_EMBREE16_H

#include "bvh/gaussian_scene.h"
#include "trace/ray16.h"

_Static_assert((int)SCENE_LANES == (int)PACKET_LANES, "a packet is what Embree traces at once");

typedef struct embree_visit {
    const kernel_scene *scene;
    const ray_lanes *ray;
    f16 far;
    kernel_scratch *scratch;
    kernel_counters *counters;
    size_t count;
    bool failed;
} embree_visit;

static void visit_gaussian(uint32_t id, unsigned lanes, void *user)
{
    embree_visit *v = user;
    const gaussian_lanes g = spread_gaussian(v->scene->records + (size_t)id * RECORD_FLOATS);
    const response r = respond(&g, v->ray, f16_set1(v->scene->settings.t_near));
    const f16 raw = response_alpha(&g, r.d2);
    const m16 hit = m16_and(f16_le(alpha_threshold(v->scene, g.opacity), raw), f16_lt(r.t, v->far));
    _Alignas(64) float t[PACKET_LANES], alpha[PACKET_LANES];
    f16_store(t, r.t), f16_store(alpha, f16_min(raw, f16_set1(v->scene->settings.alpha_max)));
    v->counters->tests += (uint64_t)__builtin_popcount(lanes);
    kernel_scratch *s = v->scratch;
    if (v->failed || mem_reserve((void **)&s->lane_hits, &s->lane_hit_capacity, v->count, v->count + PACKET_LANES, sizeof *s->lane_hits, "hits of a packet",
                                 NULL) != GBT_OK) {
        v->failed = true;
        return;
    }
    for (unsigned bits = m16_bits(hit) & lanes; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        s->lane_hits[v->count++] = (struct lane_hit){make_hit(t[lane], alpha[lane], id), (uint32_t)lane};
        v->counters->hits++;
    }
}

static bool embree_packet(const kernel_scene *scene, const packet_rays *rays, unsigned packet, packet_output *out, hit_tape *tape, kernel_scratch *scratch,
                          kernel_counters *counters)
{
    ray_lanes ray;
    load_rays(rays, &ray);
    embree_visit v = {.scene = scene, .ray = &ray, .far = f16_load(rays->far), .scratch = scratch, .counters = counters};
    if (scene->embree != NULL)
        gaussian_scene_visit(scene->embree, rays->origin, rays->dir, scene->settings.t_near, INFINITY, rays->active, visit_gaussian, &v);
    if (v.failed)
        return false;
    for (unsigned bits = rays->active; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        ray_state r = start_ray(rays, lane, scratch);
        if (!reserve_hits(&r, v.count, scratch))
            return false;
        for (size_t i = 0; i < v.count; i++)
            if (scratch->lane_hits[i].lane == (uint32_t)lane)
                r.hits[r.count++] = scratch->lane_hits[i].hit;
        if (!blend_hits(&r, scene, INFINITY, packet, lane, tape, counters))
            return false;
        finish_ray(&r, scene, lane, out);
    }
    return true;
}

#endif
