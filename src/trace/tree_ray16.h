/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_ray16.h -- one ray through the tree, sixteen Gaussians at a time: for incoherent rays, and for
   packets whose hits do not fit.

   Nodes come from a heap, nearest first. Gaussians of leaves whose ellipsoids the ray meets wait until there
   are sixteen and are evaluated together. After a number of hits (RAY_ROUND, then more) these are sorted,
   those nearer than the nearest node in the heap are blended, the others stay for the next round. The only
   limit is memory. Included by tree_kernel.inc.h. */
#ifndef GBT_TRACE_TREE_RAY16_H
#define GBT_TRACE_TREE_RAY16_H

#include "trace/tree_beam16.h"
#include "trace/gaussian16.h"
#include "trace/tree_heap.h"
#include "trace/tree_kernel.h"
#include "trace/ray_hits.h"

enum { RAY_ROUND = 80 };

typedef struct ray_state {
    float transmittance, rgb[3];
    float far, depth, weight, median, normal[3], top_weight;
    uint32_t blended, top_id;
    bool alive;
    float dir[3];
    uint32_t waiting[2 * TREE_WIDTH]; /* Gaussians that may be hit */
    int waiting_count;                /* at most TREE_WIDTH - 1 between two leaves */
    ray_hit *hits;                    /* in scratch; as many spare ones follow */
    size_t count, capacity;
} ray_state;

static ray_state start_ray(const packet_rays *rays, int lane, const tree_scratch *scratch)
{
    return (ray_state){.transmittance = 1,
                       .far = rays->far[lane],
                       .median = INFINITY,
                       .top_id = UINT32_MAX,
                       .alive = true,
                       .dir = {rays->dir[0][lane], rays->dir[1][lane], rays->dir[2][lane]},
                       .hits = scratch->hits,
                       .capacity = scratch->hit_bytes / sizeof(ray_hit) / 2};
}

static void finish_ray(const ray_state *r, const packet_rays *rays, int lane, packet_output *out)
{
    for (int k = 0; k < 3; k++) {
        out->rgb[k][lane] = fmaf(r->transmittance, rays->background[k][lane], r->rgb[k]);
        out->normal[k][lane] = r->normal[k];
    }
    out->transmittance[lane] = r->transmittance;
    out->weighted_depth[lane] = r->depth, out->weight[lane] = r->weight, out->median_depth[lane] = r->median,
    out->hit_count[lane] = (float)r->blended, out->strongest[lane] = r->top_id;
}

static bool reserve_hits(ray_state *r, size_t more, tree_scratch *scratch)
{
    if (r->count + more > r->capacity) {
        const size_t wanted = r->count + more + r->capacity;
        if (mem_reserve(&scratch->hits, &scratch->hit_bytes, r->count * sizeof *r->hits,
                        2 * wanted * sizeof *r->hits, 1, "hits of a ray", NULL) != GBT_OK)
            return false;
        r->capacity = wanted;
    }
    r->hits = scratch->hits;
    return true;
}

/* What a blended hit adds to the outputs beside colour. */
static void note_hit(ray_state *r, const float *record, uint32_t id, float weight, float next, float t)
{
    float normal[3];
    shortest_axis(record, normal);
    const float toward = dot3(normal, r->dir) < 0 ? weight : -weight; /* normals look at the camera */
    for (int k = 0; k < 3; k++)
        r->normal[k] = fmaf(toward, normal[k], r->normal[k]);
    r->depth = fmaf(weight, t, r->depth);
    r->weight += weight;
    if (next < 0.5f)
        r->median = smaller(r->median, t);
    r->blended++;
    if (weight > r->top_weight) {
        r->top_weight = weight;
        r->top_id = id;
    }
}

/* Blend all hits nearer than `horizon`; keep the rest. */
static bool blend_hits(ray_state *r, const kernel_scene *scene, float horizon, unsigned packet, int lane,
                       hit_tape *tape, kernel_counters *counters)
{
    sort_hits(r->hits, r->hits + r->capacity, r->count);
    size_t done = 0;
    for (; done < r->count && hit_depth(&r->hits[done]) < horizon; done++) {
        const ray_hit *h = &r->hits[done];
        const uint32_t id = (uint32_t)h->key;
        const float next = r->transmittance * (1 - h->alpha), weight = r->transmittance * h->alpha;
        if (next < scene->settings.transmittance_min) {
            r->alive = false;
            return true;
        }
        const float *color = scene->records + (size_t)id * RECORD_FLOATS + RECORD_COLOR;
        for (int c = 0; c < 3; c++)
            r->rgb[c] = fmaf(weight, color[c], r->rgb[c]);
        if (scene->extra)
            note_hit(r, color - RECORD_COLOR, id, weight, next, hit_depth(h));
        r->transmittance = next;
        counters->blended++;
        if (tape != NULL &&
            !tape_add(tape, (tape_entry){id, (uint16_t)lane, (uint16_t)(packet | TAPE_SINGLE)}))
            return false;
    }
    memmove(r->hits, r->hits + done, (r->count - done) * sizeof *r->hits);
    r->count -= done;
    return true;
}

/* What is found once per ray to test nodes and leaves. */
typedef struct ray_walk {
    float origin[3], inverse[3]; /* 1 / direction, finite */
    int enter[3], leave[3];      /* float offset of lower_* or upper_* in a tree_node */
    float across[2][3];          /* two axes at right angles to the ray */
    float square[3][6];          /* their products: uu vv uv */
    float open;                  /* added to variances, for errors of the coordinates */
    float t_near;
} ray_walk;

static ray_walk make_walk(const kernel_scene *scene, const float origin[3], const float dir[3])
{
    ray_walk w = {.t_near = scene->settings.t_near};
    int least = 0;
    for (int axis = 0; axis < 3; axis++) {
        const float size = fabsf(dir[axis]), d = size > 1e-20f ? dir[axis] : 1e-20f;
        w.origin[axis] = origin[axis];
        w.inverse[axis] = 1 / d;
        w.enter[axis] = 2 * axis * TREE_WIDTH + (d < 0 ? TREE_WIDTH : 0);
        w.leave[axis] = 2 * axis * TREE_WIDTH + (d < 0 ? 0 : TREE_WIDTH);
        least = size < fabsf(dir[least]) ? axis : least;
    }
    float *u = w.across[0], *v = w.across[1];
    for (int axis = 0; axis < 3; axis++)
        u[axis] = (axis == least ? 1.0f : 0.0f) - dir[least] * dir[axis];
    const float inverse = 1 / sqrtf(dot3(u, u));
    for (int axis = 0; axis < 3; axis++)
        u[axis] *= inverse;
    v[0] = dir[1] * u[2] - dir[2] * u[1];
    v[1] = dir[2] * u[0] - dir[0] * u[2];
    v[2] = dir[0] * u[1] - dir[1] * u[0];
    axis_products(u, u, w.square[0]);
    axis_products(v, v, w.square[1]);
    axis_products(u, v, w.square[2]);
    /* The sum of an ellipse and a disc of radius s lies within the ellipse of 1.001 times the covariance plus
       1001 s^2; s is 16 roundings of the largest coordinate. */
    const float slack = 0x1p-20f * scene->coordinate_max;
    w.open = 1001 * slack * slack;
    return w;
}

/* Which children the ray enters, and a lower bound of t_c inside each. */
static inline unsigned walk_children(const ray_walk *w, const tree_node *node, float entry[TREE_WIDTH])
{
    const float *base = (const float *)node;
    vfloat16 enter = vfloat16_set1(w->t_near), leave = vfloat16_set1(FLT_MAX);
    for (int axis = 0; axis < 3; axis++) {
        const vfloat16 o = vfloat16_set1(w->origin[axis]), inverse = vfloat16_set1(w->inverse[axis]);
        enter =
            vfloat16_max(enter, vfloat16_mul(vfloat16_sub(vfloat16_load(base + w->enter[axis]), o), inverse));
        leave =
            vfloat16_min(leave, vfloat16_mul(vfloat16_sub(vfloat16_load(base + w->leave[axis]), o), inverse));
    }
    vfloat16_store(entry, vfloat16_mul(enter, vfloat16_set1(0.999999f)));
    return vmask16_bits(vfloat16_le(vfloat16_mul(enter, vfloat16_set1(0.999998f)), leave));
}

/* Which ellipsoids the line of the ray meets, both projected along it; (x, y): the centre relative to the
   line. */
static inline unsigned walk_leaf(const ray_walk *w, const tree_leaf *leaf)
{
    vfloat16 offset[3], s[6];
    for (int axis = 0; axis < 3; axis++)
        offset[axis] = vfloat16_sub(vfloat16_load(leaf->mean[axis]), vfloat16_set1(w->origin[axis]));
    for (int k = 0; k < 6; k++)
        s[k] = vfloat16_load(leaf->covariance[k]);
    /* 1.001: see make_walk(); 2^-18: the rounding of covariance, as in turn_ellipsoids() */
    const vfloat16 grow = vfloat16_set1(1.001f),
                   slack = vfloat16_fma(vfloat16_set1(0x1p-18f), vfloat16_add(s[0], vfloat16_add(s[1], s[2])),
                                        vfloat16_set1(w->open));
    const vfloat16 x = dot_lanes(w->across[0], offset), y = dot_lanes(w->across[1], offset),
                   xx = vfloat16_fma(grow, covariance_product(s, w->square[0]), slack),
                   yy = vfloat16_fma(grow, covariance_product(s, w->square[1]), slack),
                   xy = vfloat16_mul(grow, covariance_product(s, w->square[2]));
    const vfloat16 cross = vfloat16_mul(vfloat16_mul(x, y), xy),
                   form = vfloat16_fma(
                       vfloat16_mul(x, x), yy,
                       vfloat16_fma(vfloat16_mul(y, y), xx, vfloat16_mul(vfloat16_set1(-2), cross))),
                   most = vfloat16_fnma(xy, xy, vfloat16_mul(xx, yy));
    return vmask16_bits(vfloat16_lt(most, form)) ^ 0xFFFF; /* NaN counts as a hit */
}

/* Evaluates the last `count` of the waiting Gaussians, at most sixteen. */
static bool hit_waiting(ray_state *r, const kernel_scene *scene, const ray_lanes *ray, int count,
                        tree_scratch *scratch, kernel_counters *counters)
{
    vfloat16 color[3];
    uint32_t id[TREE_WIDTH];
    for (int i = 0; i < TREE_WIDTH; i++)
        id[i] = r->waiting[r->waiting_count - 1 - (i < count ? i : 0)];
    const gaussian_lanes g = load_gaussians(scene, id, color);
    const response at = respond(&g, ray, vfloat16_set1(scene->settings.t_near));
    const vfloat16 raw = response_alpha(&g, at.d2);
    const vmask16 hit = vmask16_and(vfloat16_le(vfloat16_set1(scene->settings.alpha_min), raw),
                                    vfloat16_lt(at.t, vfloat16_set1(r->far)));
    _Alignas(64) float t[TREE_WIDTH], alpha[TREE_WIDTH];
    vfloat16_store(t, at.t),
        vfloat16_store(alpha, vfloat16_min(raw, vfloat16_set1(scene->settings.alpha_max)));
    if (!reserve_hits(r, TREE_WIDTH, scratch))
        return false;
    for (unsigned bits = vmask16_bits(hit) & (0xFFFFu >> (TREE_WIDTH - count)); bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        r->hits[r->count++] = make_hit(t[i], alpha[i], id[i]);
        counters->hits++;
    }
    r->waiting_count -= count;
    counters->tests += (uint64_t)count;
    return true;
}

/* Appends the Gaussians of a leaf whose ellipsoids the ray meets to the waiting ones. They are few, so those
   of several leaves are evaluated together. */
static bool visit_leaf(ray_state *r, const kernel_scene *scene, const ray_walk *walk, const ray_lanes *ray,
                       const tree_leaf *leaf, tree_scratch *scratch, kernel_counters *counters)
{
    counters->nodes++;
    const vmask16 met = vmask16_from_bits(walk_leaf(walk, leaf) & (0xFFFFu >> (TREE_WIDTH - leaf->count)));
    r->waiting_count += (int)vmask16_pack(met, leaf->id, r->waiting + r->waiting_count);
    return r->waiting_count < TREE_WIDTH || hit_waiting(r, scene, ray, TREE_WIDTH, scratch, counters);
}

/* Visits the leaves of a node that the ray enters; child nodes go to the heap. */
static bool visit_node(ray_state *r, const kernel_scene *scene, const ray_walk *walk, const ray_lanes *ray,
                       const tree_node *node, int *heap_count, tree_scratch *scratch,
                       kernel_counters *counters)
{
    _Alignas(64) float entry[TREE_WIDTH];
    counters->nodes++;
    if (mem_reserve((void **)&scratch->heap, &scratch->heap_capacity, (size_t)*heap_count,
                    (size_t)*heap_count + TREE_WIDTH, sizeof *scratch->heap, "nodes of a ray",
                    NULL) != GBT_OK)
        return false;
    for (unsigned bits = walk_children(walk, node, entry); bits != 0; bits &= bits - 1) {
        const uint64_t child = node->child[__builtin_ctz(bits)];
        const tree_leaf *leaf = tree_child_leaf(child);
        if (leaf == NULL)
            heap_push(scratch->heap, heap_count, entry[__builtin_ctz(bits)], child);
        else if (!visit_leaf(r, scene, walk, ray, leaf, scratch, counters))
            return false;
    }
    return true;
}

static bool gather_ray(ray_state *r, const kernel_scene *scene, const ray_walk *walk, const ray_lanes *ray,
                       unsigned packet, int lane, hit_tape *tape, tree_scratch *scratch,
                       kernel_counters *counters)
{
    int heap_count = 0;
    size_t round = RAY_ROUND;
    for (const tree_node *node = scene->root;;) {
        if (!visit_node(r, scene, walk, ray, node, &heap_count, scratch, counters))
            return false;
        if (r->count >= round || heap_count == 0) {
            if (r->waiting_count > 0 && !hit_waiting(r, scene, ray, r->waiting_count, scratch, counters))
                return false;
            if (r->count > 0 && !blend_hits(r, scene, heap_count > 0 ? scratch->heap[0].t : INFINITY, packet,
                                            lane, tape, counters))
                return false;
            if (!r->alive || heap_count == 0)
                return true;
            round = 2 * r->count + RAY_ROUND; /* hits that stay are sorted again; doubling keeps that rare */
        }
        node = (const tree_node *)(uintptr_t)heap_pop(scratch->heap, &heap_count);
    }
}

static bool trace_ray(const kernel_scene *scene, const packet_rays *rays, unsigned packet, int lane,
                      packet_output *out, hit_tape *tape, tree_scratch *scratch, kernel_counters *counters)
{
    packet_rays alone;
    ray_state r = start_ray(rays, lane, scratch);
    float origin[3];
    ray_lanes ray;
    for (int axis = 0; axis < 3; axis++) {
        origin[axis] = rays->origin[axis][lane];
        for (int i = 0; i < PACKET_LANES; i++) {
            alone.origin[axis][i] = origin[axis];
            alone.dir[axis][i] = r.dir[axis];
        }
    }
    load_rays(&alone, &ray);
    const ray_walk walk = make_walk(scene, origin, r.dir);
    if (scene->root != NULL && !gather_ray(&r, scene, &walk, &ray, packet, lane, tape, scratch, counters))
        return false;
    finish_ray(&r, rays, lane, out);
    return true;
}

#endif
