/* SPDX-License-Identifier: Apache-2.0 */
/* trace/reference.c -- what one ray sees, in double and as simply as possible. The equations are in the
   header. */
#include "trace/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { RAY_GRAIN = 32, SIDE = 4, PACKET = SIDE * SIDE, MIDDLE = SIDE + 1 };

typedef struct prepared {
    double mean[3], canon[9]; /* canon = S^-1 R^T, row-major: row i belongs to local axis i */
    double opacity, d2_max;   /* beyond d2_max alpha is below alpha_min for certain, so exp() is not needed */
} prepared;

static double field(const reference_scene *scene, enum reference_field f, size_t i)
{
    return scene->fields[(size_t)f * scene->count + i];
}

/* Finite, and with positive scales. */
static bool is_usable(const reference_scene *scene, size_t i)
{
    for (unsigned f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        if (!isfinite(field(scene, (enum reference_field)f, i)))
            return false;
    for (unsigned axis = 0; axis < 3; axis++)
        if (!(field(scene, (enum reference_field)(REFERENCE_scale_x + axis), i) > 0))
            return false;
    return true;
}

static prepared prepare(const reference_scene *scene, const trace_settings *s, size_t i)
{
    prepared p = {.opacity = field(scene, REFERENCE_opacity, i)};
    double q[4], r[9];
    for (int k = 0; k < 4; k++)
        q[k] = field(scene, REFERENCE_quat_w + (unsigned)k, i);
    dquat_to_matrix(q, r);
    for (int axis = 0; axis < 3; axis++) {
        p.mean[axis] = field(scene, REFERENCE_mean_x + (unsigned)axis, i);
        for (int k = 0; k < 3; k++)
            p.canon[3 * axis + k] = r[3 * k + axis] / field(scene, REFERENCE_scale_x + (unsigned)axis, i);
    }
    p.d2_max = is_usable(scene, i) ? 2 * log(p.opacity / (double)s->alpha_min) + 1e-6 : -HUGE_VAL;
    return p;
}

/* The response of one Gaussian; v = x' + t_c w'. NaN anywhere makes the last comparison false. */
static bool respond(const prepared *p, const trace_settings *s, const double origin[3], const double dir[3],
                    reference_hit *hit, double v[3])
{
    const double offset[3] = {origin[0] - p->mean[0], origin[1] - p->mean[1], origin[2] - p->mean[2]};
    double x[3], w[3];
    dmat_apply(p->canon, offset, x);
    dmat_apply(p->canon, dir, w);
    const double along = dvec_dot(w, w), nearest = -dvec_dot(x, w) / along, t_near = (double)s->t_near;
    if (!isfinite(nearest))
        return false;
    hit->t = nearest > t_near ? nearest : t_near;
    for (int k = 0; k < 3; k++)
        v[k] = x[k] + hit->t * w[k];
    hit->d2 = dvec_dot(v, v);
    if (!(hit->d2 <= p->d2_max))
        return false;
    const double alpha = p->opacity * exp(-0.5 * hit->d2);
    hit->alpha = alpha < (double)s->alpha_max ? alpha : (double)s->alpha_max;
    return hit->alpha >= (double)s->alpha_min;
}

static int by_depth_then_id(const void *a, const void *b)
{
    const reference_hit *p = a, *q = b;
    if (p->order != q->order)
        return p->order < q->order ? -1 : 1;
    return p->id < q->id ? -1 : p->id > q->id;
}

typedef struct hit_list {
    reference_hit *hits;
    size_t count, capacity;
} hit_list;

/* A ray, the limits within which it sees, and what the order of its hits depends on. */
typedef struct reference_ray {
    double origin[3], dir[3], near, far;
    double T_front; /* ray_image.T_front */
    bool own_order; /* hits are sorted by their depth; else by packet_depth() of these, from one origin: */
    const ray_image *rays;
    size_t middle, packet[PACKET], packet_count; /* packet: its valid rays, from lane MIDDLE on */
} reference_ray;

static void ray_of(const ray_image *rays, size_t i, double origin[3], double dir[3])
{
    for (int k = 0; k < 3; k++) {
        origin[k] = (double)ray_image_origin(rays, i)[k];
        dir[k] = (double)rays->dir[3 * i + (size_t)k];
    }
}

static double far_of(const ray_image *rays, size_t i)
{
    return rays->far == NULL ? HUGE_VAL : (double)rays->far[i];
}

static double near_of(const ray_image *rays, size_t i)
{
    return rays->near == NULL ? 0 : (double)rays->near[i];
}

static double T_front_of(const ray_image *rays, size_t i)
{
    return rays->near == NULL ? 1 : (double)rays->T_front[i];
}

/* The key of a Gaussian in the one order of a packet's rays (packet_order); 0 if one of them hits it at
   t_near. */
static double packet_depth(const prepared *p, const trace_settings *s, const reference_ray *ray)
{
    double origin[3], dir[3], v[3], near_by = 0;
    reference_hit middle = {.t = HUGE_VAL};
    for (size_t k = 0; k < ray->packet_count; k++) {
        const size_t at = ray->packet[k];
        reference_hit hit;
        ray_of(ray->rays, at, origin, dir);
        if (!respond(p, s, origin, dir, &hit, v) || !(hit.t < far_of(ray->rays, at)) ||
            hit.t < near_of(ray->rays, at))
            continue;
        if (hit.t <= (double)s->t_near)
            return 0;
        if (near_by == 0)
            near_by = hit.t;
    }
    ray_of(ray->rays, ray->middle, origin, dir);
    respond(p, s, origin, dir, &middle, v);
    return fmax(0.5 * near_by, fmin(middle.t, 2 * near_by));
}

static gbt_status gather(const prepared *all, size_t all_count, const trace_settings *s,
                         const reference_ray *ray, hit_list *list, gbt_error *err)
{
    const double *dir = ray->dir;
    list->count = 0;
    if (dir[0] == 0 && dir[1] == 0 && dir[2] == 0)
        return GBT_OK;
    for (size_t i = 0; i < all_count; i++) {
        reference_hit hit = {.id = (uint32_t)i};
        double v[3];
        if (!respond(&all[i], s, ray->origin, dir, &hit, v) || !(hit.t < ray->far) || hit.t < ray->near)
            continue;
        hit.order = ray->own_order ? hit.t : packet_depth(&all[i], s, ray);
        GBT_TRY(mem_reserve((void **)&list->hits, &list->capacity, list->count, list->count + 1, sizeof hit,
                            "reference hits", err));
        list->hits[list->count++] = hit;
    }
    if (list->count > 1)
        qsort(list->hits, list->count, sizeof *list->hits, by_depth_then_id);
    return GBT_OK;
}

/* Front to back; returns how many hits were added. */
static size_t blend(const reference_scene *scene, const trace_settings *s, const reference_hit *hits,
                    size_t count, const double dir[3], double T, double rgb[3], double *transmittance)
{
    double behind[3];
    size_t n = 0;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (; n < count; n++) {
        const reference_hit *hit = &hits[n];
        const double T_next = T * (1 - hit->alpha);
        if (T_next < (double)s->transmittance_min)
            break;
        for (int c = 0; c < 3; c++)
            rgb[c] += T * hit->alpha * field(scene, REFERENCE_red + (unsigned)c, hit->id);
        T = T_next;
    }
    sky_color_exact(&s->sky, s->background, dir, behind);
    for (int c = 0; c < 3; c++)
        rgb[c] += T * behind[c];
    *transmittance = T;
    return n;
}

static gbt_status prepare_all(const reference_scene *scene, const trace_settings *s, prepared **out,
                              gbt_error *err)
{
    *out = mem_alloc(scene->count, sizeof **out, "reference scene", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < scene->count; i++)
        (*out)[i] = prepare(scene, s, i);
    return GBT_OK;
}

/* Sets up ray i and, with packet_order, the rays of its 4 x 4 pixels. The middle one is in their second row
   and column or, if that is not a valid ray, the first that is. */
static void make_reference_ray(const trace_settings *s, const ray_image *rays, size_t i, reference_ray *out)
{
    const size_t width = (size_t)rays->width, x0 = i % width / SIDE * SIDE, y0 = i / width / SIDE * SIDE;
    ray_of(rays, i, out->origin, out->dir);
    out->near = near_of(rays, i);
    out->far = far_of(rays, i);
    out->T_front = T_front_of(rays, i);
    out->own_order = !s->packet_order;
    out->rays = rays;
    out->packet_count = 0;
    for (size_t k = 0, first = PACKET; k < PACKET && s->packet_order; k++) {
        const size_t lane = (MIDDLE + k) % PACKET, x = x0 + lane % SIDE, y = y0 + lane / SIDE;
        double origin[3], dir[3];
        if (x >= width || y >= (size_t)rays->height)
            continue;
        ray_of(rays, y * width + x, origin, dir);
        if (!(dvec_dot(dir, dir) > 0))
            continue;
        out->packet[out->packet_count++] = y * width + x;
        if (k == 0 || lane < first) {
            out->middle = y * width + x;
            first = k == 0 ? 0 : lane;
        }
    }
}

typedef struct visit_job {
    const reference_scene *scene;
    const trace_settings *s;
    const ray_image *rays;
    const bool *wanted;
    const prepared *all;
    reference_visitor *visit;
    void *context;
    gbt_status *status; /* per block */
} visit_job;

static void visit_block(size_t block, size_t begin, size_t end, void *context)
{
    const visit_job *job = context;
    hit_list list = {0};
    for (size_t i = begin; i < end && job->status[block] == GBT_OK; i++) {
        reference_ray ray;
        if (job->wanted != NULL && !job->wanted[i])
            continue;
        make_reference_ray(job->s, job->rays, i, &ray);
        job->status[block] = gather(job->all, job->scene->count, job->s, &ray, &list, NULL);
        if (job->status[block] == GBT_OK)
            job->visit(job->context, i, list.hits, list.count);
    }
    mem_free(list.hits);
}

gbt_status reference_scene_visit(const reference_scene *scene, const trace_settings *s, const ray_image *rays,
                                 const bool *wanted, reference_visitor *visit, void *context, gbt_error *err)
{
    const size_t ray_count = ray_image_count(rays), block_count = parallel_block_count(ray_count, RAY_GRAIN);
    prepared *all = NULL;
    gbt_status *block_status = mem_calloc(block_count, sizeof *block_status, "reference", err);
    gbt_status status = block_status == NULL ? GBT_ERR_NO_MEMORY : prepare_all(scene, s, &all, err);
    if (status == GBT_OK) {
        visit_job job = {scene, s, rays, wanted, all, visit, context, block_status};
        parallel_blocks(ray_count, RAY_GRAIN, visit_block, &job);
        for (size_t block = 0; block < block_count && status == GBT_OK; block++)
            if (block_status[block] != GBT_OK)
                status =
                    base_fail(err, block_status[block],
                              "reference: no memory for the hits of rays from %zu on", block * RAY_GRAIN);
    }
    mem_free(all);
    mem_free(block_status);
    return status;
}

typedef struct forward_job {
    const reference_scene *scene;
    const trace_settings *s;
    const ray_image *rays;
    double *rgb, *transmittance;
    uint32_t *blended;
} forward_job;

static void blend_ray(void *context, size_t i, const reference_hit *hits, size_t count)
{
    const forward_job *job = context;
    double origin[3], dir[3], transmittance;
    ray_of(job->rays, i, origin, dir);
    const size_t n = blend(job->scene, job->s, hits, count, dir, T_front_of(job->rays, i), job->rgb + 3 * i,
                           &transmittance);
    if (job->transmittance != NULL)
        job->transmittance[i] = transmittance;
    if (job->blended != NULL)
        job->blended[i] = (uint32_t)n;
}

gbt_status reference_scene_forward(const reference_scene *scene, const trace_settings *s,
                                   const ray_image *rays, double *rgb, double *transmittance,
                                   uint32_t *blended, gbt_error *err)
{
    forward_job job = {scene, s, rays, rgb, transmittance, blended};
    return reference_scene_visit(scene, s, rays, NULL, blend_ray, &job, err);
}

/* Chain from dL/dalpha of one hit to the fields of its Gaussian. */
static void respond_backward(const reference_scene *scene, const prepared *p, const trace_settings *s,
                             const reference_ray *ray, size_t id, double d_alpha, double *d_gaussians)
{
    reference_hit hit;
    double v[3], q[4], scale[3];
    if (!respond(p, s, ray->origin, ray->dir, &hit, v))
        return;
    const double response = exp(-0.5 * hit.d2);
    if (p->opacity * response >= (double)s->alpha_max)
        return;
    double *const d = d_gaussians + id;
    const size_t n = scene->count;
    const double h = -0.5 * hit.alpha * d_alpha; /* dL/d(d2) */
    d[REFERENCE_opacity * n] += response * d_alpha;
    for (int k = 0; k < 3; k++)
        scale[k] = field(scene, REFERENCE_scale_x + (unsigned)k, id);
    for (int k = 0; k < 4; k++)
        q[k] = field(scene, REFERENCE_quat_w + (unsigned)k, id);
    double d_mean[3];
    dmat_apply_transposed(p->canon, v, d_mean);
    for (size_t k = 0; k < 3; k++) {
        d[(REFERENCE_mean_x + k) * n] -= 2 * h * d_mean[k];
        d[(REFERENCE_scale_x + k) * n] -= 2 * h * v[k] * v[k] / scale[k];
    }
    /* a = 2 dL/domega for the local turn R <- R exp[omega]; dL/dq = q (0, a), orthogonal to q. */
    const double a0 = 4 * h * v[1] * v[2] * (scale[2] / scale[1] - scale[1] / scale[2]);
    const double a1 = 4 * h * v[2] * v[0] * (scale[0] / scale[2] - scale[2] / scale[0]);
    const double a2 = 4 * h * v[0] * v[1] * (scale[1] / scale[0] - scale[0] / scale[1]);
    d[REFERENCE_quat_w * n] -= q[1] * a0 + q[2] * a1 + q[3] * a2;
    d[REFERENCE_quat_x * n] += q[0] * a0 + q[2] * a2 - q[3] * a1;
    d[REFERENCE_quat_y * n] += q[0] * a1 + q[3] * a0 - q[1] * a2;
    d[REFERENCE_quat_z * n] += q[0] * a2 + q[1] * a1 - q[2] * a0;
}

/* dL/d(T alpha) of hit i by trace_settings.spread. */
static double spread_gradient(const trace_settings *s, const reference_hit *hits, size_t count, size_t i,
                              double T)
{
    const double t_near = (double)s->t_near, u = t_near / fmax(hits[i].t, t_near);
    double sum = 0;
    for (size_t j = 0; j < count; j++) {
        const double weight = T * hits[j].alpha, between = t_near / fmax(hits[j].t, t_near) - u;
        sum += weight * (j < i ? between : -between);
        T *= 1 - hits[j].alpha;
    }
    return 2 * (double)s->spread * sum;
}

/* Back to front: `behind` is the colour and `T_behind` the transmittance of everything behind a hit, so
   nothing is divided by 1 - alpha. */
static void ray_backward(const reference_scene *scene, const prepared *all, const trace_settings *s,
                         const reference_ray *ray, const hit_list *list, const double d_rgb[3],
                         double d_transmittance, double *d_gaussians)
{
    double rgb[3], T_left, behind[3], T_behind = 1, spread_behind = 0;
    const bool spreads = s->packet_order && s->spread > 0;
    const size_t blended = blend(scene, s, list->hits, list->count, ray->dir, ray->T_front, rgb, &T_left);
    sky_color_exact(&s->sky, s->background, ray->dir, behind);
    for (size_t i = blended; i-- > 0;) {
        const reference_hit *hit = &list->hits[i];
        double T = ray->T_front;
        for (size_t j = 0; j < i; j++)
            T *= 1 - list->hits[j].alpha;
        double d_alpha = -T * T_behind * d_transmittance;
        for (size_t c = 0; c < 3; c++) {
            const double colour = field(scene, REFERENCE_red + (unsigned)c, hit->id);
            d_gaussians[(REFERENCE_red + c) * scene->count + hit->id] += T * hit->alpha * d_rgb[c];
            d_alpha += T * (colour - behind[c]) * d_rgb[c];
            behind[c] = hit->alpha * colour + (1 - hit->alpha) * behind[c];
        }
        if (spreads) { /* like a further colour */
            const double spread = spread_gradient(s, list->hits, blended, i, ray->T_front);
            d_alpha += T * (spread - spread_behind);
            spread_behind = hit->alpha * spread + (1 - hit->alpha) * spread_behind;
        }
        T_behind *= 1 - hit->alpha;
        respond_backward(scene, &all[hit->id], s, ray, hit->id, d_alpha, d_gaussians);
    }
}

gbt_status reference_scene_backward(const reference_scene *scene, const trace_settings *s,
                                    const ray_image *rays, const double *d_rgb, const double *d_transmittance,
                                    double *d_gaussians, gbt_error *err)
{
    prepared *all = NULL;
    hit_list list = {0};
    gbt_status status = prepare_all(scene, s, &all, err);
    for (size_t i = 0; i < ray_image_count(rays) && status == GBT_OK; i++) {
        reference_ray ray;
        make_reference_ray(s, rays, i, &ray);
        status = gather(all, scene->count, s, &ray, &list, err);
        if (status == GBT_OK)
            ray_backward(scene, all, s, &ray, &list, d_rgb + 3 * i,
                         d_transmittance != NULL ? d_transmittance[i] : 0, d_gaussians);
    }
    mem_free(list.hits);
    mem_free(all);
    return status;
}

gbt_status reference_scene_ray_hits(const reference_scene *scene, const trace_settings *s,
                                    const double origin[3], const double dir[3], reference_hit **hits,
                                    size_t *count, size_t *capacity, gbt_error *err)
{
    hit_list list = {*hits, 0, *capacity};
    reference_ray ray = {.far = HUGE_VAL, .T_front = 1, .own_order = true};
    memcpy(ray.origin, origin, sizeof ray.origin);
    memcpy(ray.dir, dir, sizeof ray.dir);
    prepared *all = NULL;
    gbt_status status = prepare_all(scene, s, &all, err);
    if (status == GBT_OK)
        status = gather(all, scene->count, s, &ray, &list, err);
    mem_free(all);
    *hits = list.hits;
    *capacity = list.capacity;
    *count = status == GBT_OK ? list.count : 0;
    return status;
}

gbt_status reference_scene_make(const gaussians *g, reference_scene *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (g->count > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "reference: %zu Gaussians (wanted at most 2^32 - 1)",
                         g->count);
    out->fields = mem_alloc(g->count, GAUSSIANS_FIELD_COUNT * sizeof *out->fields, "reference scene", err);
    if (out->fields == NULL)
        return GBT_ERR_NO_MEMORY;
    out->count = g->count;
    double *to = out->fields;
#define X(name, pad, meaning)                                                                                \
    for (size_t i = 0; i < g->count; i++)                                                                    \
        *to++ = (double)g->name[i];
    GAUSSIANS_FIELDS(X)
#undef X
    return GBT_OK;
}

void reference_scene_free(reference_scene *scene)
{
    mem_free(scene->fields);
    memset(scene, 0, sizeof *scene);
}

gbt_status reference_forward(const gaussians *g, const trace_settings *s, const ray_image *rays, double *rgb,
                             double *transmittance, uint32_t *blended, gbt_error *err)
{
    reference_scene scene;
    gbt_status status = reference_scene_make(g, &scene, err);
    if (status == GBT_OK)
        status = reference_scene_forward(&scene, s, rays, rgb, transmittance, blended, err);
    reference_scene_free(&scene);
    return status;
}
