/* SPDX-License-Identifier: Apache-2.0 */
/* trace/embree16.h -- the baseline kernel: packets of 16 rays under Embree's own traversal.

   Embree reports every Gaussian whose box a ray of the packet crosses, in no order. Each one is evaluated on
   all 16 rays. The hits are grouped by ray with a counting sort, sorted by depth ray by ray, and blended. The
   other kernels are measured against this one. Included by tree_kernel.inc.h. */
#ifndef GBT_TRACE_EMBREE16_H
#define GBT_TRACE_EMBREE16_H

#include "bvh/gaussian_scene.h"
#include "trace/tree_ray16.h"

_Static_assert((int)SCENE_LANES == (int)PACKET_LANES, "a packet is what Embree traces at once");

typedef struct embree_visit {
    const kernel_scene *scene;
    const ray_lanes *ray;
    vfloat16 far;
    tree_scratch *scratch;
    kernel_counters *counters;
    size_t count;
    bool failed;
} embree_visit;

static void visit_gaussian(uint32_t id, unsigned lanes, void *user)
{
    embree_visit *v = user;
    const gaussian_lanes g = broadcast_gaussian(v->scene->records + (size_t)id * RECORD_FLOATS);
    const response r = respond(&g, v->ray, vfloat16_set1(v->scene->settings.t_near));
    const vfloat16 raw = response_alpha(&g, r.d2);
    const vmask16 hit =
        vmask16_and(vfloat16_le(vfloat16_set1(v->scene->settings.alpha_min), raw), vfloat16_lt(r.t, v->far));
    _Alignas(64) float t[PACKET_LANES], alpha[PACKET_LANES];
    vfloat16_store(t, r.t),
        vfloat16_store(alpha, vfloat16_min(raw, vfloat16_set1(v->scene->settings.alpha_max)));
    v->counters->tests += (uint64_t)__builtin_popcount(lanes);
    tree_scratch *s = v->scratch;
    if (v->failed ||
        mem_reserve((void **)&s->lane_hits, &s->lane_hit_capacity, v->count, v->count + PACKET_LANES,
                    sizeof *s->lane_hits, "hits of a packet", NULL) != GBT_OK) {
        v->failed = true;
        return;
    }
    for (unsigned bits = vmask16_bits(hit) & lanes; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        s->lane_hits[v->count++] = (struct lane_hit){make_hit(t[lane], alpha[lane], id), (uint32_t)lane};
        v->counters->hits++;
    }
}

/* Counting sort of the hits by lane; end[lane], 0 on entry, is where those of a lane end. The result takes
   the place of scratch->rows. NULL when memory ran out. */
static ray_hit *by_lane(tree_scratch *s, size_t count, size_t end[PACKET_LANES])
{
    if (mem_reserve((void **)&s->rows, &s->row_capacity, 0, count * (sizeof(ray_hit) / sizeof(float)),
                    sizeof(float), "hits of a packet", NULL) != GBT_OK)
        return NULL;
    ray_hit *out = (ray_hit *)(void *)s->rows;
    for (size_t i = 0; i < count; i++)
        end[s->lane_hits[i].lane]++;
    size_t at = 0;
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        const size_t n = end[lane];
        end[lane] = at;
        at += n;
    }
    for (size_t i = 0; i < count; i++)
        out[end[s->lane_hits[i].lane]++] = s->lane_hits[i].hit;
    return out;
}

static bool embree_packet(const kernel_scene *scene, const packet_rays *rays, unsigned packet,
                          packet_output *out, hit_tape *tape, tree_scratch *scratch,
                          kernel_counters *counters)
{
    ray_lanes ray;
    load_rays(rays, &ray);
    embree_visit v = {.scene = scene,
                      .ray = &ray,
                      .far = vfloat16_load(rays->far),
                      .scratch = scratch,
                      .counters = counters};
    if (scene->embree != NULL)
        gaussian_scene_visit(scene->embree, rays->origin, rays->dir, scene->settings.t_near, INFINITY,
                             rays->active, visit_gaussian, &v);
    if (v.failed)
        return false;
    size_t end[PACKET_LANES] = {0};
    ray_hit *sorted = NULL;
    if (v.count > 0 && (sorted = by_lane(scratch, v.count, end)) == NULL)
        return false;
    for (unsigned bits = rays->active; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        const size_t begin = lane == 0 ? 0 : end[lane - 1], count = end[lane] - begin;
        ray_state r = start_ray(rays, lane, scratch);
        if (!reserve_hits(&r, count, scratch))
            return false;
        if (count > 0) {
            memcpy(r.hits, sorted + begin, count * sizeof *r.hits);
            r.count = count;
            if (!blend_hits(&r, scene, INFINITY, packet, lane, tape, counters))
                return false;
        }
        finish_ray(&r, rays, lane, out);
    }
    return true;
}

#endif
