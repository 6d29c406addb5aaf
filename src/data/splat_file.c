/* SPDX-License-Identifier: Apache-2.0 */
/* data/splat_file.c -- reads and writes .splat: rows of { f32 x y z; f32 scale[3]; u8 r g b a; u8 quaternion
   w x y z as 128 + 128 q }. */
#include <math.h>
#include <stdlib.h>

#include "data/gaussian_formats.h"

enum { ROW_BYTES = 32 };

static void read_row(cursor *c, gaussian_cloud *out)
{
    gaussian_row row = {0};
    for (size_t k = 0; k < 3; k++)
        row.mean[k] = (double)cursor_f32(c);
    for (size_t k = 0; k < 3; k++)
        row.scale_log[k] = log((double)cursor_f32(c)); /* 0: flat; below 0: NaN, which drops the row */
    for (size_t k = 0; k < 3; k++)
        row.sh[0][k] = ((double)cursor_uint(c, 1) / 255 - 0.5) / GAUSSIAN_SH_0;
    row.opacity = (double)cursor_uint(c, 1) / 255;
    for (size_t k = 0; k < 4; k++)
        row.quat[k] = ((double)cursor_uint(c, 1) - 128) / 128;
    gaussian_cloud_add(out, &row);
}

/*
 * Read a .splat with the rules of gaussian_cloud_add().
 *
 * @param out [out] sh_degree 0; free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT (not a multiple of 32 bytes, no usable Gaussian); GBT_ERR_NO_MEMORY
 */
static gbt_status read_splat(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (file->size == 0 || file->size % ROW_BYTES != 0)
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: not a .splat file (wanted a multiple of %d bytes, got %zu)", file->name,
                         (int)ROW_BYTES, file->size);
    const size_t rows = file->size / ROW_BYTES;
    GBT_TRY(gaussian_cloud_alloc(out, rows, err));
    out->count = 0;
    cursor c = {.file = file};
    for (size_t i = 0; i < rows; i++)
        read_row(&c, out);
    if (out->count > 0)
        return GBT_OK;
    gaussian_cloud_free(out);
    return base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable Gaussian (%zu rows dropped)", file->name,
                     rows);
}

typedef struct ranked {
    float weight;
    uint32_t row;
} ranked;

static int by_weight(const void *a, const void *b)
{
    const ranked *x = a, *y = b;
    if (x->weight > y->weight || x->weight < y->weight)
        return x->weight > y->weight ? -1 : 1;
    return (x->row > y->row) - (x->row < y->row);
}

static void put_row(sink *s, const gaussian_cloud *cloud, size_t i, const double origin[3])
{
    for (size_t k = 0; k < 3; k++)
        sink_put_f32(s, (float)((double)cloud->mean[3 * i + k] + origin[k]));
    for (size_t k = 0; k < 3; k++)
        sink_put_f32(s, expf(cloud->scale_log[3 * i + k]));
    for (size_t k = 0; k < 3; k++)
        sink_put_level(s, 255 * (0.5 + GAUSSIAN_SH_0 * (double)cloud->sh[i * GAUSSIAN_SH_COUNT * 3 + k]));
    sink_put_level(s, 255 * (double)cloud->opacity[i]);
    for (size_t k = 0; k < 4; k++)
        sink_put_level(s, 128 + 128 * (double)cloud->quat[4 * i + k]);
}

/*
 * Write a .splat, Gaussians with the most opacity times volume first, because viewers draw what has arrived
 * so far. Only degree 0 of the spherical harmonics is kept. `origin` is added to every mean in double.
 */
static gbt_status write_splat(const char *path, const gaussian_cloud *cloud, const double origin[3],
                              gbt_error *err)
{
    ranked *order = mem_alloc(cloud->count, sizeof *order, "order of splats", err);
    if (order == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < cloud->count; i++) {
        const float *l = cloud->scale_log + 3 * i;
        order[i] = (ranked){.weight = l[0] + l[1] + l[2] + logf(fmaxf(cloud->opacity[i], 1e-9f)),
                            .row = (uint32_t)i};
    }
    qsort(order, cloud->count, sizeof *order, by_weight);
    sink s = {.err = err};
    for (size_t i = 0; i < cloud->count && s.status == GBT_OK; i++)
        put_row(&s, cloud, order[i].row, origin);
    mem_free(order);
    return sink_write(&s, path);
}

const gaussian_format gaussian_format_splat = {.ending = ".splat",
                                               .what = "32 bytes per Gaussian, one colour for all directions",
                                               .degree = 0,
                                               .read = read_splat,
                                               .write = write_splat};
