/* SPDX-License-Identifier: Apache-2.0 */
/* data/sog_read.c -- reads .sog bundles: meta.json and tables to Gaussians. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>

#include "data/archive.h"
#include "data/json_fields.h"
#include "data/palette.h"
#include "data/sog.h"
#include "data/webp.h"

enum {
    TABLES = 7,
    RATIO_MAX = 16 /* most Gaussians per byte of the file that are plausible */
};

typedef enum table_id { MEANS_LOW, MEANS_HIGH, SCALES, ROTATIONS, COLORS, CENTROIDS, LABELS } table_id;

static const struct {
    const char *key; /* in meta.json */
    size_t file;     /* index in that entry's list of files */
} table_keys[TABLES] = {{"means", 0}, {"means", 1}, {"scales", 0}, {"quats", 0},
                        {"sh0", 0},   {"shN", 0},   {"shN", 1}};

typedef struct bundle {
    const source_file *file;
    json_t *meta;
    size_t count, entries; /* Gaussians; palette entries, 0: none */
    int degree;
    double low[3], high[3]; /* range of the positions, log encoded */
    float scales[PALETTE_LEVELS], colors[PALETTE_LEVELS], harmonics[PALETTE_LEVELS];
    webp_table tables[TABLES];
} bundle;

/* ---- meta.json ---- */

static gbt_status wrong(const bundle *b, const char *what, gbt_error *err)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s: meta.json: %s", b->file->name, what);
}

/* Read the list from number `first` on; what is before it stays as it is. */
static gbt_status take_numbers(const bundle *b, const char *key, const char *field, size_t first,
                               size_t count, double *out, gbt_error *err)
{
    const json_t *list = json_object_get(json_object_get(b->meta, key), field);
    char what[80];
    snprintf(what, sizeof what, "%s.%s is no list of %zu numbers", key, field, count);
    if (json_array_size(list) != count)
        return wrong(b, what, err);
    for (size_t k = first; k < count; k++) {
        const json_t *value = json_array_get(list, k);
        if (!json_is_number(value))
            return wrong(b, what, err);
        out[k] = json_number_value(value);
    }
    return GBT_OK;
}

static gbt_status take_levels(const bundle *b, const char *key, float *out, gbt_error *err)
{
    double values[PALETTE_LEVELS];
    const json_t *list = json_object_get(json_object_get(b->meta, key), "codebook");
    /* PlayCanvas has written files whose first level is null, and reads them by this rule. */
    const bool is_null = json_is_null(json_array_get(list, 0));
    GBT_TRY(take_numbers(b, key, "codebook", is_null ? 1 : 0, PALETTE_LEVELS, values, err));
    if (is_null)
        values[0] = values[1] + (values[1] - values[PALETTE_LEVELS - 1]) / (PALETTE_LEVELS - 1);
    for (size_t k = 0; k < PALETTE_LEVELS; k++)
        out[k] = (float)values[k];
    return GBT_OK;
}

static gbt_status read_meta(bundle *b, gbt_error *err)
{
    const json_int_t version = json_integer_value(json_object_get(b->meta, "version")),
                     count = json_integer_value(json_object_get(b->meta, "count"));
    if (version != 2)
        return wrong(b, "not of version 2", err);
    if (count < 1 || (uint64_t)count / RATIO_MAX > b->file->size || count > UINT32_MAX)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %lld Gaussians cannot be in %zu bytes", b->file->name,
                         (long long)count, b->file->size);
    b->count = (size_t)count;
    GBT_TRY(take_numbers(b, "means", "mins", 0, 3, b->low, err));
    GBT_TRY(take_numbers(b, "means", "maxs", 0, 3, b->high, err));
    GBT_TRY(take_levels(b, "scales", b->scales, err));
    GBT_TRY(take_levels(b, "sh0", b->colors, err));
    const json_t *rest = json_object_get(b->meta, "shN");
    if (rest == NULL)
        return GBT_OK;
    const json_int_t entries = json_integer_value(json_object_get(rest, "count")),
                     bands = json_integer_value(json_object_get(rest, "bands"));
    if (entries < 1 || entries > SOG_PALETTE_MAX || bands < 1 || bands > 3)
        return wrong(b, "shN: wanted a count of 1 to 65536 and 1 to 3 bands", err);
    b->entries = (size_t)entries;
    b->degree = (int)bands;
    return take_levels(b, "shN", b->harmonics, err);
}

/* ---- tables ---- */

static gbt_status read_table(bundle *b, table_id id, gbt_error *err)
{
    const json_t *files = json_object_get(json_object_get(b->meta, table_keys[id].key), "files");
    const char *name = json_string_value(json_array_get(files, table_keys[id].file));
    char full[1024];
    if (name == NULL)
        return wrong(b, "a table names no file", err);
    const size_t per_entry = (size_t)((b->degree + 1) * (b->degree + 1)) - 1;
    const size_t wanted = id == CENTROIDS ? b->entries * per_entry : b->count;
    source_file inside = {.name = full};
    unsigned char *bytes;
    snprintf(full, sizeof full, "%s: %.200s", b->file->name, name);
    GBT_TRY(archive_take(b->file, name, &bytes, &inside.size, err));
    inside.bytes = bytes;
    webp_table *t = &b->tables[id];
    /* Tables are near squares, and the last row need not be full. */
    gbt_status status = webp_read(&inside, 2 * wanted + 65536, t, err);
    mem_free(bytes);
    GBT_TRY(status);
    if ((size_t)t->width * (size_t)t->height < wanted ||
        (id == CENTROIDS && (size_t)t->width != SOG_ENTRIES_PER_ROW * per_entry))
        return base_fail(err, GBT_ERR_FORMAT, "%s: %d x %d pixels do not hold %zu values", full, t->width,
                         t->height, wanted);
    return GBT_OK;
}

/* ---- Gaussians ---- */

static double position_of(const bundle *b, size_t i, size_t k)
{
    const unsigned level =
        (unsigned)b->tables[MEANS_HIGH].bytes[4 * i + k] << 8 | b->tables[MEANS_LOW].bytes[4 * i + k];
    const double value = b->low[k] + (b->high[k] - b->low[k]) * level / 65535;
    return copysign(expm1(fabs(value)), value);
}

static void rotation_of(const unsigned char *pixel, double q[4])
{
    const int missing = pixel[3] >= 252 ? pixel[3] - 252 : 0;
    double square = 0;
    for (int k = 0, from = 0; k < 4; k++) {
        if (k == missing)
            continue;
        q[k] = ((double)pixel[from++] / 255 - 0.5) * sqrt(2);
        square += q[k] * q[k];
    }
    q[missing] = sqrt(fmax(0, 1 - square));
}

static void unpack(const bundle *b, size_t i, gaussian_row *row)
{
    const unsigned char *color = b->tables[COLORS].bytes + 4 * i, *scale = b->tables[SCALES].bytes + 4 * i;
    rotation_of(b->tables[ROTATIONS].bytes + 4 * i, row->quat);
    row->opacity = (double)color[3] / 255;
    for (size_t k = 0; k < 3; k++) {
        row->mean[k] = position_of(b, i, k);
        row->scale_log[k] = (double)b->scales[scale[k]];
        row->sh[0][k] = (double)b->colors[color[k]];
    }
    if (b->entries == 0)
        return;
    const size_t functions = (size_t)((b->degree + 1) * (b->degree + 1)) - 1;
    const unsigned char *label = b->tables[LABELS].bytes + 4 * i;
    const size_t entry = (size_t)label[0] | (size_t)label[1] << 8;
    if (entry >= b->entries)
        row->opacity = NAN; /* not usable: gaussian_cloud_add() counts and drops it */
    for (size_t k = 0; k < functions && entry < b->entries; k++)
        for (size_t c = 0; c < 3; c++)
            row->sh[1 + k][c] =
                (double)b->harmonics[b->tables[CENTROIDS].bytes[4 * (entry * functions + k) + c]];
}

static gbt_status read_all(bundle *b, gaussian_cloud *out, gbt_error *err)
{
    GBT_TRY(read_meta(b, err));
    for (int id = 0; id < (b->entries > 0 ? TABLES : (int)CENTROIDS); id++)
        GBT_TRY(read_table(b, (table_id)id, err));
    GBT_TRY(gaussian_cloud_alloc(out, b->count, err));
    out->count = 0; /* counts the usable rows from here on */
    out->sh_degree = b->degree;
    const char *model = json_string_value(json_object_get(b->meta, "model"));
    out->antialiased = json_is_true(json_object_get(b->meta, "antialias")) ||
                       (model != NULL && strcmp(model, "antialiased") == 0);
    const json_t *near = json_object_get(json_object_get(b->meta, "asset"), SOG_NEAR);
    out->near = gaussian_cloud_near(json_number_value(near));
    for (size_t i = 0; i < b->count; i++) {
        gaussian_row row = {0};
        unpack(b, i, &row);
        gaussian_cloud_add(out, &row);
    }
    return out->count > 0 ? GBT_OK
                          : base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable Gaussian (%zu dropped)",
                                      b->file->name, out->dropped);
}

gbt_status sog_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    bundle b = {.file = file};
    unsigned char *text;
    size_t size;
    memset(out, 0, sizeof *out);
    GBT_TRY(archive_take(file, "meta.json", &text, &size, err));
    char name[JSON_PATH_SIZE];
    snprintf(name, sizeof name, "%s: meta.json", file->name);
    gbt_status status = json_read_text((const char *)text, size, name, &b.meta, err);
    mem_free(text);
    if (status == GBT_OK)
        status = read_all(&b, out, err);
    for (int id = 0; id < TABLES; id++)
        mem_free(b.tables[id].bytes);
    json_decref(b.meta);
    if (status != GBT_OK)
        gaussian_cloud_free(out);
    return status;
}
