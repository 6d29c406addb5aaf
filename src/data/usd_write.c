/* SPDX-License-Identifier: Apache-2.0 */
/* data/usd_write.c -- writes Gaussians as USD text, one array after the other. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "base/file.h"
#include "data/archive.h"
#include "data/gaussian_formats.h"
#include "data/usd.h"

enum { USDZ_ALIGN = 64 };

static const double extent_sigmas = 3;

static void put(sink *s, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void put(sink *s, const char *format, ...)
{
    char text[256];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    sink_put_text(s, text);
}

/* Write an array of `count` tuples of `width` numbers. 9 digits are enough to tell any two floats apart. */
static void put_array(sink *s, const char *type_and_name, const float *values, size_t count, size_t width)
{
    put(s, "    %s = [", type_and_name);
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        put(s, "%s%s", i > 0 ? ", " : "", width > 1 ? "(" : "");
        for (size_t k = 0; k < width; k++)
            put(s, "%s%.9g", k > 0 ? ", " : "", (double)values[i * width + k]);
        sink_put_text(s, width > 1 ? ")" : "");
    }
    sink_put_text(s, "]");
}

static void put_extent(sink *s, const gaussian_cloud *cloud)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < cloud->count; i++) {
        const float *l = cloud->scale_log + 3 * i;
        const double reach = extent_sigmas * exp(fmax((double)l[0], fmax((double)l[1], (double)l[2])));
        for (size_t k = 0; k < 3; k++) {
            low[k] = fmin(low[k], (double)cloud->mean[3 * i + k] - reach);
            high[k] = fmax(high[k], (double)cloud->mean[3 * i + k] + reach);
        }
    }
    put(s, "    float3[] extent = [(%.9g, %.9g, %.9g), (%.9g, %.9g, %.9g)]\n", low[0], low[1], low[2],
        high[0], high[1], high[2]);
}

static void put_harmonics(sink *s, const gaussian_cloud *cloud)
{
    const size_t functions = (size_t)((cloud->sh_degree + 1) * (cloud->sh_degree + 1));
    put(s, "    uniform int radiance:sphericalHarmonicsDegree = %d\n", cloud->sh_degree);
    sink_put_text(s, "    float3[] radiance:sphericalHarmonicsCoefficients = [");
    for (size_t i = 0; i < cloud->count && s->status == GBT_OK; i++)
        for (size_t k = 0; k < functions; k++) {
            const float *c = cloud->sh + 3 * (GAUSSIAN_SH_COUNT * i + k);
            put(s, "%s(%.9g, %.9g, %.9g)", i + k > 0 ? ", " : "", (double)c[0], (double)c[1], (double)c[2]);
        }
    put(s, "] (\n        elementSize = %zu\n        interpolation = \"vertex\"\n    )\n", functions);
}

static gbt_status put_scales(sink *s, const gaussian_cloud *cloud, gbt_error *err)
{
    float *scales = mem_alloc(cloud->count, 3 * sizeof *scales, "scales", err);
    if (scales == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < 3 * cloud->count; i++)
        scales[i] = expf(cloud->scale_log[i]);
    put_array(s, "float3[] scales", scales, cloud->count, 3);
    mem_free(scales);
    sink_put_text(s, "\n");
    return s->status;
}

static gbt_status put_text(sink *s, const gaussian_cloud *cloud, const double origin[3], gbt_error *err)
{
    sink_put_text(s,
                  "#usda 1.0\n(\n    defaultPrim = \"Gaussians\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n"
                  ")\n\ndef ParticleField3DGaussianSplat \"Gaussians\"\n{\n");
    put_extent(s, cloud);
    put_array(s, "point3f[] positions", cloud->mean, cloud->count, 3);
    sink_put_text(s, "\n");
    put_array(s, "quatf[] orientations", cloud->quat, cloud->count, 4);
    sink_put_text(s, "\n");
    GBT_TRY(put_scales(s, cloud, err));
    put_array(s, "float[] opacities", cloud->opacity, cloud->count, 1);
    sink_put_text(s, "\n");
    put_harmonics(s, cloud);
    if (cloud->near > 0)
        put(s, "    custom float " USD_NEAR " = %.9g\n", (double)cloud->near);
    sink_put_text(s, "    uniform token projectionModeHint = \"perspective\"\n"
                     "    uniform token sortingModeHint = \"cameraDistance\"\n"
                     "    float xformOp:rotateZ = 180\n");
    put(s, "    double3 xformOp:translate = (%.17g, %.17g, %.17g)\n", origin[0], origin[1], origin[2]);
    sink_put_text(s, "    uniform token[] xformOpOrder = [\"xformOp:rotateZ\", \"xformOp:translate\"]\n}\n");
    return s->status;
}

/* Write a .usda or .usdz; `origin` becomes the prim's translation. GBT_ERR_ARGUMENT: a .usdz above 4 GiB. */
static gbt_status write_usd(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            bool packaged, gbt_error *err)
{
    sink text = {.err = err}, package = {.err = err};
    gbt_status status = put_text(&text, cloud, origin, err);
    const archive_member member = {"gaussians.usda", text.bytes, text.size};
    if (status == GBT_OK && packaged)
        status = archive_put(&package, path, &member, 1, USDZ_ALIGN, err);
    const sink *s = packaged ? &package : &text;
    if (status == GBT_OK)
        status = file_write_atomic(path, s->bytes, s->size, err);
    sink_free(&text);
    sink_free(&package);
    return status;
}

static gbt_status write_usda(const char *path, const gaussian_cloud *cloud, const double origin[3],
                             gbt_error *err)
{
    return write_usd(path, cloud, origin, false, err);
}

static gbt_status write_usdz(const char *path, const gaussian_cloud *cloud, const double origin[3],
                             gbt_error *err)
{
    return write_usd(path, cloud, origin, true, err);
}

const gaussian_format gaussian_format_usda = {
    .ending = ".usda",
    .what = "USD, ParticleField3DGaussianSplat: everything, as text; the origin in double",
    .degree = 3,
    .keeps_origin = true,
    .read = usda_read,
    .write = write_usda};

const gaussian_format gaussian_format_usdz = {.ending = ".usdz",
                                              .what = "the same text in a package of USD",
                                              .degree = 3,
                                              .keeps_origin = true,
                                              .read = usdz_read,
                                              .write = write_usdz};
