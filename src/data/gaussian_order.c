/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_order.c -- sorts Gaussians into nested boxes around the centre, and by Morton code within
   each. */
#include "data/gaussian_order.h"

#include <math.h>
#include <stdlib.h>

#include "base/compare.h"
#include "base/memory.h"
#include "base/morton.h"

enum { AXIS_BITS = 21, SHELLS = 64 };

typedef struct coded {
    int shell;
    uint32_t row;
    uint64_t code;
} coded;

static int by_code(const void *a, const void *b)
{
    const coded *x = a, *y = b;
    if (x->shell != y->shell)
        return x->shell < y->shell ? -1 : 1;
    if (x->code != y->code)
        return x->code < y->code ? -1 : 1;
    return (x->row > y->row) - (x->row < y->row);
}

float gaussian_median(float *values, size_t count)
{
    qsort(values, count, sizeof *values, compare_floats);
    return values[count / 2];
}

static double distance(const float *mean, const double middle[3])
{
    double largest = 0;
    for (int k = 0; k < 3; k++)
        largest = fmax(largest, fabs((double)mean[k] - middle[k]));
    return largest;
}

static void find_codes(const gaussian_cloud *cloud, float *values, coded *list)
{
    const size_t n = cloud->count;
    double middle[3];
    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 0; i < n; i++)
            values[i] = cloud->mean[3 * i + k];
        middle[k] = (double)gaussian_median(values, n);
    }
    for (size_t i = 0; i < n; i++)
        values[i] = (float)distance(cloud->mean + 3 * i, middle);
    const double near = fmax((double)gaussian_median(values, n), 1e-12);
    for (size_t i = 0; i < n; i++) {
        const float *mean = cloud->mean + 3 * i;
        double half = near;
        list[i] = (coded){.row = (uint32_t)i};
        for (; list[i].shell < SHELLS && distance(mean, middle) > half; list[i].shell++)
            half *= 2;
        for (size_t k = 0; k < 3; k++) {
            const double place = ((double)mean[k] - middle[k]) / (2 * half) + 0.5;
            list[i].code |= morton_spread((uint64_t)(fmin(fmax(place, 0), 1) * ((1 << AXIS_BITS) - 1))) << k;
        }
    }
}

uint32_t *gaussian_order(const gaussian_cloud *cloud, gbt_error *err)
{
    const size_t n = cloud->count;
    coded *list = mem_alloc(n, sizeof *list, "order of Gaussians", err);
    float *values = mem_alloc(n, sizeof *values, "order of Gaussians", err);
    uint32_t *order = mem_alloc(n, sizeof *order, "order of Gaussians", err);
    if (list != NULL && values != NULL && order != NULL) {
        find_codes(cloud, values, list);
        qsort(list, n, sizeof *list, by_code);
        for (size_t i = 0; i < n; i++)
            order[i] = list[i].row;
    } else {
        mem_free(order);
        order = NULL;
    }
    mem_free(list);
    mem_free(values);
    return order;
}
