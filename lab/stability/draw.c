/* SPDX-License-Identifier: Apache-2.0 */
/* stability/draw.c -- pictures for the cases of the study "stability". */
#include "stability/draw.h"

#include <math.h>
#include <string.h>

#include "base/compare.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/vec.h"
#include "trace/reference.h"

/* ---- pictures ---- */

static void fit(stability *s, drawing *d, int width, int height)
{
    const size_t count = (size_t)width * (size_t)height;
    if (d->rgb.width != width || d->rgb.height != height) {
        image_free(&d->rgb);
        stability_ok(s, image_alloc(&d->rgb, width, height, 3, s->err));
    }
    if (s->status == GBT_OK)
        stability_ok(s, mem_reserve((void **)&d->transmittance, &d->transmittance_capacity, 0, count,
                                    sizeof(float), "transmittance", s->err));
}

void draw_traced(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                 const ray_image *rays)
{
    if (s->status != GBT_OK)
        return;
    fit(s, d, rays->width, rays->height);
    if (s->status == GBT_OK)
        stability_ok(s, trace_build(&d->traced, g, settings, ray_image_reach(rays), s->err));
    if (s->status == GBT_OK)
        stability_ok(s, trace_forward(&d->traced, rays, false,
                                      &(trace_outputs){.rgb = &d->rgb, .transmittance = d->transmittance},
                                      NULL, s->err));
}

void draw_splatted(stability *s, drawing *d, const gaussians *g, const raster_settings *settings,
                   const gbt_camera *camera)
{
    if (s->status != GBT_OK)
        return;
    fit(s, d, camera->width, camera->height);
    if (s->status == GBT_OK)
        stability_ok(s, raster_forward(&d->splatted, g, camera, settings, false, &d->rgb, d->transmittance,
                                       NULL, s->err));
}

void drawing_free(drawing *d)
{
    trace_scene_free(&d->traced);
    raster_scene_free(&d->splatted);
    image_free(&d->rgb);
    mem_free(d->transmittance);
    d->transmittance = NULL;
    d->transmittance_capacity = 0;
}

void draw_camera(stability *s, drawing *d, const gaussians *g, const trace_settings *settings,
                 const gbt_camera *camera, ray_image *rays)
{
    if (s->status == GBT_OK && stability_ok(s, ray_image_from_camera(camera, rays, s->err)))
        draw_traced(s, d, g, settings, rays);
}

double *draw_exact(stability *s, const gaussians *g, const trace_settings *settings, const ray_image *rays,
                   double *transmittance)
{
    if (s->status != GBT_OK)
        return NULL;
    double *rgb = mem_alloc(ray_image_count(rays), 3 * sizeof *rgb, "picture in double", s->err);
    if (stability_ok(s, rgb == NULL ? GBT_ERR_NO_MEMORY
                                    : reference_forward(g, settings, rays, rgb, transmittance, NULL, s->err)))
        return rgb;
    mem_free(rgb);
    return NULL;
}

/* ---- cameras and rays ---- */

gbt_camera draw_pinhole(int width, int height, double focal, const double center[3])
{
    return (gbt_camera){.model = GBT_CAMERA_PINHOLE,
                        .width = width,
                        .height = height,
                        .params = {focal, focal, 0.5 * width, 0.5 * height},
                        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1},
                        .center = {center[0], center[1], center[2]}};
}

void draw_turned(double yaw, double pitch, double rotation[9])
{
    const double c = cos(yaw), n = sin(yaw), a = cos(pitch), b = sin(pitch);
    const double turned[9] = {c, 0, -n, b * n, a, b * c, a * n, -b, a * c};
    memcpy(rotation, turned, sizeof turned);
}

void draw_rays(stability *s, ray_image *rays, int width, int height)
{
    if (s->status == GBT_OK)
        stability_ok(s, ray_image_reserve(rays, width, height, false, s->err));
}

void draw_ray(ray_image *rays, size_t i, const double origin[3], const double dir[3])
{
    double unit[3] = {dir[0], dir[1], dir[2]};
    dvec_normalize(unit);
    for (size_t k = 0; k < 3; k++) {
        rays->origin[3 * i + k] = (float)origin[k];
        rays->dir[3 * i + k] = (float)unit[k];
    }
}

/* ---- Gaussians ---- */

void draw_alloc(stability *s, gaussians *g, size_t count)
{
    static const double zero[3] = {0, 0, 0}, one[3] = {1, 1, 1}, grey[3] = {0.5, 0.5, 0.5};
    if (s->status != GBT_OK || !stability_ok(s, gaussians_resize(g, count, s->err)))
        return;
    gaussians_pad(g);
    for (size_t i = 0; i < count; i++)
        draw_set(g, i, zero, one, NULL, 1, grey);
}

void draw_set(gaussians *g, size_t i, const double mean[3], const double scale[3], const double quat[4],
              double opacity, const double color[3])
{
    static const double none[4] = {1, 0, 0, 0};
    const double *q = quat != NULL ? quat : none;
    g->mean_x[i] = (float)mean[0];
    g->mean_y[i] = (float)mean[1];
    g->mean_z[i] = (float)mean[2];
    g->scale_x[i] = (float)scale[0];
    g->scale_y[i] = (float)scale[1];
    g->scale_z[i] = (float)scale[2];
    g->quat_w[i] = (float)q[0];
    g->quat_x[i] = (float)q[1];
    g->quat_y[i] = (float)q[2];
    g->quat_z[i] = (float)q[3];
    g->opacity[i] = (float)opacity;
    g->red[i] = (float)color[0];
    g->green[i] = (float)color[1];
    g->blue[i] = (float)color[2];
}

static void draw_normals(uint64_t seed, uint64_t stream, uint64_t i, int count, double *out)
{
    double square = 0;
    for (int k = 0; k < count; k++) {
        out[k] = rng_normal(seed, stream + (uint64_t)k, i);
        square += out[k] * out[k];
    }
    for (int k = 0; k < count; k++)
        out[k] /= sqrt(square);
}

void draw_random_turn(uint64_t seed, uint64_t stream, uint64_t i, double quat[4])
{
    draw_normals(seed, stream, i, 4, quat);
}

void draw_random_direction(uint64_t seed, uint64_t stream, uint64_t i, double dir[3])
{
    draw_normals(seed, stream, i, 3, dir);
}

/* ---- comparing ---- */

double draw_difference(const float *a, const float *b, size_t count)
{
    double most = 0;
    for (size_t i = 0; i < count; i++)
        most = larger_or_nan(most, fabs((double)a[i] - (double)b[i]));
    return most;
}

double draw_error(const float *a, const double *exact, size_t count)
{
    double most = 0;
    for (size_t i = 0; i < count; i++)
        most = larger_or_nan(most, fabs((double)a[i] - exact[i]));
    return most;
}

double draw_psnr(const float *a, const double *exact, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += ((double)a[i] - exact[i]) * ((double)a[i] - exact[i]);
    return sum > 0 ? fmin(-10 * log10(sum / (double)count), 200) : isnan(sum) ? sum : 200;
}

size_t draw_count_bad(const float *values, size_t count)
{
    size_t bad = 0;
    for (size_t i = 0; i < count; i++)
        bad += !isfinite(values[i]);
    return bad;
}

size_t draw_count_bad_fields(const gaussians *g)
{
    size_t bad = 0;
#define X(name, pad, meaning) bad += draw_count_bad(g->name, g->count);
    GAUSSIANS_FIELDS(X)
#undef X
    return bad;
}
