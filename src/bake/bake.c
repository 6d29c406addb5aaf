/* SPDX-License-Identifier: Apache-2.0 */
/* bake/bake.c -- converts neural Gaussians to plain ones by averaging over the cameras that see them.

   cameras --> decode, trace, weights --> sums per Gaussian --+
   64 directions --> decode --> sums of colours --------------+--> opacity, shape, spherical harmonics */
#include "bake/bake.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/sh.h"
#include "base/symmetric.h"
#include "base/vec.h"

enum { TERMS = GAUSSIAN_SH_COUNT, PAIRS = TERMS * (TERMS + 1) / 2, DIRECTIONS = 64, PIXEL_STEP = 2 };

static const float opacity_min = 1.0f / 255;
static const double ridge = 1e-4; /* relative to the mean of the diagonal; keeps the fit solvable if all
                                     directions are from one side */

/* The sums for one Gaussian. w is its blend weight in a view; y are the spherical harmonics of the view
   direction, c is its colour. */
typedef struct sums {
    double weight;          /* w, summed over the views in which the decoder made it */
    double opaque;          /* w / opacity */
    double covariance[6];   /* w (xx xy xz yy yz zz) */
    double normal[PAIRS];   /* w y_k y_l, l <= k */
    double color[TERMS][3]; /* w y_k (c - 0.5) */
    float mean[3];
    uint32_t decoded_views; /* number of views in which the decoder made it (opacity above 0) */
} sums;

typedef struct baking {
    const anchors *a;
    int functions;
    sums *sums;             /* [anchor][k]: of Gaussian k */
    uint32_t *anchor_views; /* [anchor] views in which it was decoded */
} baking;

bake_def bake_def_default(void) { return (bake_def){.sh_degree = 3, .prior_weight = 0.3}; }

static void add_color(const baking *b, sums *s, const float direction[3], const float color[3], double weight)
{
    float y[TERMS];
    sh_basis(direction, y);
    for (int k = 0, at = 0; k < b->functions; k++) {
        for (int l = 0; l <= k; l++)
            s->normal[at++] += weight * (double)y[k] * (double)y[l];
        for (int c = 0; c < 3; c++)
            s->color[k][c] += weight * (double)y[k] * ((double)color[c] - 0.5);
    }
}

static void add_covariance(sums *s, const gaussians *g, size_t i, double weight)
{
    const float q[4] = {g->quat_w[i], g->quat_x[i], g->quat_y[i], g->quat_z[i]},
                scale[3] = {g->scale_x[i], g->scale_y[i], g->scale_z[i]};
    float r[9];
    quat_to_matrix(q, r);
    for (int row = 0, at = 0; row < 3; row++)
        for (int column = row; column < 3; column++, at++)
            for (int k = 0; k < 3; k++)
                s->covariance[at] += weight * (double)r[3 * row + k] * (double)r[3 * column + k] *
                                     (double)scale[k] * (double)scale[k];
}

static void direction_to(const double eye[3], const float mean[3], float out[3])
{
    double d[3];
    for (int k = 0; k < 3; k++)
        d[k] = (double)mean[k] - eye[k];
    dvec_normalize(d);
    for (int k = 0; k < 3; k++)
        out[k] = (float)d[k];
}

/* Add one camera: how each Gaussian is decoded for it, and with what weight it is blended in the picture. */
static gbt_status add_view(baking *b, frame *f, const decoder *d, const gbt_camera *camera,
                           const trace_settings *settings, gbt_error *err)
{
    gbt_camera sparse = *camera;
    f->draw.pixel_step = gbt_camera_every(camera, PIXEL_STEP, 0, 0, &sparse) ? PIXEL_STEP : 1;
    GBT_TRY(frame_render(f, frame_neural(b->a, d), &sparse, settings, true, err));
    GBT_TRY(frame_blend_weights(f, err));
    for (size_t v = 0; v < f->visible_count; v++)
        b->anchor_views[f->visible[v]]++;
    const gaussians *g = &f->gaussians;
    const size_t k_count = (size_t)b->a->offset_count;
    for (size_t i = 0; i < g->count; i++) {
        const size_t row = f->tape.slot[i] / k_count, k = f->tape.slot[i] % k_count;
        sums *s = &b->sums[f->visible[row] * k_count + k];
        const double weight = (double)f->blend_weight[i];
        s->decoded_views++;
        s->mean[0] = g->mean_x[i];
        s->mean[1] = g->mean_y[i];
        s->mean[2] = g->mean_z[i];
        if (!(weight > 0))
            continue;
        float direction[3];
        direction_to(camera->center, s->mean, direction);
        s->weight += weight;
        s->opaque += weight / (double)g->opacity[i];
        add_covariance(s, g, i, weight);
        add_color(b, s, direction, (const float[3]){g->red[i], g->green[i], g->blue[i]}, weight);
    }
    return GBT_OK;
}

/* The distance input of the networks in the middle of the trained range; if the model does not record the
   range, the mean distance from cameras to anchors. */
static float middle_distance(const anchors *a, const decoder *d, const gbt_camera *cameras, size_t count)
{
    if (isfinite(d->distance_max))
        return 0.5f * (d->distance_min + d->distance_max);
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < a->count; k++) {
            const float *p = a->position + 3 * k;
            const double *c = cameras[i].center;
            sum +=
                dvec_length((const double[3]){(double)p[0] - c[0], (double)p[1] - c[1], (double)p[2] - c[2]});
        }
    return (float)(sum / (double)(count * a->count)) * d->distance_scale;
}

/* Add the colours of all Gaussians seen along DIRECTIONS directions: decoded from so far away that the
   direction is the same for all, with the distance input clamped to `middle`. */
static gbt_status add_directions(baking *b, frame *f, const decoder *trained, float middle, double prior,
                                 gbt_error *err)
{
    decoder d = *trained;
    d.distance_min = 2 * middle;
    d.distance_max = 0.5f * middle; /* the decoder clamps distances to [min / 2, 2 max], here to `middle` */
    float size = 1;
    for (size_t i = 0; i < 3 * b->a->count; i++)
        size = fmaxf(size, fabsf(b->a->position[i]));
    uint32_t *all = mem_alloc(b->a->count, sizeof *all, "anchors", err);
    if (all == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < b->a->count; i++)
        all[i] = (uint32_t)i;
    gbt_status status = GBT_OK;
    for (int n = 0; n < DIRECTIONS && status == GBT_OK; n++) {
        double toward[3];
        dvec_on_sphere(n, DIRECTIONS, toward);
        const float direction[3] = {(float)toward[0], (float)toward[1], (float)toward[2]};
        const float far[3] = {-1e4f * size * direction[0], -1e4f * size * direction[1],
                              -1e4f * size * direction[2]};
        status = decode_forward(b->a, &d, far, all, b->a->count, 0, &f->gaussians, &f->tape, err);
        for (size_t i = 0; i < f->gaussians.count && status == GBT_OK; i++) {
            sums *s = &b->sums[f->tape.slot[i]]; /* all anchors are decoded: rows are their indices */
            if (s->weight > 0)
                add_color(b, s, direction,
                          (const float[3]){f->gaussians.red[i], f->gaussians.green[i], f->gaussians.blue[i]},
                          prior * s->weight / DIRECTIONS);
        }
    }
    mem_free(all);
    return status;
}

/* Weighted least squares by Cholesky factorization. */
static void solve_color(const baking *b, const sums *s, float *sh)
{
    const int n = b->functions;
    double m[TERMS * TERMS] = {0}, trace = 0;
    for (int k = 0, at = 0; k < n; k++)
        for (int j = 0; j <= k; j++, at++)
            m[k * n + j] = s->normal[at];
    for (int k = 0; k < n; k++)
        trace += m[k * n + k];
    for (int k = 0; k < n; k++)
        m[k * n + k] += ridge * trace / n;
    symmetric_cholesky(m, m, n, 1e-12 * trace);
    memset(sh, 0, TERMS * 3 * sizeof *sh);
    for (int c = 0; c < 3; c++) {
        double x[TERMS];
        for (int k = 0; k < n; k++)
            x[k] = s->color[k][c];
        symmetric_solve(m, x, n);
        for (int k = 0; k < n; k++)
            sh[3 * k + c] = (float)x[k];
    }
}

/* The standard deviations along the principal axes of the covariance, and the rotation to these axes. */
static void solve_shape(const sums *s, float scale_log[3], float quat[4])
{
    const double *c = s->covariance;
    double m[9] = {c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]}, v[9];
    symmetric_eigen(m, v, 3, 1e-15);
    double largest = fmax(m[0], fmax(m[4], m[8]));
    largest = largest > 0 ? largest : s->weight;
    for (int k = 0; k < 3; k++)
        scale_log[k] =
            (float)(0.5 *
                    log(fmax(m[4 * k], largest / (GAUSSIAN_SCALE_RATIO * GAUSSIAN_SCALE_RATIO)) / s->weight));
    double q[4];
    dquat_of_matrix(v, q);
    for (int k = 0; k < 4; k++)
        quat[k] = (float)q[k];
}

/* The mean opacity over the views in which the anchor was decoded. In views where this Gaussian was not made,
   its opacity counts as 0 and its weight, had it been opaque, as the mean of the other views. */
static float opacity_of(const sums *s, uint32_t anchor_views)
{
    const double missed = anchor_views > s->decoded_views && s->decoded_views > 0
                              ? (double)(anchor_views - s->decoded_views) / s->decoded_views
                              : 0;
    return s->weight > 0 ? (float)fmin(s->weight / (s->opaque * (1 + missed)), 1) : 0;
}

typedef struct ranked {
    double weight;
    size_t slot;
} ranked;

static int by_weight(const void *a, const void *b)
{
    const ranked *x = a, *y = b;
    if (x->weight > y->weight || x->weight < y->weight)
        return x->weight > y->weight ? -1 : 1;
    return (x->slot > y->slot) - (x->slot < y->slot);
}

static int by_slot(const void *a, const void *b)
{
    const ranked *x = a, *y = b;
    return (x->slot > y->slot) - (x->slot < y->slot);
}

/* Choose the Gaussians that some camera sees; of these at most `count_max` (0: all) with the largest weights.
   Ordered by slot. */
static size_t choose(const baking *b, size_t count_max, ranked *list, bake_result *out)
{
    const size_t k_count = (size_t)b->a->offset_count, slots = b->a->count * k_count;
    size_t count = 0;
    for (size_t i = 0; i < slots; i++)
        if (opacity_of(&b->sums[i], b->anchor_views[i / k_count]) >= opacity_min)
            list[count++] = (ranked){b->sums[i].weight, i};
    out->unseen = slots - count;
    if (count_max == 0 || count <= count_max)
        return count;
    out->thinned = count - count_max;
    qsort(list, count, sizeof *list, by_weight);
    qsort(list, count_max, sizeof *list, by_slot);
    return count_max;
}

static gbt_status solve(const baking *b, const bake_def *def, bake_result *out, gbt_error *err)
{
    const size_t k_count = (size_t)b->a->offset_count;
    ranked *list = mem_alloc(b->a->count * k_count, sizeof *list, "Gaussians to keep", err);
    if (list == NULL)
        return GBT_ERR_NO_MEMORY;
    const size_t count = choose(b, def->count_max, list, out);
    gaussian_cloud *cloud = &out->cloud;
    gbt_status status =
        count > 0 ? gaussian_cloud_alloc(cloud, count, err)
                  : base_fail(err, GBT_ERR_ARGUMENT, "no camera sees any Gaussian: nothing to bake");
    cloud->sh_degree = def->sh_degree;
    for (size_t to = 0; to < count && status == GBT_OK; to++) {
        const size_t slot = list[to].slot;
        const sums *s = &b->sums[slot];
        memcpy(cloud->mean + 3 * to, s->mean, sizeof s->mean);
        cloud->opacity[to] = opacity_of(s, b->anchor_views[slot / k_count]);
        solve_shape(s, cloud->scale_log + 3 * to, cloud->quat + 4 * to);
        solve_color(b, s, cloud->sh + to * TERMS * 3);
    }
    mem_free(list);
    return status;
}

gbt_status bake_cloud(frame *f, const anchors *a, const decoder *d, const gbt_camera *cameras,
                      size_t camera_count, const trace_settings *settings, const bake_def *def,
                      bake_result *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (def->sh_degree < 0 || def->sh_degree > 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "bake: sh_degree %d (wanted 0 to 3)", def->sh_degree);
    if (!(def->prior_weight >= 0 && def->prior_weight <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "bake: prior_weight %g (wanted 0 to 1)", def->prior_weight);
    baking b = {.a = a, .functions = sh_count(def->sh_degree)};
    b.sums = mem_calloc(a->count * (size_t)a->offset_count, sizeof *b.sums, "Gaussians to bake", err);
    b.anchor_views = mem_calloc(a->count, sizeof *b.anchor_views, "anchors to bake", err);
    gbt_status status = b.sums == NULL || b.anchor_views == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    const frame_drawing drawing = f->draw;
    f->draw.renderer = GBT_RENDERER_TRACE;
    if (status == GBT_OK && camera_count > 0)
        log_count("bake", 0, camera_count, (double)NAN);
    for (size_t i = 0; i < camera_count && status == GBT_OK; i++) {
        status = add_view(&b, f, d, &cameras[i], &settings[i], err);
        log_count("bake", i + 1, camera_count, (double)NAN);
    }
    f->draw = drawing;
    if (status == GBT_OK && def->prior_weight > 0)
        status =
            add_directions(&b, f, d, middle_distance(a, d, cameras, camera_count), def->prior_weight, err);
    if (status == GBT_OK)
        status = solve(&b, def, out, err);
    mem_free(b.sums);
    mem_free(b.anchor_views);
    return status;
}
