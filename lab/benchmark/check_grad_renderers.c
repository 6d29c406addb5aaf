/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/check_grad_renderers.c -- compare the adjoints of the renderers with double-precision versions.
 */
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "benchmark/check_grad.h"
#include "reference/raster_ref.h"
#include "trace/rounding_band.h"

/* Errors that float32 explains. Trained scenes have Gaussians whose thickness is 1e-5 of their distance,
   where the rounding of coordinates alone is 1e-2 of a standard deviation; the limit is five times that of
   the random scenes in the tests. */
static const double renderer_limit = 5e-5;
static const double colour_limit = 1e-5; /* between float and double splats that blend the same Gaussians */
/* Largest share of rays that may be left out. For splats, rounding changes few pixels; if more differ, they
   are drawn wrong. */
static const double left_out_limit = 0.9, left_out_limit_of_splats = 0.01;

/* Find the rays on which rounding may change which Gaussians are blended, or in which order. */
static gbt_status find_band(grad_checker *c, bool *in_band, gbt_error *err)
{
    memset(in_band, true, c->ray_count);
    return rounding_band_find(&c->scene, &c->run->settings, &c->frame->rays, in_band, err);
}

/* The same for splats. Their double-precision version does not report hits, so take the pixels whose colours
   differ. */
static gbt_status find_other_colours(grad_checker *c, const raster_reference *splats,
                                     const raster_settings *settings, bool *in_band, gbt_error *err)
{
    GBT_TRY(raster_reference_forward(splats, &c->frame->camera, settings, 1, c->rgb, err));
    for (size_t i = 0; i < 3 * c->ray_count; i++)
        in_band[i / 3] =
            in_band[i / 3] || !(fabs(c->rgb[i] - (double)c->frame->rgb.pixels[i]) <= colour_limit);
    return GBT_OK;
}

/* The double-precision adjoint of d_masked, by the renderer's definition. `wanted` is
   [GAUSSIANS_FIELD_COUNT][count] and must be zero. */
static gbt_status renderer_in_double(grad_checker *c, const raster_reference *splats,
                                     const raster_settings *settings, const double *d_rgb, double *wanted,
                                     gbt_error *err)
{
    if (c->frame->draw.renderer == GBT_RENDERER_RASTER)
        return raster_reference_backward(splats, &c->frame->camera, settings, d_rgb, wanted, err);
    return reference_scene_backward(&c->scene, &c->run->settings, &c->frame->rays, d_rgb, NULL, wanted, err);
}

static void print_renderer(grad_checker *c, const char *stage, const double *wanted)
{
    static const char *const names[] = {"mean", "scale", "rotation", "opacity", "colour"};
    static const size_t first[] = {REFERENCE_mean_x,  REFERENCE_scale_x, REFERENCE_quat_w,
                                   REFERENCE_opacity, REFERENCE_red,     GAUSSIANS_FIELD_COUNT};
    const float *got[GAUSSIANS_FIELD_COUNT];
    grad_fields_of(&c->d_gaussians, got);
    for (size_t class = 0; class < sizeof names / sizeof *names; class ++) {
        grad_difference d = {0};
        for (size_t f = first[class]; f < first[class + 1]; f++)
            for (size_t i = 0; i < c->scene.count; i++)
                grad_difference_add(&d, (double)got[f][i], wanted[f * c->scene.count + i]);
        grad_print_row(c, stage, names[class], grad_difference_relative(&d), renderer_limit);
    }
}

static gbt_status check_renderer(grad_checker *c, gbt_renderer renderer, const char *stage, gbt_error *err)
{
    frame *f = c->frame;
    f->draw.renderer = renderer;
    GBT_TRY(grad_render_at(c, c->view, c->width, err));
    /* As frame.c draws splats: dilated if the Gaussians have no footprint. */
    raster_settings settings = frame_splat_settings(&c->run->settings, RASTER_EWA);
    settings.dilation = f->widened ? 0 : settings.dilation;
    const raster_reference splats = {c->scene.count, c->scene.fields};
    bool *in_band = mem_calloc(c->ray_count, sizeof *in_band, "check rays", err);
    double *d_rgb = mem_alloc(c->ray_count, 3 * sizeof *d_rgb, "check gradient", err);
    double *wanted =
        mem_calloc(c->scene.count, GAUSSIANS_FIELD_COUNT * sizeof *wanted, "check gradient", err);
    size_t left_out = 0;
    gbt_status status = in_band == NULL || d_rgb == NULL || wanted == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        status = renderer == GBT_RENDERER_RASTER ? find_other_colours(c, &splats, &settings, in_band, err)
                                                 : find_band(c, in_band, err);
    for (size_t i = 0; status == GBT_OK && i < 3 * c->ray_count; i++) {
        left_out += i % 3 == 0 && in_band[i / 3];
        c->d_masked.pixels[i] = in_band[i / 3] ? 0 : c->d_image.pixels[i];
        d_rgb[i] = (double)c->d_masked.pixels[i];
    }
    if (status == GBT_OK)
        status = renderer == GBT_RENDERER_TRACE
                     ? trace_backward(&f->scene, &f->rays, &c->d_masked, &c->d_gaussians, c->weight, err)
                     : raster_backward(&f->splats, &c->d_masked, &c->d_gaussians, c->weight, err);
    if (status == GBT_OK)
        status = renderer_in_double(c, &splats, &settings, d_rgb, wanted, err);
    if (status == GBT_OK) {
        print_renderer(c, stage, wanted);
        fprintf(c->out, "%s: %zu of %zu rays are left out: rounding may change what they blend\n", stage,
                left_out, c->ray_count);
        const double most = renderer == GBT_RENDERER_RASTER ? left_out_limit_of_splats : left_out_limit;
        if ((double)left_out > most * (double)c->ray_count)
            status =
                base_fail(err, GBT_ERR_INTERNAL,
                          "check-grad: too few rays are left for the %s's gradients (%zu of %zu are left "
                          "out, wanted at most %g)",
                          stage, left_out, c->ray_count, most * (double)c->ray_count);
    }
    mem_free(in_band);
    mem_free(d_rgb);
    mem_free(wanted);
    return status;
}

gbt_status grad_check_renderers(grad_checker *c, gbt_renderer trained, gbt_error *err)
{
    if (raster_takes(&c->frame->camera))
        GBT_TRY(check_renderer(c, GBT_RENDERER_RASTER, "rasterizer", err));
    if (trained == GBT_RENDERER_PER_RAY)
        GBT_TRY(check_renderer(c, GBT_RENDERER_PER_RAY, "per-ray", err));
    return check_renderer(c, GBT_RENDERER_TRACE, "tracer", err);
}
