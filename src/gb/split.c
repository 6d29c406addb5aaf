/* SPDX-License-Identifier: Apache-2.0 */
/* gb/split.c -- cut a set of points in two at the median along its principal axis (Yang 2026, eqs 24-27). */
#include "gb/split.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "base/compare.h"
#include "base/parallel.h"
#include "base/symmetric.h"

enum { KEY_BLOCK = 8192 };

void split_axes(const double covariance[6], double axes[3][3])
{
    double largest = 0;
    for (int k = 0; k < 6; k++)
        largest = fmax(largest, fabs(covariance[k]));
    /* Scaled to avoid overflow and underflow for any unit of length. */
    const double unit = largest > 0 ? largest : 1;
    const double xx = covariance[0] / unit, xy = covariance[1] / unit, xz = covariance[2] / unit;
    const double yy = covariance[3] / unit, yz = covariance[4] / unit, zz = covariance[5] / unit;
    double a[3][3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}, v[3][3];
    symmetric_eigen(&a[0][0], &v[0][0], 3, 1e-18);
    int order[3] = {0, 1, 2};
    for (int i = 1; i < 3; i++)
        for (int j = i; j > 0 && a[order[j]][order[j]] > a[order[j - 1]][order[j - 1]]; j--) {
            const int keep = order[j];
            order[j] = order[j - 1];
            order[j - 1] = keep;
        }
    for (int i = 0; i < 3; i++) {
        double *axis = axes[i];
        for (int k = 0; k < 3; k++)
            axis[k] = v[k][order[i]];
        const double tied = (1 - 1e-9) * fmax(fabs(axis[0]), fmax(fabs(axis[1]), fabs(axis[2])));
        int decides = 0;
        while (fabs(axis[decides]) < tied)
            decides++;
        if (axis[decides] < 0) {
            axis[0] = -axis[0];
            axis[1] = -axis[1];
            axis[2] = -axis[2];
        }
    }
}

static double median3(double a, double b, double c)
{
    return a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
}

/* Median of 3; for large ranges, where a bad pivot is costly, the median of 3 medians of 3. */
static double choose_pivot(const double *keys, ptrdiff_t low, ptrdiff_t high)
{
    const ptrdiff_t n = high - low, middle = low + n / 2;
    if (n < 256)
        return median3(keys[low], keys[middle], keys[high]);
    const ptrdiff_t step = n / 8;
    return median3(median3(keys[low], keys[low + step], keys[low + 2 * step]),
                   median3(keys[middle - step], keys[middle], keys[middle + step]),
                   median3(keys[high - 2 * step], keys[high - step], keys[high]));
}

double split_select(double *keys, size_t count, size_t rank)
{
    ptrdiff_t low = 0, high = (ptrdiff_t)count - 1;
    const ptrdiff_t wanted = (ptrdiff_t)rank;
    int rounds = 0;
    while (high - low > 12) {
        /* Good pivots halve the range. An input made to defeat them is sorted instead, so the worst case is
           O(n log n). */
        if (++rounds > 96) {
            qsort(keys + low, (size_t)(high - low + 1), sizeof *keys, compare_doubles);
            return keys[wanted];
        }
        const double pivot = choose_pivot(keys, low, high);
        ptrdiff_t i = low, j = high;
        while (i <= j) { /* both scans stop at keys equal to the pivot: all-equal keys halve too */
            while (keys[i] < pivot)
                i++;
            while (keys[j] > pivot)
                j--;
            if (i <= j) {
                const double keep = keys[i];
                keys[i++] = keys[j];
                keys[j--] = keep;
            }
        }
        if (wanted <= j)
            high = j;
        else if (wanted >= i)
            low = i;
        else
            return keys[wanted];
    }
    for (ptrdiff_t i = low + 1; i <= high; i++) {
        const double key = keys[i];
        ptrdiff_t j = i;
        for (; j > low && keys[j - 1] > key; j--)
            keys[j] = keys[j - 1];
        keys[j] = key;
    }
    return keys[wanted];
}

typedef struct projection {
    const cloud_point *points;
    double *keys;
    double mean[3], axis[3];
} projection;

/* z of eq 25. It is evaluated twice per point and must have the same bits: no contraction, fixed order. */
static inline double project(const projection *p, const cloud_point *point)
{
    return ((double)point->position[0] - p->mean[0]) * p->axis[0] +
           ((double)point->position[1] - p->mean[1]) * p->axis[1] +
           ((double)point->position[2] - p->mean[2]) * p->axis[2];
}

static void fill_keys(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const projection *p = context;
    for (size_t i = begin; i < end; i++)
        p->keys[i] = project(p, &p->points[i]);
}

/* Move points with z <= bound (z < bound when `strict`) to the front; returns their number. */
static size_t move_left(cloud_point *points, size_t count, const projection *p, double bound, bool strict)
{
    size_t i = 0, j = count;
    for (;;) {
        for (; i < j; i++) {
            const double z = project(p, &points[i]);
            if (strict ? z >= bound : z > bound)
                break;
        }
        for (; i < j; j--) {
            const double z = project(p, &points[j - 1]);
            if (strict ? z < bound : z <= bound)
                break;
        }
        if (i >= j)
            return i;
        const cloud_point keep = points[i];
        points[i++] = points[--j];
        points[j] = keep;
    }
}

size_t split_at_median(cloud_point *points, double *keys, size_t count, const moments *m, bool keep_tied)
{
    double axes[3][3];
    split_axes(m->covariance, axes);
    for (int k = 0; k < 3; k++) {
        projection p = {
            points, keys, {m->mean[0], m->mean[1], m->mean[2]}, {axes[k][0], axes[k][1], axes[k][2]}};
        if (count <= KEY_BLOCK)
            fill_keys(0, 0, count, &p);
        else
            parallel_blocks(count, KEY_BLOCK, fill_keys, &p);
        const double median = split_select(keys, count, (count - 1) / 2);
        size_t left = move_left(points, count, &p, median, false);
        if (left == count) {
            left = move_left(points, count, &p, median, true);
            if (left > 0 && keep_tied)
                return 0;
        }
        if (left > 0)
            return left;
    }
    return 0;
}
