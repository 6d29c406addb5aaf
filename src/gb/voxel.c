/* SPDX-License-Identifier: Apache-2.0 */
/* gb/voxel.c -- the base spatial scale of a cloud, and Scaffold-GS's voxel centres (Lu 2024; Yang 2026, eq
   12), the baseline of the balls. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "bvh/points.h"
#include "gb/balls.h"
#include "gb/cloud.h"
#include "gb/split.h"

typedef struct row {
    float x[3];
} row;

/* x, then y, then z; -0 and 0 are equal. */
static int compare_rows(const void *a, const void *b)
{
    const float *p = ((const row *)a)->x, *q = ((const row *)b)->x;
    for (int k = 0; k < 3; k++)
        if (p[k] != q[k])
            return p[k] < q[k] ? -1 : 1;
    return 0;
}

/* Sorts the rows and keeps one of each; returns how many. */
static size_t sort_unique(row *rows, size_t count)
{
    qsort(rows, count, sizeof *rows, compare_rows);
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (i == 0 || compare_rows(&rows[i], &rows[kept - 1]) != 0)
            rows[kept++] = rows[i];
    return kept;
}

/* Fills value[0 .. count) for count >= 2 points. */
static gbt_status measure(const float *position, size_t count, gbt_voxel_rule rule, double *value,
                          gbt_error *err)
{
    const size_t wanted = rule == GBT_VOXEL_RULE_SQUARED ? 3 : 1;
    point_tree *tree = NULL;
    uint32_t *index = mem_alloc(count, wanted * sizeof *index, "voxel size.nearest", err);
    double *squared = mem_alloc(count, wanted * sizeof *squared, "voxel size.nearest", err);
    gbt_status status = index == NULL || squared == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        status = point_tree_build(number_floats(position), (number_array){0}, count, &tree, err);
    if (status == GBT_OK)
        status =
            point_tree_nearest_all(tree, number_floats(position), count, wanted, true, index, squared, err);
    for (size_t i = 0; i < count && status == GBT_OK; i++) {
        double sum = 0;
        size_t found = 0; /* at least one: there are 2 points; fewer than 4 points have fewer than 3 */
        for (size_t k = 0; k < wanted && index[wanted * i + k] != UINT32_MAX; k++, found++)
            sum += squared[wanted * i + k];
        value[i] = rule == GBT_VOXEL_RULE_SQUARED ? sum / (double)found : sqrt(sum);
    }
    point_tree_free(tree);
    mem_free(index);
    mem_free(squared);
    return status;
}

/* Lower median: rank (n - 1) / 2. The reference code takes the k-th smallest, k = floor(n / 2) from 1: one
   rank lower when n is odd. */
static double median_of(double *values, size_t count, gbt_voxel_rule rule)
{
    size_t rank = (count - 1) / 2;
    if (rule == GBT_VOXEL_RULE_SQUARED)
        rank = count >= 2 ? count / 2 - 1 : 0;
    return split_select(values, count, rank);
}

static size_t keep_positive(double *values, size_t count)
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (values[i] > 0)
            values[kept++] = values[i];
    return kept;
}

gbt_status balls_voxel_size(const float *position, size_t count, gbt_voxel_rule rule, float *out,
                            gbt_error *err)
{
    *out = 1.0f;
    GBT_TRY(cloud_check("voxel size", position, NULL, count, err));
    if (rule != GBT_VOXEL_RULE_MEDIAN && rule != GBT_VOXEL_RULE_SQUARED)
        return base_fail(err, GBT_ERR_ARGUMENT, "voxel size: unknown rule %d", (int)rule);

    if (count < 2)
        return GBT_OK;
    row *rows = NULL;
    double *value = mem_alloc(count, sizeof *value, "voxel size.value", err);
    if (value == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = measure(position, count, rule, value, err);
    if (status != GBT_OK)
        goto done;
    double median = median_of(value, count, rule);
    if (median <= 0) {
        const size_t positive = keep_positive(value, count);
        median = positive > 0 ? median_of(value, positive, rule) : 0;
    }
    if (median <= 0) { /* every point has copies enough to be its neighbours: measure between the distinct
                          points */
        if ((rows = mem_alloc(count, sizeof *rows, "voxel size.rows", err)) == NULL) {
            status = GBT_ERR_NO_MEMORY;
            goto done;
        }
        memcpy(rows, position, count * sizeof *rows);
        const size_t distinct = sort_unique(rows, count);
        if (distinct < 2)
            goto done;
        if ((status = measure((const float *)rows, distinct, rule, value, err)) != GBT_OK)
            goto done;
        median = median_of(value, distinct, rule);
    }
    /* Squares may leave the range of float: the promise is only a positive, finite scale. */
    *out = (float)fmin(fmax(median, (double)FLT_TRUE_MIN), (double)FLT_MAX);
done:
    mem_free(rows);
    mem_free(value);
    return status;
}

gbt_status voxel_centers(const float *position, size_t count, float voxel_size, float **centers,
                         size_t *out_count, gbt_error *err)
{
    *centers = NULL;
    *out_count = 0;
    if (!(voxel_size > 0.0f) || !isfinite(voxel_size))
        return base_fail(err, GBT_ERR_ARGUMENT, "voxel centers: bad voxel_size (wanted > 0, got %g)",
                         (double)voxel_size);
    GBT_TRY(cloud_check("voxel centers", position, NULL, count, err));
    row *cells = mem_alloc(count, sizeof *cells, "voxel centers.cells", err);
    if (cells == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            /* Cells stay floats, as in the reference: no integer overflow, and far cells merge as far floats
               do. */
            const float cell = rintf(position[3 * i + k] / voxel_size);
            if (!isfinite(cell * voxel_size)) {
                mem_free(cells);
                return base_fail(
                    err, GBT_ERR_ARGUMENT,
                    "voxel centers: point %zu is out of range (got coordinate %g in cells of %g)", i,
                    (double)position[3 * i + k], (double)voxel_size);
            }
            cells[i].x[k] = cell + 0.0f; /* -0 becomes 0 */
        }
    const size_t distinct = sort_unique(cells, count);
    for (size_t i = 0; i < distinct; i++)
        for (int k = 0; k < 3; k++)
            cells[i].x[k] *= voxel_size;
    *centers = (float *)cells;
    *out_count = distinct;
    return GBT_OK;
}
