/* trace/packet_kernel.inc.h -- sixteen rays through the tree: gather, sort, composite; and the adjoint. Compiled once per instruction set.

   Forward, for a packet of 4 x 4 neighbouring rays:

     heap of nodes by a lower bound of t --> pop the nearest --> test its 16 children against the packet's frustum
        ^                                                          |                         |
        +---- inner nodes, with their bound -----------------------+      Gaussians: evaluate for 16 rays, append a row
                                                                                             |
     enough rows? sort each lane by (t_c, id); composite what lies before the heap's nearest bound: nothing nearer can still come

   A row is one Gaussian's t_c and alpha on the 16 rays. Sorting moves 32-bit keys only (24 bits of depth in the range of the rows, 8 bits
   of row number); depths that agree in 24 bits are put in exact (t_c, id) order afterwards. A packet whose rows or nodes do not fit goes
   through the spill path: lane by lane, all hits collected and sorted, no limit but memory.

   The adjoint evaluates the blended rows again, walks the same order front to back for T and back to front for the colour behind
   (no division, no cancellation), and adds every row, summed over its lanes, to the Gaussian's record (docs/tracing.md has the formulas).

   Wanted before inclusion: KERNEL_NAME, the name of the exported packet_kernel. */

#include <float.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/kernel.h"
#include "trace/simd16.h"

enum {
    MAX_ROWS = 255,     /* row numbers are 8 bits, and 255 means "none" on the tape */
    ROW_TARGET = 40,    /* rows gathered before a sort; 24..64 are within 3 % on the scenes of the bench */
    HEAP_CAPACITY = 1024,
    STACK_CAPACITY = 48 * TREE_WIDTH,
    NO_ROW = 255
};
#define KEY_NONE 0xFFFFFFFFu

/* ---- one Gaussian on sixteen rays ---------------------------------------------------------------------------------------------- */

typedef struct ray_lanes {
    f16 origin[3], dir[3];
} ray_lanes;

typedef struct response {
    f16 t;    /* t_c */
    f16 v[3]; /* canonical point at t_c */
    f16 d2;
} response;

/* The ray is first moved to the point nearest the mean, so that the canonical product subtracts nothing large (float32 keeps its digits
   at any distance / scale ratio that float32 coordinates allow). */
static inline response respond(const float *record, const ray_lanes *ray, f16 t_near)
{
    const f16 ex = f16_sub(ray->origin[0], f16_set1(record[RECORD_MEAN]));
    const f16 ey = f16_sub(ray->origin[1], f16_set1(record[RECORD_MEAN + 1]));
    const f16 ez = f16_sub(ray->origin[2], f16_set1(record[RECORD_MEAN + 2]));
    const f16 along = f16_fma(ez, ray->dir[2], f16_fma(ey, ray->dir[1], f16_mul(ex, ray->dir[0])));
    const f16 px = f16_fnma(along, ray->dir[0], ex);
    const f16 py = f16_fnma(along, ray->dir[1], ey);
    const f16 pz = f16_fnma(along, ray->dir[2], ez);
    f16 o[3], w[3];
    for (int i = 0; i < 3; i++) {
        const f16 m0 = f16_set1(record[RECORD_MATRIX + 3 * i]);
        const f16 m1 = f16_set1(record[RECORD_MATRIX + 3 * i + 1]);
        const f16 m2 = f16_set1(record[RECORD_MATRIX + 3 * i + 2]);
        o[i] = f16_fma(m2, pz, f16_fma(m1, py, f16_mul(m0, px)));
        w[i] = f16_fma(m2, ray->dir[2], f16_fma(m1, ray->dir[1], f16_mul(m0, ray->dir[0])));
    }
    const f16 ww = f16_fma(w[2], w[2], f16_fma(w[1], w[1], f16_mul(w[0], w[0])));
    const f16 ow = f16_fma(o[2], w[2], f16_fma(o[1], w[1], f16_mul(o[0], w[0])));
    f16 step = f16_sub(f16_set1(0), f16_div(ow, ww));
    response r;
    r.t = f16_sub(step, along);
    const m16 clipped = f16_lt(r.t, t_near);
    r.t = f16_select(clipped, t_near, r.t);
    step = f16_select(clipped, f16_add(t_near, along), step);
    for (int i = 0; i < 3; i++)
        r.v[i] = f16_fma(step, w[i], o[i]);
    r.d2 = f16_fma(r.v[2], r.v[2], f16_fma(r.v[1], r.v[1], f16_mul(r.v[0], r.v[0])));
    return r;
}

/* The canonical point at an inner t* once more, for the adjoint: v = w' x (x' x w') / |w'|^2 with x' x w' = cof(M) (p x w), M = S^-1 R^T.
   On a flat Gaussian the v of respond() is a small difference of large numbers along the thin axis. d2 does not feel that, but the
   gradients of the mean and of the rotation, which are divided by the thin axis, would be noise from a ratio of 1e4 on. */
static inline void refine_point(const float *record, const ray_lanes *ray, f16 t_near, response *r)
{
    const float *m = record + RECORD_MATRIX;
    const f16 ex = f16_sub(ray->origin[0], f16_set1(record[RECORD_MEAN]));
    const f16 ey = f16_sub(ray->origin[1], f16_set1(record[RECORD_MEAN + 1]));
    const f16 ez = f16_sub(ray->origin[2], f16_set1(record[RECORD_MEAN + 2]));
    const f16 *d = ray->dir;
    const f16 along = f16_fma(ez, d[2], f16_fma(ey, d[1], f16_mul(ex, d[0])));
    const f16 px = f16_fnma(along, d[0], ex), py = f16_fnma(along, d[1], ey), pz = f16_fnma(along, d[2], ez);
    const f16 q[3] = {f16_fnma(pz, d[1], f16_mul(py, d[2])), f16_fnma(px, d[2], f16_mul(pz, d[0])), f16_fnma(py, d[0], f16_mul(px, d[1]))};
    f16 c[3], w[3];
    for (int i = 0; i < 3; i++) {
        const float *a = m + 3 * ((i + 1) % 3), *b = m + 3 * ((i + 2) % 3); /* row i of the cofactors is the product of the other two rows */
        c[i] = f16_mul(f16_set1(a[1] * b[2] - a[2] * b[1]), q[0]);
        c[i] = f16_fma(f16_set1(a[2] * b[0] - a[0] * b[2]), q[1], c[i]);
        c[i] = f16_fma(f16_set1(a[0] * b[1] - a[1] * b[0]), q[2], c[i]);
        w[i] = f16_fma(f16_set1(m[3 * i + 2]), d[2], f16_fma(f16_set1(m[3 * i + 1]), d[1], f16_mul(f16_set1(m[3 * i]), d[0])));
    }
    const f16 ww = f16_fma(w[2], w[2], f16_fma(w[1], w[1], f16_mul(w[0], w[0])));
    const m16 clipped = f16_le(r->t, t_near);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const f16 v = f16_div(f16_fnma(w[k], c[j], f16_mul(w[j], c[k])), ww);
        r->v[i] = f16_select(clipped, r->v[i], v);
    }
}

/* opacity * exp(-d2 / 2); d2 is cut at 150, where the response is 0 for every alpha_min that can be set. */
static inline f16 response_alpha(const float *record, f16 d2)
{
    return f16_mul(f16_set1(record[RECORD_OPACITY]), f16_exp(f16_mul(f16_set1(-0.5f), f16_min(d2, f16_set1(150.0f)))));
}

/* ---- the packet's frustum against the children of a node ----------------------------------------------------------------------- */

/* Half-space n.x <= limit; `pick` says for each axis which face of a box has the smallest n.x. */
typedef struct half_space {
    float n[3], limit;
    int pick[3]; /* float offset of lower_* or upper_* in a tree_node */
} half_space;

typedef struct frustum {
    half_space side[5]; /* left, right, top, bottom, behind */
    half_space depth;   /* n = central direction: smallest n.x of a box gives its entry bound */
    float depth_start, depth_scale; /* t >= (n.x - start) * scale */
} frustum;

static half_space make_half_space(const float n[3], float limit)
{
    half_space h = {.limit = limit};
    for (int axis = 0; axis < 3; axis++) {
        h.n[axis] = n[axis];
        h.pick[axis] = 2 * axis * TREE_WIDTH + (n[axis] < 0 ? TREE_WIDTH : 0);
    }
    return h;
}

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* False when the rays fan out so far that a frustum makes no sense; the packet is then traced lane by lane. */
static bool make_frustum(const packet_rays *rays, const kernel_scene *scene, frustum *out)
{
    float w[3] = {0, 0, 0};
    for (int lane = 0; lane < PACKET_LANES; lane++)
        for (int axis = 0; axis < 3; axis++)
            w[axis] += rays->dir[axis][lane];
    const float length = sqrtf(dot3(w, w));
    if (!(length > 8)) /* 16 for parallel rays */
        return false;
    for (int axis = 0; axis < 3; axis++)
        w[axis] /= length;
    /* One side runs along the packet's first row when that has an extent, so that the frustum hugs the pixels. */
    float u[3];
    for (int axis = 0; axis < 3; axis++)
        u[axis] = rays->dir[axis][3] - rays->dir[axis][0];
    float along = dot3(u, w);
    for (int axis = 0; axis < 3; axis++)
        u[axis] -= along * w[axis];
    float size = sqrtf(dot3(u, u));
    if (!(size > 1e-6f)) {
        const int least = fabsf(w[0]) < fabsf(w[1]) ? (fabsf(w[0]) < fabsf(w[2]) ? 0 : 2) : (fabsf(w[1]) < fabsf(w[2]) ? 1 : 2);
        for (int axis = 0; axis < 3; axis++)
            u[axis] = (axis == least ? 1.0f : 0.0f) - w[least] * w[axis];
        size = sqrtf(dot3(u, u));
    }
    for (int axis = 0; axis < 3; axis++)
        u[axis] /= size;
    const float v[3] = {w[1] * u[2] - w[2] * u[1], w[2] * u[0] - w[0] * u[2], w[0] * u[1] - w[1] * u[0]};

    float slope_low[2] = {FLT_MAX, FLT_MAX}, slope_high[2] = {-FLT_MAX, -FLT_MAX};
    float forward_low = FLT_MAX, forward_high = 0, start_low = FLT_MAX, start_high = -FLT_MAX;
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        const float d[3] = {rays->dir[0][lane], rays->dir[1][lane], rays->dir[2][lane]};
        const float o[3] = {rays->origin[0][lane], rays->origin[1][lane], rays->origin[2][lane]};
        const float forward = dot3(w, d), start = dot3(w, o);
        if (!(forward > 0.3f))
            return false;
        const float slope[2] = {dot3(u, d) / forward, dot3(v, d) / forward};
        for (int k = 0; k < 2; k++)
            slope_low[k] = fminf(slope_low[k], slope[k]), slope_high[k] = fmaxf(slope_high[k], slope[k]);
        forward_low = fminf(forward_low, forward), forward_high = fmaxf(forward_high, forward);
        start_low = fminf(start_low, start), start_high = fmaxf(start_high, start);
    }
    /* Every bound is opened by what rounding could have taken: a few ulps of the slopes and of the largest coordinate. */
    const float slack = 0x1p-20f * scene->coordinate_max;
    const float *axes[2] = {u, v};
    for (int k = 0; k < 2; k++) {
        const float open = 0x1p-21f * (1 + fabsf(slope_low[k]) + fabsf(slope_high[k]));
        for (int sign = 0; sign < 2; sign++) {
            const float slope = sign == 0 ? slope_high[k] + open : slope_low[k] - open;
            const float flip = sign == 0 ? 1.0f : -1.0f;
            float n[3], limit = -FLT_MAX;
            for (int axis = 0; axis < 3; axis++)
                n[axis] = flip * (axes[k][axis] - slope * w[axis]);
            for (int lane = 0; lane < PACKET_LANES; lane++) {
                const float o[3] = {rays->origin[0][lane], rays->origin[1][lane], rays->origin[2][lane]};
                limit = fmaxf(limit, dot3(n, o));
            }
            out->side[2 * k + sign] = make_half_space(n, limit + slack * (1 + fabsf(slope)));
        }
    }
    const float back[3] = {-w[0], -w[1], -w[2]};
    out->side[4] = make_half_space(back, -(start_low + scene->settings.t_near * forward_low * 0.999999f) + slack);
    out->depth = make_half_space(w, 0);
    out->depth_start = start_high + slack;
    out->depth_scale = 0.999999f / forward_high;
    return true;
}

static inline f16 smallest_dot(const half_space *h, const float *node)
{
    f16 sum = f16_mul(f16_set1(h->n[0]), f16_load(node + h->pick[0]));
    sum = f16_fma(f16_set1(h->n[1]), f16_load(node + h->pick[1]), sum);
    return f16_fma(f16_set1(h->n[2]), f16_load(node + h->pick[2]), sum);
}

/* Which children the packet may touch, and a lower bound of t_c inside each. */
static inline unsigned test_children(const frustum *f, const tree_node *node, float t_near, float entry[TREE_WIDTH])
{
    const float *base = (const float *)node;
    m16 inside = f16_le(smallest_dot(&f->side[0], base), f16_set1(f->side[0].limit));
    for (int i = 1; i < 5; i++)
        inside = m16_and(inside, f16_le(smallest_dot(&f->side[i], base), f16_set1(f->side[i].limit)));
    const f16 depth = f16_mul(f16_sub(smallest_dot(&f->depth, base), f16_set1(f->depth_start)), f16_set1(f->depth_scale));
    f16_store(entry, f16_max(depth, f16_set1(t_near)));
    return m16_bits(inside);
}

/* ---- heap of nodes, nearest first ---------------------------------------------------------------------------------------------- */

typedef struct heap_entry {
    float t;
    const tree_node *node;
} heap_entry;

static inline void heap_push(heap_entry *heap, int *count, float t, const tree_node *node)
{
    int i = (*count)++;
    while (i > 0) {
        const int parent = (i - 1) / 2;
        if (heap[parent].t <= t)
            break;
        heap[i] = heap[parent];
        i = parent;
    }
    heap[i] = (heap_entry){t, node};
}

static inline const tree_node *heap_pop(heap_entry *heap, int *count)
{
    const tree_node *node = heap[0].node;
    const heap_entry last = heap[--*count];
    int i = 0;
    for (;;) {
        int child = 2 * i + 1;
        if (child >= *count)
            break;
        if (child + 1 < *count && heap[child + 1].t < heap[child].t)
            child++;
        if (heap[child].t >= last.t)
            break;
        heap[i] = heap[child];
        i = child;
    }
    heap[i] = last;
    return node;
}

/* ---- rows: gather, sort, composite --------------------------------------------------------------------------------------------- */

typedef struct packet_state {
    _Alignas(64) float t[(MAX_ROWS + 1) * PACKET_LANES]; /* infinity where the lane has no hit left in this row */
    _Alignas(64) float alpha[(MAX_ROWS + 1) * PACKET_LANES];
    _Alignas(64) float weight[(MAX_ROWS + 1) * PACKET_LANES]; /* T alpha of what was blended in this round */
    _Alignas(64) uint32_t key[(MAX_ROWS + 1) * PACKET_LANES];
    uint32_t id[MAX_ROWS + 1];
    int row_count;
    f16 transmittance, rgb[3];
    m16 alive;
} packet_state;

static inline void append_row(packet_state *p, const kernel_scene *scene, const ray_lanes *ray, m16 active, f16 t_near, uint32_t id,
                              kernel_counters *counters)
{
    const float *record = scene->records + (size_t)id * RECORD_FLOATS;
    const response r = respond(record, ray, t_near);
    const f16 raw = response_alpha(record, r.d2);
    const m16 hit = m16_and(m16_and(f16_le(f16_set1(scene->settings.alpha_min), raw), active), p->alive);
    counters->tests += PACKET_LANES;
    if (!m16_any(hit))
        return;
    counters->hits += (uint64_t)__builtin_popcount(m16_bits(hit));
    const size_t at = (size_t)p->row_count * PACKET_LANES;
    f16_store(p->t + at, f16_select(hit, r.t, f16_set1(INFINITY)));
    f16_store(p->alpha + at, f16_min(raw, f16_set1(scene->settings.alpha_max)));
    p->id[p->row_count++] = id;
}

static inline void exchange(uint32_t *key, int i, int j)
{
    const u16 a = u16_load(key + (size_t)i * PACKET_LANES), b = u16_load(key + (size_t)j * PACKET_LANES);
    u16_store(key + (size_t)i * PACKET_LANES, u16_min(a, b));
    u16_store(key + (size_t)j * PACKET_LANES, u16_max(a, b));
}

/* Knuth's merge exchange (TAOCP 5.2.2 M): a sorting network for any n, applied to the 16 lanes at once. */
static void sort_rows(uint32_t *key, int n)
{
    int top = 1;
    while (2 * top < n)
        top *= 2;
    for (int p = top; p > 0; p /= 2) {
        int q = top, r = 0, d = p;
        for (;;) {
            for (int i = 0; i < n - d; i++)
                if ((i & p) == r)
                    exchange(key, i, i + d);
            if (q == p)
                break;
            d = q - p, q /= 2, r = p;
        }
    }
}

static bool row_before(const packet_state *p, uint32_t a, uint32_t b, int lane)
{
    const float ta = p->t[a * PACKET_LANES + (uint32_t)lane], tb = p->t[b * PACKET_LANES + (uint32_t)lane];
    return ta < tb || (ta == tb && p->id[a] < p->id[b]);
}

/* Runs of equal 24-bit depth in one lane, put into exact (t_c, id) order by insertion. */
static void settle_ties(packet_state *p, int n, int lane)
{
    uint32_t *key = p->key + lane;
    for (int i = 1; i < n; i++) {
        const uint32_t moved = key[(size_t)i * PACKET_LANES];
        if (moved == KEY_NONE)
            return;
        int j = i;
        for (; j > 0; j--) {
            const uint32_t before = key[(size_t)(j - 1) * PACKET_LANES];
            if ((before ^ moved) >> 8 != 0 || !row_before(p, moved & 255, before & 255, lane))
                break;
            key[(size_t)j * PACKET_LANES] = before;
        }
        key[(size_t)j * PACKET_LANES] = moved;
    }
}

static inline uint8_t *tape_grow(tape_bytes *tape, size_t more)
{
    if (tape->size + more > tape->capacity) {
        size_t wanted = tape->capacity + tape->capacity / 2;
        if (wanted < tape->size + more)
            wanted = tape->size + more;
        if (mem_reserve((void **)&tape->data, &tape->capacity, tape->size, wanted, 1, "hit tape", NULL) != GBT_OK)
            return NULL;
    }
    uint8_t *at = tape->data + tape->size;
    tape->size += more;
    return at;
}

/* A round on the tape: row_count, step_count (u16 each), ids (u32), steps (16 bytes each: row of every lane, or NO_ROW). Row count 0 ends
   the packet. Rows that no lane blended have id 0xFFFFFFFF. */
typedef struct tape_round {
    uint16_t row_count, step_count;
} tape_round;

static bool tape_end(tape_bytes *tape)
{
    const tape_round end = {0, 0};
    uint8_t *at = tape_grow(tape, sizeof end);
    if (at != NULL)
        memcpy(at, &end, sizeof end);
    return at != NULL;
}

/* Sort the rows and blend all hits nearer than `horizon`; keep the rest. */
static bool composite_rows(packet_state *p, const kernel_scene *scene, float horizon, tape_bytes *tape, kernel_counters *counters)
{
    const int n = p->row_count;
    if (n == 0)
        return true;
    f16 low = f16_set1(INFINITY), high = f16_set1(0);
    for (int i = 0; i < n; i++) {
        const f16 t = f16_load(p->t + (size_t)i * PACKET_LANES);
        const m16 valid = f16_lt(t, f16_set1(INFINITY));
        low = f16_min(low, t);
        high = f16_max(high, f16_select(valid, t, f16_set1(0)));
    }
    _Alignas(64) float lanes[2][PACKET_LANES];
    f16_store(lanes[0], low), f16_store(lanes[1], high);
    float t_low = lanes[0][0], t_high = lanes[1][0];
    for (int lane = 1; lane < PACKET_LANES; lane++)
        t_low = fminf(t_low, lanes[0][lane]), t_high = fmaxf(t_high, lanes[1][lane]);
    if (t_low >= horizon)
        return true;
    /* A little under 2^24 steps (room for rounding): monotone in t, so keys never contradict the exact order, they only leave ties. */
    const float range = t_high - t_low;
    const f16 scale = f16_set1(range > 0 ? 16777200.0f / range : 0.0f), start = f16_set1(t_low);
    const float horizon_steps = (horizon - t_low) * (range > 0 ? 16777200.0f / range : 0.0f);
    const uint32_t horizon_key = horizon > t_high ? KEY_NONE : (uint32_t)horizon_steps << 8;
    for (int i = 0; i < n; i++) {
        const f16 t = f16_load(p->t + (size_t)i * PACKET_LANES);
        const m16 valid = f16_lt(t, f16_set1(INFINITY));
        const u16 depth = f16_truncate(f16_mul(f16_sub(t, start), scale));
        const u16 key = u16_or(u16_shl(depth, 8), u16_set1((uint32_t)i));
        u16_store(p->key + (size_t)i * PACKET_LANES, u16_select(valid, key, u16_set1(KEY_NONE)));
        f16_store(p->weight + (size_t)i * PACKET_LANES, f16_set1(0));
    }
    sort_rows(p->key, n);
    counters->sorted_rows += (uint64_t)n;
    m16 tied = m16_from_bits(0);
    u16 previous = u16_load(p->key);
    for (int i = 1; i < n; i++) {
        const u16 key = u16_load(p->key + (size_t)i * PACKET_LANES);
        tied = m16_or(tied, m16_and(u16_eq(u16_shr(key, 8), u16_shr(previous, 8)), u16_lt(key, u16_set1(KEY_NONE))));
        previous = key;
    }
    for (unsigned bits = m16_bits(tied); bits != 0; bits &= bits - 1)
        settle_ties(p, n, __builtin_ctz(bits));

    uint8_t *round = NULL;
    size_t round_at = 0;
    if (tape != NULL) {
        round_at = tape->size;
        round = tape_grow(tape, sizeof(tape_round) + (size_t)n * (sizeof(uint32_t) + PACKET_LANES));
        if (round == NULL)
            return false;
    }
    uint8_t *steps = round == NULL ? NULL : round + sizeof(tape_round) + (size_t)n * sizeof(uint32_t);
    const u16 lane_index = u16_lanes(), row_mask = u16_set1(255), horizon_keys = u16_set1(horizon_key);
    const f16 one = f16_set1(1), stop_at = f16_set1(scene->settings.transmittance_min);
    int step_count = 0;
    for (int i = 0; i < n; i++) {
        const u16 key = u16_load(p->key + (size_t)i * PACKET_LANES);
        m16 blend = m16_and(u16_lt(key, horizon_keys), p->alive);
        if (!m16_any(blend))
            break;
        const u16 row = u16_and(key, row_mask);
        const u16 at = u16_add(u16_shl(row, 4), lane_index);
        const f16 alpha = f16_gather(p->alpha, at);
        const f16 next = f16_mul(p->transmittance, f16_sub(one, alpha));
        const m16 stop = m16_and(blend, f16_lt(next, stop_at));
        p->alive = m16_andnot(stop, p->alive);
        blend = m16_andnot(stop, blend);
        f16_scatter(p->weight, blend, at, f16_mul(p->transmittance, alpha));
        p->transmittance = f16_select(blend, next, p->transmittance);
        counters->blended += (uint64_t)__builtin_popcount(m16_bits(blend));
        if (steps != NULL)
            u16_store_bytes(steps + (size_t)step_count * PACKET_LANES, u16_select(blend, row, u16_set1(NO_ROW)));
        step_count++;
    }
    for (int i = 0; i < n; i++) {
        const f16 weight = f16_load(p->weight + (size_t)i * PACKET_LANES);
        const bool used = m16_any(f16_lt(f16_set1(0), weight));
        if (used) {
            const float *color = scene->records + (size_t)p->id[i] * RECORD_FLOATS + RECORD_COLOR;
            for (int c = 0; c < 3; c++)
                p->rgb[c] = f16_fma(weight, f16_set1(color[c]), p->rgb[c]);
        }
        if (round != NULL) {
            const uint32_t id = used ? p->id[i] : UINT32_MAX;
            memcpy(round + sizeof(tape_round) + (size_t)i * sizeof id, &id, sizeof id);
        }
    }
    if (round != NULL) {
        const tape_round header = {(uint16_t)n, (uint16_t)step_count};
        memcpy(round, &header, sizeof header);
        tape->size = round_at + sizeof header + (size_t)n * sizeof(uint32_t) + (size_t)step_count * PACKET_LANES;
    }
    /* Keep what lies at or behind the horizon, in lanes that are still alive. */
    int kept = 0;
    for (int i = 0; i < n; i++) {
        const f16 t = f16_load(p->t + (size_t)i * PACKET_LANES);
        const m16 valid = m16_and(f16_lt(t, f16_set1(INFINITY)), p->alive);
        const u16 key = u16_shl(f16_truncate(f16_mul(f16_sub(t, start), scale)), 8);
        const m16 remains = m16_andnot(u16_lt(key, horizon_keys), valid);
        if (horizon_key == KEY_NONE || !m16_any(remains))
            continue;
        const size_t to = (size_t)kept * PACKET_LANES;
        f16_store(p->t + to, f16_select(remains, t, f16_set1(INFINITY)));
        f16_store(p->alpha + to, f16_load(p->alpha + (size_t)i * PACKET_LANES));
        p->id[kept++] = p->id[i];
    }
    p->row_count = kept;
    return true;
}

static void load_rays(const packet_rays *rays, ray_lanes *out)
{
    for (int axis = 0; axis < 3; axis++) {
        out->origin[axis] = f16_load(rays->origin[axis]);
        out->dir[axis] = f16_load(rays->dir[axis]);
    }
}

/* ---- the spill path: one lane at a time, every hit -------------------------------------------------------------------------------- */

typedef struct lane_hit {
    float t, alpha;
    uint32_t id;
} lane_hit;

static int compare_hits(const void *a, const void *b)
{
    const lane_hit *x = a, *y = b;
    if (x->t != y->t)
        return x->t < y->t ? -1 : 1;
    return x->id < y->id ? -1 : x->id > y->id;
}

static bool collect_lane(const kernel_scene *scene, const packet_rays *rays, int lane, kernel_scratch *scratch, size_t *count, kernel_counters *counters)
{
    packet_rays single;
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < PACKET_LANES; i++)
            single.origin[axis][i] = rays->origin[axis][lane], single.dir[axis][i] = rays->dir[axis][lane];
    single.active = 1;
    frustum f;
    *count = 0;
    if (scene->root == NULL || !make_frustum(&single, scene, &f))
        return true;
    ray_lanes ray;
    load_rays(&single, &ray);
    const tree_node *stack[STACK_CAPACITY];
    int depth = 0;
    stack[depth++] = scene->root;
    while (depth > 0) {
        const tree_node *node = stack[--depth];
        _Alignas(64) float entry[TREE_WIDTH];
        counters->nodes++;
        for (unsigned bits = test_children(&f, node, scene->settings.t_near, entry); bits != 0; bits &= bits - 1) {
            const uint64_t child = node->child[__builtin_ctz(bits)];
            if (!tree_child_is_gaussian(child)) {
                stack[depth++] = (const tree_node *)(uintptr_t)child;
                continue;
            }
            const uint32_t id = (uint32_t)(child >> 1);
            const float *record = scene->records + (size_t)id * RECORD_FLOATS;
            const response r = respond(record, &ray, f16_set1(scene->settings.t_near));
            _Alignas(64) float t[PACKET_LANES], alpha[PACKET_LANES];
            f16_store(t, r.t), f16_store(alpha, response_alpha(record, r.d2));
            counters->tests++;
            if (!(alpha[0] >= scene->settings.alpha_min))
                continue;
            if (mem_reserve(&scratch->hits, &scratch->hit_capacity, *count, *count + 1, sizeof(lane_hit), "hits of a ray", NULL) != GBT_OK)
                return false;
            const float cut = alpha[0] < scene->settings.alpha_max ? alpha[0] : scene->settings.alpha_max;
            ((lane_hit *)scratch->hits)[(*count)++] = (lane_hit){t[0], cut, id};
            counters->hits++;
        }
    }
    qsort(scratch->hits, *count, sizeof(lane_hit), compare_hits);
    return true;
}

static bool spill_lane(packet_state *p, const kernel_scene *scene, const packet_rays *rays, int lane, tape_bytes *tape, kernel_scratch *scratch,
                       kernel_counters *counters)
{
    size_t count;
    if (!collect_lane(scene, rays, lane, scratch, &count, counters))
        return false;
    _Alignas(64) float transmittance[PACKET_LANES], rgb[3][PACKET_LANES];
    f16_store(transmittance, p->transmittance);
    for (int c = 0; c < 3; c++)
        f16_store(rgb[c], p->rgb[c]);
    const lane_hit *hits = scratch->hits;
    size_t blended = 0;
    for (; blended < count; blended++) {
        const lane_hit *h = &hits[blended];
        const float next = transmittance[lane] * (1 - h->alpha);
        if (next < scene->settings.transmittance_min)
            break;
        const float weight = transmittance[lane] * h->alpha;
        const float *color = scene->records + (size_t)h->id * RECORD_FLOATS + RECORD_COLOR;
        for (int c = 0; c < 3; c++)
            rgb[c][lane] = fmaf(weight, color[c], rgb[c][lane]);
        transmittance[lane] = next;
    }
    counters->blended += blended;
    p->transmittance = f16_load(transmittance);
    for (int c = 0; c < 3; c++)
        p->rgb[c] = f16_load(rgb[c]);
    for (size_t first = 0; tape != NULL && first < blended; first += MAX_ROWS) {
        const size_t n = blended - first < MAX_ROWS ? blended - first : MAX_ROWS;
        const tape_round header = {(uint16_t)n, (uint16_t)n};
        uint8_t *round = tape_grow(tape, sizeof header + n * (sizeof(uint32_t) + PACKET_LANES));
        if (round == NULL)
            return false;
        memcpy(round, &header, sizeof header);
        uint8_t *steps = round + sizeof header + n * sizeof(uint32_t);
        memset(steps, NO_ROW, n * PACKET_LANES);
        for (size_t i = 0; i < n; i++) {
            memcpy(round + sizeof header + i * sizeof(uint32_t), &hits[first + i].id, sizeof(uint32_t));
            steps[i * PACKET_LANES + (size_t)lane] = (uint8_t)i;
        }
    }
    return true;
}

/* ---- forward ------------------------------------------------------------------------------------------------------------------------ */

static void start_packet(packet_state *p, unsigned active)
{
    p->row_count = 0;
    p->transmittance = f16_set1(1);
    for (int c = 0; c < 3; c++)
        p->rgb[c] = f16_set1(0);
    p->alive = m16_from_bits(active);
}

typedef enum gather_result { GATHER_DONE, GATHER_SPILL, GATHER_NO_MEMORY } gather_result;

static gather_result gather_packet(packet_state *p, const kernel_scene *scene, const packet_rays *rays, const frustum *f, tape_bytes *tape,
                                   kernel_counters *counters)
{
    heap_entry heap[HEAP_CAPACITY];
    int heap_count = 0, target = ROW_TARGET;
    const f16 t_near = f16_set1(scene->settings.t_near);
    const m16 active = m16_from_bits(rays->active);
    ray_lanes ray;
    load_rays(rays, &ray);
    heap_push(heap, &heap_count, 0, scene->root);
    while (heap_count > 0) {
        const tree_node *node = heap_pop(heap, &heap_count);
        _Alignas(64) float entry[TREE_WIDTH];
        counters->nodes++;
        for (unsigned bits = test_children(f, node, scene->settings.t_near, entry); bits != 0; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            const uint64_t child = node->child[i];
            if (tree_child_is_gaussian(child)) {
                append_row(p, scene, &ray, active, t_near, (uint32_t)(child >> 1), counters);
            } else {
                __builtin_prefetch((const char *)(uintptr_t)child);
                heap_push(heap, &heap_count, entry[i], (const tree_node *)(uintptr_t)child);
            }
        }
        if (p->row_count >= target) {
            if (!composite_rows(p, scene, heap_count > 0 ? heap[0].t : INFINITY, tape, counters))
                return GATHER_NO_MEMORY;
            if (!m16_any(p->alive))
                return GATHER_DONE;
            target = p->row_count + ROW_TARGET;
            if (target > MAX_ROWS - TREE_WIDTH)
                target = MAX_ROWS - TREE_WIDTH;
        }
        /* A node adds at most TREE_WIDTH rows or heap entries, so these two tests keep both arrays in bounds. */
        if (p->row_count > MAX_ROWS - TREE_WIDTH || heap_count > HEAP_CAPACITY - TREE_WIDTH)
            return GATHER_SPILL;
    }
    return composite_rows(p, scene, INFINITY, tape, counters) ? GATHER_DONE : GATHER_NO_MEMORY;
}

static bool forward(const kernel_scene *scene, const packet_rays *rays, packet_color *out, tape_bytes *tape, kernel_scratch *scratch,
                    kernel_counters *counters)
{
    packet_state p;
    start_packet(&p, rays->active);
    const size_t tape_start = tape == NULL ? 0 : tape->size;
    counters->rays += (uint64_t)__builtin_popcount(rays->active);
    frustum f;
    gather_result result = GATHER_DONE;
    if (scene->root != NULL)
        result = make_frustum(rays, scene, &f) ? gather_packet(&p, scene, rays, &f, tape, counters) : GATHER_SPILL;
    if (result == GATHER_SPILL) {
        counters->spilled_packets++;
        start_packet(&p, rays->active);
        if (tape != NULL)
            tape->size = tape_start;
        for (unsigned bits = rays->active; bits != 0; bits &= bits - 1)
            if (!spill_lane(&p, scene, rays, __builtin_ctz(bits), tape, scratch, counters))
                return false;
    }
    if (result == GATHER_NO_MEMORY || (tape != NULL && !tape_end(tape)))
        return false;
    for (int c = 0; c < 3; c++)
        f16_store(out->rgb[c], f16_fma(p.transmittance, f16_set1(scene->settings.background[c]), p.rgb[c]));
    f16_store(out->transmittance, p.transmittance);
    return true;
}

/* ---- backward ----------------------------------------------------------------------------------------------------------------------- */

/* Scratch of one row of the adjoint, PACKET_LANES floats each. */
enum { ROW_V = 0, ROW_ALPHA_RAW = 3, ROW_COLOR_GRAD = 4, ROW_WEIGHT = 5, ROW_D_ALPHA = 6, ROW_FIELDS = 8 /* a power of two, for the offsets */ };

static inline float *row_field(float *rows, size_t row, int field)
{
    return rows + (row * ROW_FIELDS + (size_t)field) * PACKET_LANES;
}

static bool add_row(float *rows, size_t row, uint32_t id, const kernel_scene *scene, const f16 d_rgb[3], gradient_list *out)
{
    const float *record = scene->records + (size_t)id * RECORD_FLOATS;
    const f16 d_alpha = f16_load(row_field(rows, row, ROW_D_ALPHA)), raw = f16_load(row_field(rows, row, ROW_ALPHA_RAW));
    const f16 weight = f16_load(row_field(rows, row, ROW_WEIGHT));
    /* alpha = min(alpha_max, opacity G): from the cap on nothing but the colour has a gradient. */
    const m16 open = f16_lt(raw, f16_set1(scene->settings.alpha_max)), blended = f16_lt(f16_set1(0), weight);
    const f16 d_raw = f16_select(open, d_alpha, f16_set1(0));
    const f16 d_d2 = f16_mul(f16_set1(-0.5f), f16_mul(raw, d_raw));
    f16 v[3]; /* on rays that did not hit, v may be more than a float holds, and 0 times that is no 0 */
    for (int k = 0; k < 3; k++)
        v[k] = f16_select(blended, f16_load(row_field(rows, row, ROW_V + k)), f16_set1(0));
    const f16 x = v[0], y = v[1], z = v[2];
    const f16 gx = f16_mul(d_d2, x), gy = f16_mul(d_d2, y), gz = f16_mul(d_d2, z);
    f16 terms[16];
    terms[GRADIENT_V] = gx, terms[GRADIENT_V + 1] = gy, terms[GRADIENT_V + 2] = gz;
    terms[GRADIENT_VV] = f16_mul(gx, x), terms[GRADIENT_VV + 1] = f16_mul(gy, y), terms[GRADIENT_VV + 2] = f16_mul(gz, z);
    terms[GRADIENT_VV + 3] = f16_mul(gy, z), terms[GRADIENT_VV + 4] = f16_mul(gz, x), terms[GRADIENT_VV + 5] = f16_mul(gx, y);
    terms[GRADIENT_OPACITY] = f16_div(f16_mul(raw, d_raw), f16_set1(record[RECORD_OPACITY]));
    for (int c = 0; c < 3; c++)
        terms[GRADIENT_COLOR + c] = f16_mul(weight, d_rgb[c]);
    terms[GRADIENT_WEIGHT] = weight;
    terms[14] = terms[15] = f16_set1(0);
    gradient_record *g = gradient_list_find(out, id);
    if (g == NULL)
        return false;
    _Alignas(64) float sums[16];
    f16_store(sums, f16_sum_rows(terms));
    for (int i = 0; i < GRADIENT_FLOATS; i++)
        g->sum[i] += sums[i];
    return true;
}

static bool backward(const kernel_scene *scene, const packet_rays *rays, const float d_rgb_in[3][PACKET_LANES], const uint8_t *tape, size_t *cursor,
                     gradient_list *out, float d_background[3], kernel_scratch *scratch)
{
    ray_lanes ray;
    load_rays(rays, &ray);
    const f16 t_near = f16_set1(scene->settings.t_near), alpha_max = f16_set1(scene->settings.alpha_max), one = f16_set1(1);
    f16 d_rgb[3];
    for (int c = 0; c < 3; c++)
        d_rgb[c] = f16_load(d_rgb_in[c]);

    /* Where each round starts, so that they can be walked in both directions. */
    size_t row_count = 0, step_count = 0, at = *cursor, round_count = 0;
    tape_round round;
    for (;;) {
        memcpy(&round, tape + at, sizeof round);
        if (round.row_count == 0)
            break;
        if (mem_reserve(&scratch->hits, &scratch->hit_capacity, round_count * sizeof(size_t), (round_count + 1) * sizeof(size_t), 1, "adjoint rounds",
                        NULL) != GBT_OK)
            return false;
        ((size_t *)scratch->hits)[round_count++] = at;
        row_count += round.row_count, step_count += round.step_count;
        at += sizeof round + (size_t)round.row_count * sizeof(uint32_t) + (size_t)round.step_count * PACKET_LANES;
    }
    at += sizeof round;
    const size_t *starts = scratch->hits;
    const size_t tape_end_at = at;
    const size_t wanted = (row_count * ROW_FIELDS + step_count) * PACKET_LANES;
    if (mem_reserve((void **)&scratch->rows, &scratch->row_capacity, 0, wanted, sizeof(float), "adjoint rows", NULL) != GBT_OK)
        return false;
    float *rows = scratch->rows, *step_t = rows + row_count * ROW_FIELDS * PACKET_LANES;

    /* Front to back: evaluate the rows again, follow T, note every hit's weight and the T in front of it. */
    f16 transmittance = one;
    const u16 lane_index = u16_lanes();
    size_t base = 0, step = 0;
    for (size_t r = 0; r < round_count; r++) {
        at = starts[r];
        memcpy(&round, tape + at, sizeof round);
        at += sizeof round;
        for (size_t i = 0; i < round.row_count; i++) {
            uint32_t id;
            memcpy(&id, tape + at + i * sizeof id, sizeof id);
            if (id == UINT32_MAX)
                continue;
            const float *record = scene->records + (size_t)id * RECORD_FLOATS;
            response hit = respond(record, &ray, t_near);
            refine_point(record, &ray, t_near, &hit);
            for (int k = 0; k < 3; k++)
                f16_store(row_field(rows, base + i, ROW_V + k), hit.v[k]);
            f16_store(row_field(rows, base + i, ROW_ALPHA_RAW), response_alpha(record, hit.d2));
            f16 color = f16_mul(f16_set1(record[RECORD_COLOR]), d_rgb[0]);
            color = f16_fma(f16_set1(record[RECORD_COLOR + 1]), d_rgb[1], color);
            color = f16_fma(f16_set1(record[RECORD_COLOR + 2]), d_rgb[2], color);
            f16_store(row_field(rows, base + i, ROW_COLOR_GRAD), color);
            f16_store(row_field(rows, base + i, ROW_WEIGHT), f16_set1(0));
            f16_store(row_field(rows, base + i, ROW_D_ALPHA), f16_set1(0));
        }
        at += (size_t)round.row_count * sizeof(uint32_t);
        float *block = row_field(rows, base, 0);
        for (size_t i = 0; i < round.step_count; i++, step++, at += PACKET_LANES) {
            const u16 row = u16_load_bytes(tape + at);
            const m16 blend = u16_lt(row, u16_set1(NO_ROW));
            /* row * ROW_FIELDS * 16 + lane; lanes without a row read row 0 and drop the result */
            const u16 offset = u16_add(u16_shl(u16_select(blend, row, u16_set1(0)), 7), lane_index);
            const f16 alpha = f16_min(f16_gather(block + ROW_ALPHA_RAW * PACKET_LANES, offset), alpha_max);
            f16_store(step_t + step * PACKET_LANES, transmittance);
            f16_scatter(block + ROW_WEIGHT * PACKET_LANES, blend, offset, f16_mul(transmittance, alpha));
            transmittance = f16_select(blend, f16_mul(transmittance, f16_sub(one, alpha)), transmittance);
        }
        base += round.row_count;
    }

    /* Back to front: `behind` is the colour behind each hit, times dL/dC. */
    f16 behind = f16_mul(f16_set1(scene->settings.background[0]), d_rgb[0]);
    behind = f16_fma(f16_set1(scene->settings.background[1]), d_rgb[1], behind);
    behind = f16_fma(f16_set1(scene->settings.background[2]), d_rgb[2], behind);
    for (size_t r = round_count; r-- > 0;) {
        memcpy(&round, tape + starts[r], sizeof round);
        base -= round.row_count;
        const uint8_t *steps = tape + starts[r] + sizeof round + (size_t)round.row_count * sizeof(uint32_t);
        float *block = row_field(rows, base, 0);
        for (size_t i = round.step_count; i-- > 0;) {
            step--;
            const u16 row = u16_load_bytes(steps + i * PACKET_LANES);
            const m16 blend = u16_lt(row, u16_set1(NO_ROW));
            const u16 offset = u16_add(u16_shl(u16_select(blend, row, u16_set1(0)), 7), lane_index);
            const f16 alpha = f16_min(f16_gather(block + ROW_ALPHA_RAW * PACKET_LANES, offset), alpha_max);
            const f16 color = f16_gather(block + ROW_COLOR_GRAD * PACKET_LANES, offset);
            const f16 difference = f16_sub(color, behind);
            f16_scatter(block + ROW_D_ALPHA * PACKET_LANES, blend, offset, f16_mul(f16_load(step_t + step * PACKET_LANES), difference));
            behind = f16_select(blend, f16_fma(alpha, difference, behind), behind);
        }
    }
    bool fine = true;
    base = 0;
    for (size_t r = 0; r < round_count && fine; r++) {
        memcpy(&round, tape + starts[r], sizeof round);
        for (size_t i = 0; i < round.row_count && fine; i++) {
            uint32_t id;
            memcpy(&id, tape + starts[r] + sizeof round + i * sizeof id, sizeof id);
            if (id != UINT32_MAX)
                fine = add_row(rows, base + i, id, scene, d_rgb, out);
        }
        base += round.row_count;
    }
    _Alignas(64) float t[PACKET_LANES];
    f16_store(t, transmittance);
    for (int c = 0; c < 3; c++)
        for (int lane = 0; lane < PACKET_LANES; lane++)
            if (rays->active >> lane & 1)
                d_background[c] += t[lane] * d_rgb_in[c][lane];
    *cursor = tape_end_at;
    return fine;
}

const packet_kernel KERNEL_NAME = {forward, backward};
