/* SPDX-License-Identifier: Apache-2.0 */
/* data/compressed_ply.c -- reads and writes compressed .ply files, as SuperSplat defines them.

   Gaussians are stored in chunks of 256. A chunk holds the minimum and maximum of positions, log-scales and
   colours. A Gaussian is four 32-bit words: position, rotation, log-scale, and colour with opacity; all but
   the rotation are quantized between the chunk's minimum and maximum. */
#include "data/compressed_ply.h"

#include <math.h>
#include <stdio.h>

#include "data/gaussian_order.h"
#include "data/gaussian_ply.h"

enum {
    CHUNK_ROWS = 256,
    GROUPS = 3, /* position, log-scale, colour */
    CHUNK_COLUMNS = 6 * GROUPS,
    VERTEX_COLUMNS = 4,
    REST_MAX = 3 * (GAUSSIAN_SH_COUNT - 1)
};

static const double scale_limit = 20; /* log-scales are clamped to +-20, as other programs do */
static const double rest_range = 8;   /* higher-degree SH coefficients within +-4, in 256 steps */
static const int bits[GROUPS][3] = {{11, 10, 11}, {11, 10, 11}, {8, 8, 8}}; /* highest bits first */

static const char *const chunk_names[CHUNK_COLUMNS] = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};
static const char *const vertex_names[VERTEX_COLUMNS] = {"packed_position", "packed_rotation", "packed_scale",
                                                         "packed_color"};

/* ---- packing one Gaussian ---- */

static uint32_t share(double value, double low, double high, int bit_count)
{
    const double levels = (double)((1u << bit_count) - 1);
    return high > low ? (uint32_t)nearbyint(fmin(fmax((value - low) / (high - low), 0), 1) * levels) : 0;
}

/* Smallest-three encoding: the component with the largest magnitude is made positive and dropped; 2 bits give
   its index, 10 bits each of the others. */
static uint32_t pack_rotation(const float q[4])
{
    int largest = 0;
    for (int k = 1; k < 4; k++)
        if (fabsf(q[k]) > fabsf(q[largest]))
            largest = k;
    const double sign = q[largest] < 0 ? -sqrt(0.5) : sqrt(0.5);
    uint32_t word = (uint32_t)largest;
    for (int k = 0; k < 4; k++)
        if (k != largest)
            word = word << 10 | share((double)q[k] * sign, -0.5, 0.5, 10);
    return word;
}

static void unpack_rotation(uint32_t word, double q[4])
{
    const int missing = (int)(word >> 30);
    double square = 0;
    for (int k = 3, shift = 0; k >= 0; k--) {
        if (k == missing)
            continue;
        q[k] = ((double)(word >> shift & 1023) / 1023 - 0.5) * sqrt(2);
        square += q[k] * q[k];
        shift += 10;
    }
    q[missing] = sqrt(fmax(0, 1 - square));
}

/* Unpack a position, log-scale or colour, which is quantized between the chunk's minimum and maximum. */
static void unpack_group(uint32_t word, int group, const float *chunk, double out[3])
{
    int shift = 32; /* 32 bits in all; the 8 bits below a colour are the opacity */
    for (int k = 0; k < 3; k++) {
        const int count = bits[group][k];
        shift -= count;
        const double low = (double)chunk[6 * group + k], high = (double)chunk[6 * group + 3 + k];
        out[k] =
            low + (high - low) * (double)(word >> shift & ((1u << count) - 1)) / (double)((1u << count) - 1);
    }
}

/* ---- writing ---- */

static double value_of(const gaussian_cloud *cloud, size_t i, int group, size_t k, const double origin[3])
{
    if (group == 0)
        return (double)cloud->mean[3 * i + k] + origin[k];
    if (group == 1)
        return fmin(fmax((double)cloud->scale_log[3 * i + k], -scale_limit), scale_limit);
    return 0.5 + GAUSSIAN_SH_0 * (double)cloud->sh[i * GAUSSIAN_SH_COUNT * 3 + k];
}

static void find_range(const gaussian_cloud *cloud, const uint32_t *rows, size_t count,
                       const double origin[3], float chunk[CHUNK_COLUMNS])
{
    for (int group = 0; group < GROUPS; group++)
        for (size_t k = 0; k < 3; k++) {
            double low = INFINITY, high = -(double)INFINITY;
            for (size_t i = 0; i < count; i++) {
                const double value = value_of(cloud, rows[i], group, k, origin);
                low = fmin(low, value);
                high = fmax(high, value);
            }
            chunk[6 * (size_t)group + k] = (float)low;
            chunk[6 * (size_t)group + 3 + k] = (float)high;
        }
}

static void put_row(sink *s, const gaussian_cloud *cloud, size_t i, const double origin[3],
                    const float chunk[CHUNK_COLUMNS])
{
    uint32_t words[GROUPS] = {0};
    for (int group = 0; group < GROUPS; group++)
        for (size_t k = 0; k < 3; k++)
            words[group] = words[group] << bits[group][k] |
                           share(value_of(cloud, i, group, k, origin), (double)chunk[6 * (size_t)group + k],
                                 (double)chunk[6 * (size_t)group + 3 + k], bits[group][k]);
    sink_put_uint(s, words[0], 4);
    sink_put_uint(s, pack_rotation(cloud->quat + 4 * i), 4);
    sink_put_uint(s, words[1], 4);
    sink_put_uint(s, words[2] << 8 | share((double)cloud->opacity[i], 0, 1, 8), 4);
}

static void put_names(sink *s, const char *type, const char *const *names, size_t count)
{
    char line[64];
    for (size_t k = 0; k < count; k++) {
        snprintf(line, sizeof line, "property %s %s\n", type, names[k]);
        sink_put_text(s, line);
    }
}

static void put_header(sink *s, const gaussian_cloud *cloud, size_t rest)
{
    char line[96];
    sink_put_text(s, "ply\nformat binary_little_endian 1.0\n");
    if (cloud->antialiased)
        sink_put_text(s, GAUSSIAN_PLY_MIP "\n");
    gaussian_ply_put_near(s, cloud);
    snprintf(line, sizeof line, "element chunk %zu\n", (cloud->count + CHUNK_ROWS - 1) / CHUNK_ROWS);
    sink_put_text(s, line);
    put_names(s, "float", chunk_names, CHUNK_COLUMNS);
    snprintf(line, sizeof line, "element vertex %zu\n", cloud->count);
    sink_put_text(s, line);
    put_names(s, "uint", vertex_names, VERTEX_COLUMNS);
    if (rest > 0) {
        snprintf(line, sizeof line, "element sh %zu\n", cloud->count);
        sink_put_text(s, line);
    }
    for (size_t k = 0; k < rest; k++) {
        snprintf(line, sizeof line, "property uchar f_rest_%zu\n", k);
        sink_put_text(s, line);
    }
    sink_put_text(s, "end_header\n");
}

static void put_all(sink *s, const gaussian_cloud *cloud, const uint32_t *order, const double origin[3])
{
    const size_t n = cloud->count,
                 per_channel = (size_t)((cloud->sh_degree + 1) * (cloud->sh_degree + 1)) - 1;
    float chunk[CHUNK_COLUMNS];
    put_header(s, cloud, 3 * per_channel);
    for (int pass = 0; pass < 2; pass++)
        for (size_t from = 0; from < n && s->status == GBT_OK; from += CHUNK_ROWS) {
            const size_t count = n - from < CHUNK_ROWS ? n - from : CHUNK_ROWS;
            find_range(cloud, order + from, count, origin, chunk);
            for (size_t k = 0; k < CHUNK_COLUMNS && pass == 0; k++)
                sink_put_f32(s, chunk[k]);
            for (size_t i = 0; i < count && pass == 1; i++)
                put_row(s, cloud, order[from + i], origin, chunk);
        }
    for (size_t i = 0; i < n && s->status == GBT_OK && per_channel > 0; i++)
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 1; k <= per_channel; k++) {
                const double value = (double)cloud->sh[(order[i] * GAUSSIAN_SH_COUNT + k) * 3 + c];
                sink_put_uint(s, (uint64_t)fmin(fmax(256 * (value / rest_range + 0.5), 0), 255), 1);
            }
}

gbt_status compressed_ply_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                                gbt_error *err)
{
    uint32_t *order = gaussian_order(cloud, err);
    if (order == NULL)
        return GBT_ERR_NO_MEMORY;
    sink s = {.err = err};
    put_all(&s, cloud, order, origin);
    mem_free(order);
    return sink_write(&s, path);
}

/* ---- reading ---- */

typedef struct packed {
    const source_file *file;
    float *chunks;         /* [chunk_count][CHUNK_COLUMNS] */
    uint32_t *words;       /* [count][VERTEX_COLUMNS] */
    unsigned char *rest;   /* [count][rest_count] */
    size_t at, rest_count; /* next row to fill; SH coefficients above degree 0 of a Gaussian, all channels */
    bool has_color;        /* older files have no colour range in their chunks: it is 0 to 1 */
} packed;

static void add_chunk(void *context, const double *values)
{
    packed *p = context;
    float *chunk = p->chunks + p->at++ * CHUNK_COLUMNS;
    for (size_t k = 0; k < CHUNK_COLUMNS; k++)
        chunk[k] = k < 12 || p->has_color ? (float)values[k] : k < 15 ? 0.0f : 1.0f;
}

static void add_words(void *context, const double *values)
{
    packed *p = context;
    for (size_t k = 0; k < VERTEX_COLUMNS; k++)
        p->words[p->at * VERTEX_COLUMNS + k] = (uint32_t)fmin(fmax(values[k], 0), (double)UINT32_MAX);
    p->at++;
}

static void add_rest(void *context, const double *values)
{
    packed *p = context;
    for (size_t k = 0; k < p->rest_count; k++)
        p->rest[p->at * p->rest_count + k] = (unsigned char)fmin(fmax(values[k], 0), 255);
    p->at++;
}

/* Look up columns by name. GBT_ERR_FORMAT when one is missing or is a list. */
static gbt_status find_columns(const source_file *file, const ply_header *header, int element,
                               const char *const *names, size_t count, int *columns, gbt_error *err)
{
    for (size_t k = 0; k < count; k++) {
        columns[k] = ply_find_property(header, element, names[k]);
        if (columns[k] < 0 ||
            header->properties[header->elements[element].first_property + (size_t)columns[k]].is_list)
            return base_fail(err, GBT_ERR_FORMAT, "%s: packed Gaussians have no property %s", file->name,
                             names[k]);
    }
    return GBT_OK;
}

static gbt_status read_chunks(packed *p, const ply_header *header, size_t count, gbt_error *err)
{
    const int element = ply_find_element(header, "chunk");
    const size_t wanted = (count + CHUNK_ROWS - 1) / CHUNK_ROWS;
    int columns[CHUNK_COLUMNS];
    if (element < 0 || header->elements[element].count != wanted)
        return base_fail(err, GBT_ERR_FORMAT, "%s: %zu packed Gaussians in %llu chunks (wanted %zu)",
                         p->file->name, count,
                         element < 0 ? 0 : (unsigned long long)header->elements[element].count, wanted);
    p->has_color = ply_find_property(header, element, "min_r") >= 0;
    const size_t column_count = p->has_color ? CHUNK_COLUMNS : 12;
    GBT_TRY(find_columns(p->file, header, element, chunk_names, column_count, columns, err));
    p->chunks = mem_alloc(wanted, CHUNK_COLUMNS * sizeof *p->chunks, "chunks", err);
    if (p->chunks == NULL)
        return GBT_ERR_NO_MEMORY;
    p->at = 0;
    return ply_read_rows(p->file, header, element, columns, column_count, add_chunk, p, err);
}

static gbt_status read_words(packed *p, const ply_header *header, size_t count, gbt_error *err)
{
    const int element = ply_find_element(header, "vertex");
    int columns[VERTEX_COLUMNS];
    GBT_TRY(find_columns(p->file, header, element, vertex_names, VERTEX_COLUMNS, columns, err));
    p->words = mem_alloc(count, VERTEX_COLUMNS * sizeof *p->words, "packed Gaussians", err);
    if (p->words == NULL)
        return GBT_ERR_NO_MEMORY;
    p->at = 0;
    return ply_read_rows(p->file, header, element, columns, VERTEX_COLUMNS, add_words, p, err);
}

static gbt_status read_rest(packed *p, const ply_header *header, size_t count, gbt_error *err)
{
    const int element = ply_find_element(header, "sh");
    if (element < 0)
        return GBT_OK;
    int columns[REST_MAX];
    const size_t rest = header->elements[element].property_count;
    if ((rest != 9 && rest != 24 && rest != REST_MAX) || header->elements[element].count != count)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: %llu rows of %zu harmonics (wanted %zu rows of 9, 24 or 45)", p->file->name,
                         (unsigned long long)header->elements[element].count, rest, count);
    for (size_t k = 0; k < rest; k++) {
        char name[32];
        const char *const one = name;
        snprintf(name, sizeof name, "f_rest_%zu", k);
        GBT_TRY(find_columns(p->file, header, element, &one, 1, columns + k, err));
    }
    p->rest = mem_alloc(count, rest, "packed harmonics", err);
    if (p->rest == NULL)
        return GBT_ERR_NO_MEMORY;
    p->rest_count = rest;
    p->at = 0;
    return ply_read_rows(p->file, header, element, columns, rest, add_rest, p, err);
}

/* Dequantize to the middle of the step, except that 0 and 255 give the ends of the range. */
static double rest_of(unsigned char byte)
{
    const double level = byte == 0 ? 0 : byte == 255 ? 1 : ((double)byte + 0.5) / 256;
    return (level - 0.5) * rest_range;
}

static void unpack(const packed *p, size_t i, gaussian_row *row)
{
    const uint32_t *words = p->words + i * VERTEX_COLUMNS;
    const float *chunk = p->chunks + i / CHUNK_ROWS * CHUNK_COLUMNS;
    const size_t per_channel = p->rest_count / 3;
    double color[3];
    unpack_group(words[0], 0, chunk, row->mean);
    unpack_rotation(words[1], row->quat);
    unpack_group(words[2], 1, chunk, row->scale_log);
    unpack_group(words[3], 2, chunk, color);
    row->opacity = (double)(words[3] & 255) / 255;
    for (size_t c = 0; c < 3; c++) {
        row->sh[0][c] = (color[c] - 0.5) / GAUSSIAN_SH_0;
        for (size_t k = 0; k < per_channel; k++)
            row->sh[1 + k][c] = rest_of(p->rest[i * p->rest_count + c * per_channel + k]);
    }
}

bool compressed_ply_is(const ply_header *header)
{
    const int vertex = ply_find_element(header, "vertex");
    return vertex >= 0 && ply_find_property(header, vertex, vertex_names[0]) >= 0;
}

gbt_status compressed_ply_read(const source_file *file, const ply_header *header, gaussian_cloud *out,
                               gbt_error *err)
{
    const uint64_t count = header->elements[ply_find_element(header, "vertex")].count;
    /* Every column takes at least one byte, so memory is bounded by a multiple of the file size. */
    if (count > (file->size - header->data_at) / VERTEX_COLUMNS)
        return base_fail(err, GBT_ERR_FORMAT, "%s@%zu: %llu Gaussians cannot be in the %zu bytes that follow",
                         file->name, header->data_at, (unsigned long long)count,
                         file->size - header->data_at);
    packed p = {.file = file};
    gbt_status status = read_chunks(&p, header, (size_t)count, err);
    if (status == GBT_OK)
        status = read_words(&p, header, (size_t)count, err);
    if (status == GBT_OK)
        status = read_rest(&p, header, (size_t)count, err);
    if (status == GBT_OK)
        status = gaussian_cloud_alloc(out, (size_t)count, err);
    out->count = 0; /* counts the usable rows from here on */
    out->sh_degree = p.rest_count == 45 ? 3 : p.rest_count == 24 ? 2 : p.rest_count == 9 ? 1 : 0;
    for (size_t i = 0; i < count && status == GBT_OK; i++) {
        gaussian_row row = {0};
        unpack(&p, i, &row);
        gaussian_cloud_add(out, &row);
    }
    mem_free(p.chunks);
    mem_free(p.words);
    mem_free(p.rest);
    return status;
}
