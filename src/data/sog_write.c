/* SPDX-License-Identifier: Apache-2.0 */
/* data/sog_write.c -- writes .sog bundles: positions log encoded in 16 bits, scales and colours by 256
   levels, SH coefficients above degree 0 by a palette. */
#include <jansson.h>
#include <math.h>
#include <stdlib.h>

#include "base/file.h"
#include "data/archive.h"
#include "data/gaussian_formats.h"
#include "data/gaussian_order.h"
#include "data/palette.h"
#include "data/sog.h"
#include "data/webp.h"

/* GAUSSIANS_PER_ENTRY: for each palette entry, within 1,024 to SOG_PALETTE_MAX entries. */
enum { FILES_MAX = 8, GAUSSIANS_PER_ENTRY = 4 };

typedef struct writing {
    const gaussian_cloud *cloud;
    const double *origin;
    uint32_t *order;
    webp_table table; /* the one being filled */
    json_t *meta;
    sink files[FILES_MAX];
    const char *names[FILES_MAX];
    int count;
    gbt_error *err;
} writing;

/* ---- tables ---- */

static gbt_status open_table(webp_table *t, size_t width, size_t height, gbt_error *err)
{
    *t = (webp_table){.width = (int)width, .height = (int)height};
    t->bytes = mem_alloc(width * height, 4, "a table", err);
    if (t->bytes == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < 4 * width * height; i++)
        t->bytes[i] = i % 4 == 3 ? 255 : 0;
    return GBT_OK;
}

/* Start a table with a pixel for each Gaussian, close to a square. */
static gbt_status open_pixels(writing *w)
{
    const size_t n = w->cloud->count, width = (size_t)ceil(sqrt((double)n) / 4) * 4;
    return open_table(&w->table, width, (n + width - 1) / width, w->err);
}

static gbt_status close_table(writing *w, const char *name)
{
    sink *s = &w->files[w->count];
    s->err = w->err;
    w->names[w->count++] = name;
    const gbt_status status = webp_put(s, &w->table, w->err);
    mem_free(w->table.bytes);
    w->table.bytes = NULL;
    return status;
}

static unsigned char *pixel(const writing *w, size_t i) { return w->table.bytes + 4 * i; }

static json_t *numbers(const float *values, size_t count)
{
    json_t *list = json_array();
    for (size_t k = 0; k < count; k++)
        json_array_append_new(list, json_real((double)values[k]));
    return list;
}

/* ---- positions ---- */

static double log_of(const writing *w, size_t i, size_t k)
{
    const double x = (double)w->cloud->mean[3 * (size_t)w->order[i] + k] + w->origin[k];
    return copysign(log1p(fabs(x)), x);
}

static gbt_status put_positions(writing *w)
{
    const size_t n = w->cloud->count;
    double low[3], high[3];
    for (size_t k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -(double)INFINITY;
        for (size_t i = 0; i < n; i++) {
            low[k] = fmin(low[k], log_of(w, i, k));
            high[k] = fmax(high[k], log_of(w, i, k));
        }
    }
    for (int part = 0; part < 2; part++) {
        GBT_TRY(open_pixels(w));
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < 3; k++) {
                const double place = high[k] > low[k] ? (log_of(w, i, k) - low[k]) / (high[k] - low[k]) : 0;
                pixel(w, i)[k] = (unsigned char)((unsigned)nearbyint(65535 * place) >> 8 * part & 255);
            }
        GBT_TRY(close_table(w, part == 0 ? "means_l.webp" : "means_u.webp"));
    }
    json_object_set_new(w->meta, "means",
                        json_pack("{s:[f,f,f],s:[f,f,f],s:[s,s]}", "mins", low[0], low[1], low[2], "maxs",
                                  high[0], high[1], high[2], "files", "means_l.webp", "means_u.webp"));
    return GBT_OK;
}

/* ---- rotations ---- */

/* Smallest-three encoding: of w x y z the component largest in magnitude is made positive and dropped. */
static gbt_status put_rotations(writing *w)
{
    GBT_TRY(open_pixels(w));
    for (size_t i = 0; i < w->cloud->count; i++) {
        const float *q = w->cloud->quat + 4 * (size_t)w->order[i];
        int largest = 0, to = 0;
        for (int k = 1; k < 4; k++)
            largest = fabsf(q[k]) > fabsf(q[largest]) ? k : largest;
        const double sign = q[largest] < 0 ? -sqrt(0.5) : sqrt(0.5);
        for (int k = 0; k < 4; k++)
            if (k != largest)
                pixel(w, i)[to++] =
                    (unsigned char)nearbyint(255 * fmin(fmax((double)q[k] * sign + 0.5, 0), 1));
        pixel(w, i)[3] = (unsigned char)(252 + largest);
    }
    json_object_set_new(w->meta, "quats", json_pack("{s:[s]}", "files", "quats.webp"));
    return close_table(w, "quats.webp");
}

/* ---- scales and colours ---- */

/* Quantize three numbers per Gaussian with 256 levels common to all of them. */
static gbt_status put_levels(writing *w, const float *values, size_t stride, bool with_opacity,
                             const char *key, const char *file)
{
    const size_t n = w->cloud->count;
    float levels[PALETTE_LEVELS];
    float *all = mem_alloc(3 * n, sizeof *all, "levels", w->err);
    if (all == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < 3 * n; i++)
        all[i] = values[i / 3 * stride + i % 3];
    gbt_status status = palette_scalar_levels(all, 3 * n, levels, w->err);
    if (status == GBT_OK)
        status = open_pixels(w);
    for (size_t i = 0; i < n && status == GBT_OK; i++) {
        const size_t row = w->order[i];
        for (size_t k = 0; k < 3; k++)
            pixel(w, i)[k] = palette_nearest(levels, all[3 * row + k]);
        if (with_opacity)
            pixel(w, i)[3] = (unsigned char)nearbyint(255 * (double)w->cloud->opacity[row]);
    }
    mem_free(all);
    GBT_TRY(status);
    json_object_set_new(w->meta, key,
                        json_pack("{s:o,s:[s]}", "codebook", numbers(levels, PALETTE_LEVELS), "files", file));
    return close_table(w, file);
}

/* ---- SH coefficients above degree 0 ---- */

static gbt_status put_palette(writing *w, const palette *p, size_t functions)
{
    float levels[PALETTE_LEVELS];
    GBT_TRY(palette_scalar_levels(p->entries, p->count * p->width, levels, w->err));
    GBT_TRY(open_table(&w->table, SOG_ENTRIES_PER_ROW * functions,
                       (p->count + SOG_ENTRIES_PER_ROW - 1) / SOG_ENTRIES_PER_ROW, w->err));
    for (size_t i = 0; i < p->count * p->width; i++)
        pixel(w, i / 3)[i % 3] = palette_nearest(levels, p->entries[i]);
    GBT_TRY(close_table(w, "shN_centroids.webp"));
    GBT_TRY(open_pixels(w));
    for (size_t i = 0; i < w->cloud->count; i++) {
        const uint32_t label = p->labels[w->order[i]];
        pixel(w, i)[0] = (unsigned char)(label & 255);
        pixel(w, i)[1] = (unsigned char)(label >> 8);
    }
    json_object_set_new(w->meta, "shN",
                        json_pack("{s:I,s:i,s:o,s:[s,s]}", "count", (json_int_t)p->count, "bands",
                                  w->cloud->sh_degree, "codebook", numbers(levels, PALETTE_LEVELS), "files",
                                  "shN_centroids.webp", "shN_labels.webp"));
    return close_table(w, "shN_labels.webp");
}

static gbt_status put_harmonics(writing *w)
{
    const size_t n = w->cloud->count,
                 functions = (size_t)((w->cloud->sh_degree + 1) * (w->cloud->sh_degree + 1)) - 1;
    if (functions == 0)
        return GBT_OK;
    float *vectors = mem_alloc(n, 3 * functions * sizeof *vectors, "harmonics", w->err);
    if (vectors == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < n; i++)
        memcpy(vectors + 3 * functions * i, w->cloud->sh + 3 * (GAUSSIAN_SH_COUNT * i + 1),
               3 * functions * sizeof *vectors);
    const size_t share = n / GAUSSIANS_PER_ENTRY, limit = share < 1024              ? 1024
                                                          : share > SOG_PALETTE_MAX ? SOG_PALETTE_MAX
                                                                                    : share;
    palette p;
    gbt_status status = palette_make(vectors, n, 3 * functions, limit, &p, w->err);
    mem_free(vectors);
    if (status == GBT_OK) {
        status = put_palette(w, &p, functions);
        palette_free(&p);
    }
    return status;
}

/* ---- the bundle ---- */

static gbt_status put_tables(writing *w)
{
    const gaussian_cloud *cloud = w->cloud;
    w->order = gaussian_order(cloud, w->err);
    if (w->order == NULL)
        return GBT_ERR_NO_MEMORY;
    w->meta = json_pack("{s:i,s:{s:s},s:I,s:b}", "version", 2, "asset", "generator", "gbtrace", "count",
                        (json_int_t)cloud->count, "antialias", (int)cloud->antialiased);
    if (cloud->antialiased)
        json_object_set_new(w->meta, "model", json_string("antialiased"));
    if (cloud->near > 0)
        json_object_set_new(json_object_get(w->meta, "asset"), SOG_NEAR, json_real((double)cloud->near));
    GBT_TRY(put_positions(w));
    GBT_TRY(put_rotations(w));
    GBT_TRY(put_levels(w, cloud->scale_log, 3, false, "scales", "scales.webp"));
    GBT_TRY(put_levels(w, cloud->sh, 3 * GAUSSIAN_SH_COUNT, true, "sh0", "sh0.webp"));
    return put_harmonics(w);
}

static gbt_status write_bundle(const writing *w, const char *path)
{
    char *json = json_dumps(w->meta, JSON_COMPACT | JSON_REAL_PRECISION(9));
    if (json == NULL)
        return base_fail(w->err, GBT_ERR_NO_MEMORY, "%s: no memory", path);
    archive_member members[FILES_MAX + 1] = {{"meta.json", json, strlen(json)}};
    for (int i = 0; i < w->count; i++)
        members[1 + i] = (archive_member){w->names[i], w->files[i].bytes, w->files[i].size};
    sink s = {.err = w->err};
    gbt_status status = archive_put(&s, path, members, (size_t)w->count + 1, 1, w->err);
    if (status == GBT_OK)
        status = file_write_atomic(path, s.bytes, s.size, w->err);
    sink_free(&s);
    free(json);
    return status;
}

/*
 * Write a .sog. The bytes depend on the version of libwebp, the values do not.
 *
 * @param origin [in] added to every mean in double
 */
static gbt_status write_sog(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            gbt_error *err)
{
    writing w = {.cloud = cloud, .origin = origin, .err = err};
    gbt_status status = put_tables(&w);
    if (status == GBT_OK)
        status = write_bundle(&w, path);
    for (int i = 0; i < w.count; i++)
        sink_free(&w.files[i]);
    mem_free(w.table.bytes);
    mem_free(w.order);
    json_decref(w.meta);
    return status;
}

const gaussian_format gaussian_format_sog = {
    .ending = ".sog",
    .what = "a tenth of a .ply: positions in 16 bits, harmonics by a palette",
    .degree = 3,
    .read = sog_read,
    .write = write_sog};
