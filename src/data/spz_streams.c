/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz_streams.c -- encodes Gaussians as the streams of .spz, and decodes them. */
#include "data/spz_streams.h"

#include <math.h>

#include "base/log.h"

enum {
    FRACTION_BITS_MAX = 16,
    COORDINATE_MAX = 8388607 /* the range of signed 24-bit integers */
};

static const double color_step = 0.15; /* byte = 255 (0.15 f_dc + 0.5) */

void spz_row_bytes(const spz_header *header, size_t out[SPZ_STREAMS])
{
    const size_t functions = (size_t)((header->degree + 1) * (header->degree + 1));
    const size_t bytes[SPZ_STREAMS] = {9, 1, 3, 3, header->version == 2 ? 3 : 4, 3 * (functions - 1)};
    memcpy(out, bytes, sizeof bytes);
}

/* ---- writing ---- */

static double scale_level(float scale_log) { return ((double)scale_log + 10) * 16; }

/* Warn about scales outside the range of .spz. Only the largest scale of a Gaussian counts: the others may be
   0 (flat) without harm. */
static void warn_of_scales(const gaussian_cloud *cloud, const char *path)
{
    size_t outside = 0;
    for (size_t i = 0; i < cloud->count; i++) {
        const float *scale = cloud->scale_log + 3 * i;
        const double level = scale_level(fmaxf(scale[0], fmaxf(scale[1], scale[2])));
        outside += level < -0.5 || level > 255.5;
    }
    if (outside > 0)
        log_warn("%s: Gaussians whose scale is clamped: %zu (.spz keeps 4.5e-5 to 379 units)", path, outside);
}

gbt_status spz_header_of(const gaussian_cloud *cloud, const double origin[3], unsigned version,
                         const char *path, spz_header *out, gbt_error *err)
{
    double largest = 0;
    for (size_t i = 0; i < 3 * cloud->count; i++)
        largest = fmax(largest, fabs((double)cloud->mean[i] + origin[i % 3]));
    if (!(largest <= COORDINATE_MAX))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: a coordinate of %g does not fit a .spz file (limit %d)",
                         path, largest, (int)COORDINATE_MAX);
    if (cloud->count > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: too many Gaussians for a .spz file", path);
    *out = (spz_header){.version = version,
                        .count = (uint32_t)cloud->count,
                        .degree = cloud->sh_degree,
                        .flags = cloud->antialiased ? SPZ_ANTIALIASED : 0};
    warn_of_scales(cloud, path);
    while (out->fraction < FRACTION_BITS_MAX && ldexp(largest, out->fraction + 1) <= COORDINATE_MAX)
        out->fraction++;
    return GBT_OK;
}

/* Smallest-three encoding: the component with the largest magnitude is made positive and dropped. 2 bits give
   its index; each of the others takes a sign and 9 bits. */
static uint32_t pack_rotation(const float wxyz[4])
{
    const float q[4] = {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
    int largest = 0;
    for (int k = 1; k < 4; k++)
        if (fabsf(q[k]) > fabsf(q[largest]))
            largest = k;
    uint32_t bits = (uint32_t)largest;
    for (int k = 0; k < 4; k++) {
        if (k == largest)
            continue;
        const double level = fmin(nearbyint(511 * fabs((double)q[k]) * sqrt(2)), 511);
        const bool negative = (q[k] < 0) != (q[largest] < 0);
        bits = bits << 10 | (uint32_t)negative << 9 | (uint32_t)level;
    }
    return bits;
}

/* Round SH coefficients to multiples of 8 levels in degree 1 and of 16 above, which compresses better. */
static unsigned harmonic_byte(float value, size_t coefficient)
{
    const int step = coefficient <= 3 ? 8 : 16;
    const double level = nearbyint(128 * (double)value) + 128;
    const int whole = level > 255 ? 255
                      : level > 0 ? (int)level
                                  : 0,
              rounded = (whole + step / 2) / step * step;
    return (unsigned)(rounded > 255 ? 255 : rounded);
}

static void put_harmonics(sink *s, const float *sh, size_t functions)
{
    for (size_t k = 1; k < functions; k++)
        for (size_t c = 0; c < 3; c++)
            sink_put_uint(s, harmonic_byte(sh[3 * k + c], k), 1);
}

void spz_put_stream(sink *s, const gaussian_cloud *cloud, const double origin[3], const spz_header *header,
                    int stream)
{
    const size_t functions = (size_t)((cloud->sh_degree + 1) * (cloud->sh_degree + 1));
    for (size_t i = 0; i < cloud->count && s->status == GBT_OK; i++) {
        const float *mean = cloud->mean + 3 * i, *scale = cloud->scale_log + 3 * i,
                    *sh = cloud->sh + i * GAUSSIAN_SH_COUNT * 3;
        for (size_t k = 0; k < 3 && stream == 0; k++)
            sink_put_uint(s, (uint64_t)(int64_t)llrint(ldexp((double)mean[k] + origin[k], header->fraction)),
                          3);
        if (stream == 1)
            sink_put_level(s, 255 * (double)cloud->opacity[i]);
        for (size_t c = 0; c < 3 && stream == 2; c++)
            sink_put_level(s, (double)sh[c] * color_step * 255 + 127.5);
        for (size_t k = 0; k < 3 && stream == 3; k++)
            sink_put_level(s, scale_level(scale[k]));
        if (stream == 4)
            sink_put_uint(s, pack_rotation(cloud->quat + 4 * i), 4);
        if (stream == 5)
            put_harmonics(s, sh, functions);
    }
}

/* ---- reading ---- */

gbt_status spz_header_check(const spz_header *header, const char *name, gbt_error *err)
{
    const int degree_max = header->version == 4 ? 4 : 3;
    if (header->count == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: holds no Gaussians", name);
    if (header->degree > degree_max)
        return base_fail(err, GBT_ERR_FORMAT, "%s: spherical harmonics of degree %d (wanted 0 to %d)", name,
                         header->degree, degree_max);
    if (header->fraction > 24)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %d fractional bits (wanted 0 to 24)", name,
                         header->fraction);
    return GBT_OK;
}

static void unpack_rotation(const unsigned char *bytes, unsigned version, float wxyz[4])
{
    float q[4] = {0, 0, 0, 0}, square = 0;
    int missing = 3;
    if (version == 2)
        for (int k = 0; k < 3; k++)
            q[k] = (float)bytes[k] / 127.5f - 1;
    else {
        const uint32_t bits = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
                              (uint32_t)bytes[3] << 24;
        missing = (int)(bits >> 30);
        for (int k = 3, shift = 0; k >= 0; k--) {
            if (k == missing)
                continue;
            const float level = (float)(bits >> shift & 511) / 511 * 0.70710678f;
            q[k] = bits >> shift & 512 ? -level : level;
            shift += 10;
        }
    }
    for (int k = 0; k < 4; k++)
        square += q[k] * q[k];
    q[missing] = sqrtf(fmaxf(0, 1 - square));
    const float norm = sqrtf(fmaxf(square, 1));
    wxyz[0] = q[3] / norm;
    for (int k = 0; k < 3; k++)
        wxyz[1 + k] = q[k] / norm;
}

gbt_status spz_unpack(const unsigned char *streams, const spz_header *header, gaussian_cloud *out,
                      gbt_error *err)
{
    const size_t n = header->count;
    size_t row[SPZ_STREAMS];
    GBT_TRY(gaussian_cloud_alloc(out, n, err));
    spz_row_bytes(header, row);
    const unsigned char *at = streams, *alpha = at + 9 * n, *color = alpha + n, *scale = color + 3 * n,
                        *rotation = scale + 3 * n, *harmonics = rotation + row[4] * n;
    out->sh_degree = header->degree < 3 ? header->degree : 3; /* higher degrees are dropped */
    out->antialiased = header->flags & SPZ_ANTIALIASED;
    for (size_t i = 0; i < 3 * n; i++) {
        const uint32_t bits =
            (uint32_t)at[3 * i] | (uint32_t)at[3 * i + 1] << 8 | (uint32_t)at[3 * i + 2] << 16;
        out->mean[i] = (float)(ldexp((double)bits - (bits & 0x800000 ? 0x1p24 : 0), -header->fraction));
        out->scale_log[i] = (float)scale[i] / 16 - 10;
    }
    memset(out->sh, 0, n * GAUSSIAN_SH_COUNT * 3 * sizeof *out->sh);
    for (size_t i = 0; i < n; i++) {
        float *sh = out->sh + i * GAUSSIAN_SH_COUNT * 3;
        out->opacity[i] = (float)alpha[i] / 255;
        for (size_t c = 0; c < 3; c++)
            sh[c] = (float)(((double)color[3 * i + c] - 127.5) / (color_step * 255));
        for (size_t k = 0; k < row[5] && k < 3 * (GAUSSIAN_SH_COUNT - 1); k++)
            sh[3 + k] = ((float)harmonics[row[5] * i + k] - 128) / 128;
        unpack_rotation(rotation + row[4] * i, header->version, out->quat + 4 * i);
        out->scales_clamped += gaussian_limit_scales(out->scale_log + 3 * i);
    }
    return GBT_OK;
}
