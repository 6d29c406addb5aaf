/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_reference.c -- render some pixels in double precision, and measure the error of other
   pictures against them. */
#include "benchmark/bench_reference.h"

#include <math.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "trace/rounding_band.h"

enum { CHECK_STRIDE = 8 };

/* The pixel of the whole picture to which ray `i` of the subset belongs. */
static size_t pixel_of(const ray_image *few, int width, size_t i)
{
    return i / (size_t)few->width * CHECK_STRIDE * (size_t)width + i % (size_t)few->width * CHECK_STRIDE;
}

trace_settings bench_settings_without_cuts(const trace_settings *settings)
{
    trace_settings s = *settings;
    s.alpha_min = 1e-12f; /* a million responses below this change a colour by 1e-6 */
    s.transmittance_min = 0;
    return s;
}

gbt_status bench_reference_make(const gaussians *g, const trace_settings *settings, const ray_image *rays,
                                bench_reference *out, gbt_error *err)
{
    ray_image *few = &out->rays;
    GBT_TRY(ray_image_reserve(few, (rays->width + CHECK_STRIDE - 1) / CHECK_STRIDE,
                              (rays->height + CHECK_STRIDE - 1) / CHECK_STRIDE, false, err));
    const size_t count = ray_image_count(few);
    for (size_t i = 0; i < count; i++) {
        const size_t from = pixel_of(few, rays->width, i);
        memcpy(few->dir + 3 * i, rays->dir + 3 * from, 3 * sizeof *few->dir);
        memcpy(few->origin + 3 * i, ray_image_origin(rays, from), 3 * sizeof *few->origin);
    }
    mem_free(out->rgb);
    out->rgb = mem_alloc(count, 3 * sizeof *out->rgb, "check image", err);
    return out->rgb == NULL ? GBT_ERR_NO_MEMORY
                            : reference_forward(g, settings, few, out->rgb, NULL, NULL, err);
}

gbt_status bench_reference_leave_band(const gaussians *g, const trace_settings *settings,
                                      bench_reference *reference, gbt_error *err)
{
    const size_t count = ray_image_count(&reference->rays);
    reference_scene exact = {0};
    mem_free(reference->left_out);
    reference->left_out = mem_alloc(count, sizeof *reference->left_out, "rounding band", err);
    if (reference->left_out == NULL)
        return GBT_ERR_NO_MEMORY;
    memset(reference->left_out, true, count);
    gbt_status status = reference_scene_make(g, &exact, err);
    if (status == GBT_OK)
        status = rounding_band_find(&exact, settings, &reference->rays, reference->left_out, err);
    reference_scene_free(&exact);
    return status;
}

void bench_reference_free(bench_reference *reference)
{
    mem_free(reference->left_out);
    reference->left_out = NULL;
    ray_image_free(&reference->rays);
    mem_free(reference->rgb);
    reference->rgb = NULL;
}

static void add_error(bench_error *sum, double error)
{
    sum->psnr += error * error; /* holds the sum of squares until bench_error_of() */
    sum->max = larger_or_nan(sum->max, fabs(error));
}

bench_error bench_error_of(double square_sum, double max, size_t values)
{
    const double psnr = square_sum > 0      ? fmin(-10 * log10(square_sum / (double)values), 200)
                        : isnan(square_sum) ? square_sum
                                            : 200;
    return (bench_error){.psnr = psnr, .max = max};
}

bench_error bench_reference_compare(const bench_reference *reference, const image *rgb)
{
    bench_error sum = {0, 0};
    const size_t count = ray_image_count(&reference->rays);
    size_t values = 0;
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 3 && (reference->left_out == NULL || !reference->left_out[i]); c++, values++)
            add_error(&sum, (double)rgb->pixels[3 * pixel_of(&reference->rays, rgb->width, i) + c] -
                                reference->rgb[3 * i + c]);
    return bench_error_of(sum.psnr, sum.max, values);
}
