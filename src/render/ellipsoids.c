/* SPDX-License-Identifier: Apache-2.0 */
/* render/ellipsoids.c -- render solid ellipsoids, shaded, with a depth buffer.

   Every ellipsoid gets a screen-space bounding box; each ray inside it (four per pixel) is intersected with
   the ellipsoid, and the nearest hit stays. Bands of rows run in parallel, so results do not depend on the
   number of threads. */
#include "render/ellipsoids.h"

#include <math.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { CHECK_SOLIDS = 1 << 12 };
enum {
    FINE = 2 /* rays per pixel, in each direction */,
    BAND = 16 /* rows of rays drawn by one task */
};

/* Rays to intersect in one call, summed over all bounding boxes: a few seconds. */
static const double rays_most = 1e9;

/** One ellipsoid, ready for intersection: to_unit maps world vectors into the space where it is the unit
    sphere. */
typedef struct solid {
    float center[3], to_unit[9], color[3];
    int left, right, top, bottom; /* bounding box in rays, half open */
} solid;

typedef struct drawing {
    const gbt_camera *camera;
    const solid *solids;
    size_t count;
    int width, height; /* rays */
    float *depth;      /* [height][width], the ray parameter of the hit; infinity: no hit */
    float *color;      /* [height][width][3] */
} drawing;

/** Project a point in camera axes into the picture, in units of rays. */
static void project(const gbt_camera *c, double x, double y, double z, double out[2])
{
    const double scale = c->model == GBT_CAMERA_PINHOLE ? 1 / z : 1;
    out[0] = FINE * (c->params[0] * x * scale + c->params[2]);
    out[1] = FINE * (c->params[1] * y * scale + c->params[3]);
}

/** Clamped before the conversion to int, which very distant ellipsoids would overflow. */
static int clamp_ray(double at, int end) { return (int)fmin(fmax(at, 0), end); }

/** The bounding box; false if the ellipsoid is behind the camera, reaches its plane, or is outside the
    picture. */
static bool find_box(const gbt_camera *c, const double center[3], double radius, const drawing *d, solid *out)
{
    double way[3], at[3], low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 3; k++)
        way[k] = center[k] - c->center[k];
    dmat_apply(c->rotation, way, at);
    if (!(at[2] > 1.05 * radius))
        return false;
    for (int corner = 0; corner < 8; corner++) {
        double p[2];
        project(c, at[0] + (corner & 1 ? radius : -radius), at[1] + (corner & 2 ? radius : -radius),
                at[2] + (corner & 4 ? radius : -radius), p);
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], p[k]);
            high[k] = fmax(high[k], p[k]);
        }
    }
    out->left = clamp_ray(floor(low[0]), d->width);
    out->right = clamp_ray(ceil(high[0]), d->width);
    out->top = clamp_ray(floor(low[1]), d->height);
    out->bottom = clamp_ray(ceil(high[1]), d->height);
    return out->left < out->right && out->top < out->bottom;
}

static bool make_solid(const ellipsoids *set, size_t i, const drawing *d, solid *out)
{
    const gbt_camera *c = d->camera;
    const double center[3] = {(double)set->center[3 * i], (double)set->center[3 * i + 1],
                              (double)set->center[3 * i + 2]};
    double way[3], axes[3], radius = 0;
    for (int k = 0; k < 3; k++)
        way[k] = center[k] - c->center[k];
    const double pixel =
        (c->model == GBT_CAMERA_PINHOLE ? fmax(dvec_dot(way, c->rotation + 6), 0) : 1) / c->params[0];
    for (int k = 0; k < 3; k++) {
        axes[k] = fmax((double)set->axes[3 * i + (size_t)k], (double)set->least_pixels * pixel);
        radius = fmax(radius, axes[k]);
    }
    if (set->most_pixels > 0.0f && radius > (double)set->most_pixels * pixel)
        return false;
    if (!(radius > 0 && isfinite(radius)) || !find_box(c, center, radius, d, out))
        return false;
    float turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (set->quat != NULL)
        quat_to_matrix(set->quat + 4 * i, turn);
    for (int row = 0; row < 3; row++)
        for (int k = 0; k < 3; k++)
            out->to_unit[3 * row + k] =
                turn[3 * k + row] /
                (float)fmax(axes[row], 1e-3 * radius); /* a flat ellipsoid gets a small thickness */
    for (int k = 0; k < 3; k++) {
        out->center[k] = (float)center[k];
        out->color[k] = set->color[3 * i + (size_t)k];
    }
    return true;
}

static void apply(const float m[9], const float a[3], float out[3])
{
    for (int row = 0; row < 3; row++)
        out[row] = m[3 * row] * a[0] + m[3 * row + 1] * a[1] + m[3 * row + 2] * a[2];
}

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/** The ray through sample (x, y). A pinhole's direction is not unit length, but has depth 1, so that the ray
    parameters of all hits can be compared. */
static void make_ray(const gbt_camera *c, int x, int y, float origin[3], float dir[3])
{
    const double u = ((x + 0.5) / FINE - c->params[2]) / c->params[0],
                 v = ((y + 0.5) / FINE - c->params[3]) / c->params[1];
    const bool pinhole = c->model == GBT_CAMERA_PINHOLE;
    for (int k = 0; k < 3; k++) {
        const double across = u * c->rotation[k] + v * c->rotation[3 + k];
        origin[k] = (float)(c->center[k] + (pinhole ? 0 : across));
        dir[k] = (float)(c->rotation[6 + k] + (pinhole ? across : 0));
    }
}

/** A headlight, darker towards the silhouette, so that neighbours of the same colour can be told apart. */
static float shade(const solid *s, const float hit[3], const float dir[3])
{
    float normal[3];
    for (int k = 0; k < 3; k++)
        normal[k] = s->to_unit[k] * hit[0] + s->to_unit[3 + k] * hit[1] + s->to_unit[6 + k] * hit[2];
    const float facing = -dot(normal, dir) / sqrtf(dot(normal, normal) * dot(dir, dir) + 1e-30f);
    return 0.35f + 0.65f * sqrtf(fmaxf(facing, 0.0f));
}

static void draw_row(const drawing *d, const solid *s, int y)
{
    for (int x = s->left; x < s->right; x++) {
        float origin[3], dir[3], from[3], o[3], w[3];
        make_ray(d->camera, x, y, origin, dir);
        for (int k = 0; k < 3; k++)
            from[k] = origin[k] - s->center[k];
        apply(s->to_unit, from, o);
        apply(s->to_unit, dir, w);
        const float a = dot(w, w), b = dot(o, w);
        float nearest[3]; /* the point of the ray nearest to the centre; |o|^2 - 1 would cancel */
        for (int k = 0; k < 3; k++)
            nearest[k] = o[k] - b / a * w[k];
        const float inside = 1.0f - dot(nearest, nearest), t = -b / a - sqrtf(fmaxf(inside, 0.0f) / a);
        float *depth = &d->depth[(size_t)y * (size_t)d->width + (size_t)x];
        if (!(inside > 0.0f && t > 0.0f && t < *depth)) /* of equal depths the first stays */
            continue;
        float hit[3];
        for (int k = 0; k < 3; k++)
            hit[k] = o[k] + t * w[k];
        const float light = shade(s, hit, dir);
        *depth = t;
        for (size_t k = 0; k < 3; k++)
            d->color[3 * ((size_t)y * (size_t)d->width + (size_t)x) + k] = light * s->color[k];
    }
}

static void draw_band(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const drawing *d = context;
    for (size_t i = 0; i < d->count; i++) {
        const solid *s = &d->solids[i];
        for (int y = s->top > (int)begin ? s->top : (int)begin; y < s->bottom && y < (int)end; y++)
            draw_row(d, s, y);
    }
}

/** The mean of each pixel's rays, composited over what `out` holds. */
static void blend(const drawing *d, image *out)
{
    for (int y = 0; y < out->height; y++) {
        if (y % BAND == 0)
            paged_check();
        for (int x = 0; x < out->width; x++) {
            float sum[4] = {0};
            for (int v = 0; v < FINE; v++)
                for (int u = 0; u < FINE; u++) {
                    const size_t i = (size_t)(FINE * y + v) * (size_t)d->width + (size_t)(FINE * x + u);
                    const float met = d->depth[i] < INFINITY ? 1.0f / (FINE * FINE) : 0.0f;
                    for (size_t k = 0; k < 3 && met > 0.0f; k++)
                        sum[k] += met * d->color[3 * i + k];
                    sum[3] += met;
                }
            float *pixel = out->pixels + 4 * ((size_t)y * (size_t)out->width + (size_t)x);
            const float under = pixel[3] * (1.0f - sum[3]), whole = sum[3] + under;
            for (int k = 0; k < 3 && whole > 0.0f; k++)
                pixel[k] = (sum[k] + under * pixel[k]) / whole;
            pixel[3] = whole;
        }
    }
}

/** Ellipsoids that all fill the picture would take minutes, and mostly hide one another: keep every n-th, so
    that rays_most is not exceeded. */
static void thin_out(solid *solids, size_t *count)
{
    double rays = 0;
    for (size_t i = 0; i < *count; i++)
        rays += (double)(solids[i].right - solids[i].left) * (solids[i].bottom - solids[i].top);
    const size_t step = (size_t)ceil(fmax(rays / rays_most, 1));
    size_t kept = 0;
    for (size_t i = 0; i < *count; i += step)
        solids[kept++] = solids[i];
    *count = kept;
}

gbt_status ellipsoids_draw(const ellipsoids *set, const gbt_camera *camera, image *out, gbt_error *err)
{
    if ((camera->model != GBT_CAMERA_PINHOLE && camera->model != GBT_CAMERA_ORTHOGRAPHIC) ||
        out->channels != 4 || out->width != camera->width || out->height != camera->height)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "ellipsoids: wanted a pinhole or orthographic camera, and a picture of its size with 4 channels");
    drawing d = {.camera = camera, .width = FINE * out->width, .height = FINE * out->height};
    const size_t rays = (size_t)d.width * (size_t)d.height;
    solid *solids = mem_alloc(set->count, sizeof *solids, "ellipsoids", err);
    d.depth = mem_alloc(rays, sizeof *d.depth, "ellipsoids", err);
    d.color = mem_alloc(rays, 3 * sizeof *d.color, "ellipsoids", err);
    gbt_status status = solids != NULL && d.depth != NULL && d.color != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK) {
        for (size_t i = 0; i < rays; i++)
            d.depth[i] = INFINITY;
        paged_check();
        for (size_t i = 0; i < set->count; i++) {
            d.count += make_solid(set, i, &d, &solids[d.count]);
            if (i % CHECK_SOLIDS == 0)
                paged_check();
        }
        thin_out(solids, &d.count);
        d.solids = solids;
        parallel_blocks((size_t)d.height, BAND, draw_band, &d);
        blend(&d, out);
    }
    mem_free(solids);
    mem_free(d.depth);
    mem_free(d.color);
    return status;
}
