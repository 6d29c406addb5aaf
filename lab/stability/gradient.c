/* SPDX-License-Identifier: Apache-2.0 */
/* stability/gradient.c -- compare the tracer's gradient with finite differences in double. */
#include "stability/gradient.h"

#include <math.h>

#include "base/memory.h"
#include "stability/draw.h"
#include "trace/reference.h"

typedef struct differences {
    const trace_settings *settings;
    const ray_image *rays;
    reference_scene scene;
    double *rgb;
} differences;

static double sum_picture(stability *s, differences *d)
{
    double sum = 0;
    if (s->status == GBT_OK)
        stability_ok(s, reference_scene_forward(&d->scene, d->settings, d->rays, d->rgb, NULL, NULL, s->err));
    for (size_t i = 0; i < 3 * ray_image_count(d->rays) && s->status == GBT_OK; i++)
        sum += d->rgb[i];
    return sum;
}

/* Central difference with respect to one field of one Gaussian. */
static double difference_by(stability *s, differences *d, size_t field, size_t i)
{
    static const double step = 1e-6;
    double *value = &d->scene.fields[field * d->scene.count + i];
    const double middle = *value;
    *value = middle + step;
    const double above = sum_picture(s, d);
    *value = middle - step;
    const double below = sum_picture(s, d);
    *value = middle;
    return (above - below) / (2 * step);
}

/* Project a quaternion's gradient onto the tangent space of the unit sphere. */
static void make_tangent(const reference_scene *scene, size_t i, double d[GAUSSIANS_FIELD_COUNT])
{
    double along = 0;
    for (size_t k = 0; k < 4; k++)
        along += d[REFERENCE_quat_w + k] * scene->fields[(REFERENCE_quat_w + k) * scene->count + i];
    for (size_t k = 0; k < 4; k++)
        d[REFERENCE_quat_w + k] -= along * scene->fields[(REFERENCE_quat_w + k) * scene->count + i];
}

static void trace_gradient(stability *s, const gaussians *g, const trace_settings *settings,
                           const ray_image *rays, gaussians *d_gaussians)
{
    trace_scene traced = {0};
    image rgb = {0}, ones = {0};
    stability_ok(s, image_alloc(&rgb, rays->width, rays->height, 3, s->err));
    stability_ok(s, image_alloc(&ones, rays->width, rays->height, 3, s->err));
    for (size_t i = 0; i < 3 * ray_image_count(rays) && s->status == GBT_OK; i++)
        ones.pixels[i] = 1;
    if (s->status == GBT_OK &&
        stability_ok(s, trace_build(&traced, g, settings, ray_image_reach(rays), s->err)) &&
        stability_ok(s, trace_forward(&traced, rays, true, &(trace_outputs){.rgb = &rgb}, NULL, s->err)))
        stability_ok(s, trace_backward(&traced, rays, &ones, d_gaussians, NULL, s->err));
    trace_scene_free(&traced);
    image_free(&rgb);
    image_free(&ones);
}

gradient_error draw_gradient_error(stability *s, const gaussians *g, const trace_settings *settings,
                                   const ray_image *rays, gaussians *d_gaussians)
{
    differences d = {.settings = settings, .rays = rays};
    double off = 0, all = 0;
    gradient_error out = {0, 0};
    if (s->status != GBT_OK)
        return out;
    d.rgb = mem_alloc(ray_image_count(rays), 3 * sizeof *d.rgb, "picture in double", s->err);
    stability_ok(s, d.rgb == NULL ? GBT_ERR_NO_MEMORY : reference_scene_make(g, &d.scene, s->err));
    trace_gradient(s, g, settings, rays, d_gaussians);
    for (size_t i = 0; i < g->count && s->status == GBT_OK; i++) {
        double want[GAUSSIANS_FIELD_COUNT];
        for (size_t f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
            want[f] = difference_by(s, &d, f, i);
        make_tangent(&d.scene, i, want);
        size_t f = 0;
#define X(name, pad, meaning)                                                                                \
    off += ((double)d_gaussians->name[i] - want[f]) * ((double)d_gaussians->name[i] - want[f]);              \
    all += want[f] * want[f], f++;
        GAUSSIANS_FIELDS(X)
#undef X
    }
    if (s->status == GBT_OK)
        out = (gradient_error){sqrt(off) / (all > 0 ? sqrt(all) : 1), draw_count_bad_fields(d_gaussians)};
    reference_scene_free(&d.scene);
    mem_free(d.rgb);
    return out;
}
