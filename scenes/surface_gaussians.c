/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/surface_gaussians.c -- samples points on triangles, takes their colours, and writes them as
   Gaussians, batch by batch. */
#include "scenes/surface_gaussians.h"

#include <math.h>
#include <stdio.h>

#include "base/large_file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "data/bytes.h"

enum { BLOCK = 512, BATCH = 64 /* blocks written together */, REST = 45 };
enum { STREAM_PLACE = 1 << 25, STREAM_REST = 1 << 26 };

static const float sky_share = 0.01f; /* density on the sky relative to that on other surfaces */
static const double sh_0 = 0.28209479177387814;

typedef struct spread {
    const world *w;
    double *cumulative_weight; /* [triangle_count] */
    size_t count, first;
    uint64_t seed;
    sink *rows; /* [BATCH] */
} spread;

static void corner(const world *w, size_t triangle, int k, float out[3])
{
    memcpy(out, w->position + 3 * (size_t)w->triangle[3 * triangle + (size_t)k], 3 * sizeof *out);
}

static bool shines(const world *w, size_t triangle)
{
    surface s = {.normal = {0, 0, 1}, .material = w->material[triangle], .variant = w->variant[triangle]};
    look l = {.shininess = 1};
    corner(w, triangle, 0, s.position);
    w->look(&s, &l);
    return l.emission[0] + l.emission[1] + l.emission[2] > 0;
}

static void weigh_triangles(spread *s)
{
    double sum = 0;
    for (size_t i = 0; i < s->w->triangle_count; i++) {
        float p[3][3];
        double a[3], b[3], n[3];
        for (int k = 0; k < 3; k++)
            corner(s->w, i, k, p[k]);
        for (int k = 0; k < 3; k++) {
            a[k] = (double)p[1][k] - (double)p[0][k];
            b[k] = (double)p[2][k] - (double)p[0][k];
        }
        for (int k = 0; k < 3; k++)
            n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        const double area = 0.5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        sum += area * (shines(s->w, i) ? (double)sky_share : 1);
        s->cumulative_weight[i] = sum;
    }
}

/* The first triangle whose cumulative weight exceeds `at`. */
static size_t triangle_at(const spread *s, double at)
{
    size_t low = 0, high = s->w->triangle_count - 1;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (s->cumulative_weight[middle] > at)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

/* A point of a triangle as a ray would see it from the front. */
static void surface_at(const world *w, size_t triangle, float u, float v, surface *out)
{
    const float weight[3] = {1 - u - v, u, v};
    memset(out, 0, sizeof *out);
    for (int k = 0; k < 3; k++) {
        const size_t vertex = w->triangle[3 * triangle + (size_t)k];
        for (size_t c = 0; c < 3; c++) {
            out->position[c] += weight[k] * w->position[3 * vertex + c];
            out->normal[c] += weight[k] * w->normal[3 * vertex + c];
            out->indirect[c] += weight[k] * w->indirect[3 * vertex + c];
        }
        for (size_t c = 0; c < 2; c++)
            out->uv[c] += weight[k] * w->uv[2 * vertex + c];
    }
    const float length = sqrtf(out->normal[0] * out->normal[0] + out->normal[1] * out->normal[1] +
                               out->normal[2] * out->normal[2]);
    for (int c = 0; c < 3; c++)
        out->geometric[c] = out->normal[c] = length > 0 ? out->normal[c] / length : c == 2;
    out->distance = 1;
    out->material = w->material[triangle];
    out->variant = w->variant[triangle];
}

static void put_row(const spread *s, size_t number, sink *out)
{
    static const float lamp_center[2] = {0, 0};
    uint32_t words[4];
    const double all = s->cumulative_weight[s->w->triangle_count - 1], share = all / (double)s->count;
    rng_philox(s->seed, STREAM_PLACE, number, words);
    const size_t triangle = triangle_at(s, share * ((double)number + (double)words[2] * 0x1p-32));
    float u = (float)(words[0] >> 8) * 0x1p-24f, v = (float)(words[1] >> 8) * 0x1p-24f, rgb[3];
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    surface at;
    surface_at(s->w, triangle, u, v, &at);
    const float *n = at.normal, dir[3] = {-n[0], -n[1], -n[2]};
    world_shade(s->w, &at, dir, lamp_center, rgb);
    for (int k = 0; k < 3; k++)
        sink_put_f32(out, at.position[k]);
    for (int k = 0; k < 3; k++)
        sink_put_f32(out, 0);
    for (int k = 0; k < 3; k++)
        sink_put_f32(out, (float)(((double)rgb[k] - 0.5) / sh_0));
    for (uint64_t k = 0; k < REST; k += 4) {
        rng_philox(s->seed, STREAM_REST + k, number, words);
        for (uint64_t i = 0; i < 4 && k + i < REST; i++)
            sink_put_f32(out, 0.04f * ((float)(words[i] >> 8) * 0x1p-24f - 0.5f));
    }
    const bool sky = shines(s->w, triangle);
    const double spacing = sqrt(share / (sky ? (double)sky_share : 1));
    sink_put_f32(out, 2.2f); /* logit of the opacity 0.9 */
    sink_put_f32(out, (float)log(0.7 * spacing));
    sink_put_f32(out, (float)log(0.7 * spacing));
    sink_put_f32(out, (float)log(0.1 * spacing));
    const float half = sqrtf(0.5f * (1 + n[2])); /* the quaternion that rotates the z axis to the normal */
    sink_put_f32(out, half > 1e-3f ? half : 0);
    sink_put_f32(out, half > 1e-3f ? -0.5f * n[1] / half : 1);
    sink_put_f32(out, half > 1e-3f ? 0.5f * n[0] / half : 0);
    sink_put_f32(out, 0);
}

static void put_block(size_t block, size_t begin, size_t end, void *context)
{
    const spread *s = context;
    s->rows[block].size = 0;
    for (size_t i = begin; i < end; i++)
        put_row(s, s->first + i, &s->rows[block]);
}

static gbt_status write_header(size_t count, large_file *file, gbt_error *err)
{
    char text[4096];
    int used =
        snprintf(text, sizeof text,
                 "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty float x\nproperty float "
                 "y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n",
                 count);
    const struct {
        const char *stem;
        int count;
    } groups[] = {{"f_dc_", 3}, {"f_rest_", REST}, {"opacity", 0}, {"scale_", 3}, {"rot_", 4}};
    for (size_t g = 0; g < sizeof groups / sizeof *groups; g++)
        for (int k = 0; k < (groups[g].count > 0 ? groups[g].count : 1); k++) {
            char number[16] = "";
            if (groups[g].count > 0)
                snprintf(number, sizeof number, "%d", k);
            used += snprintf(text + used, sizeof text - (size_t)used, "property float %s%s\n", groups[g].stem,
                             number);
        }
    used += snprintf(text + used, sizeof text - (size_t)used, "end_header\n");
    return large_file_put(file, text, (size_t)used, err);
}

static gbt_status write_rows(spread *s, large_file *file, gbt_error *err)
{
    for (s->first = 0; s->first < s->count; s->first += BLOCK * BATCH) {
        const size_t left = s->count - s->first, now = left < BLOCK * BATCH ? left : BLOCK * BATCH;
        parallel_blocks(now, BLOCK, put_block, s);
        for (size_t b = 0; b < parallel_block_count(now, BLOCK); b++) {
            if (s->rows[b].status != GBT_OK)
                return base_fail(err, s->rows[b].status, "%s: no memory for its rows", file->name);
            GBT_TRY(large_file_put(file, s->rows[b].bytes, s->rows[b].size, err));
        }
    }
    return GBT_OK;
}

gbt_status surface_gaussians_write(const world *w, const char *path, size_t count, uint64_t seed,
                                   gbt_error *err)
{
    large_file *file = mem_calloc(1, sizeof *file, "Gaussians of surfaces", err);
    spread s = {.w = w, .count = count, .seed = seed};
    s.cumulative_weight =
        mem_alloc(w->triangle_count, sizeof *s.cumulative_weight, "Gaussians of surfaces", err);
    s.rows = mem_calloc(BATCH, sizeof *s.rows, "Gaussians of surfaces", err);
    gbt_status status =
        file == NULL || s.cumulative_weight == NULL || s.rows == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK) {
        weigh_triangles(&s);
        status = large_file_create(path, file, err);
    }
    if (status == GBT_OK)
        status = write_header(count, file, err);
    if (status == GBT_OK)
        status = write_rows(&s, file, err);
    if (file != NULL) {
        const gbt_status closed = large_file_close(file, status == GBT_OK, err);
        status = status != GBT_OK ? status : closed;
    }
    for (int b = 0; b < BATCH && s.rows != NULL; b++)
        sink_free(&s.rows[b]);
    mem_free(s.rows);
    mem_free(s.cumulative_weight);
    mem_free(file);
    return status;
}
