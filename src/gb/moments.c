/* SPDX-License-Identifier: Apache-2.0 */
/* gb/moments.c -- mean, covariance, radius and colour spread of a set of points, in double. */
#include "gb/moments.h"

#include <math.h>

#include "base/parallel.h"

/* A set is summed in at most MAX_BLOCKS blocks of at least BLOCK_POINTS points, so that partial sums fit on
   the stack and small sets are one block. */
enum { MAX_BLOCKS = 64, BLOCK_POINTS = 8192 };

typedef struct block_sums {
    const cloud_point *points;
    const double *about; /* [3] */
    double sum[MAX_BLOCKS][6];
} block_sums;

static void sum_offsets(size_t block, size_t begin, size_t end, void *context)
{
    block_sums *sums = context;
    const double ox = sums->about[0], oy = sums->about[1], oz = sums->about[2];
    double x = 0, y = 0, z = 0;
    for (size_t i = begin; i < end; i++) {
        const float *p = sums->points[i].position;
        x += (double)p[0] - ox;
        y += (double)p[1] - oy;
        z += (double)p[2] - oz;
    }
    double *sum = sums->sum[block];
    sum[0] = x;
    sum[1] = y;
    sum[2] = z;
}

static void sum_products(size_t block, size_t begin, size_t end, void *context)
{
    block_sums *sums = context;
    const double ox = sums->about[0], oy = sums->about[1], oz = sums->about[2];
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    for (size_t i = begin; i < end; i++) {
        const float *p = sums->points[i].position;
        const double x = (double)p[0] - ox, y = (double)p[1] - oy, z = (double)p[2] - oz;
        xx += x * x;
        xy += x * y;
        xz += x * z;
        yy += y * y;
        yz += y * z;
        zz += z * z;
    }
    double *sum = sums->sum[block];
    sum[0] = xx;
    sum[1] = xy;
    sum[2] = xz;
    sum[3] = yy;
    sum[4] = yz;
    sum[5] = zz;
}

/* Run the blocks and add their sums, in block order, into total[0 .. terms). */
static void run_blocks(block_sums *sums, size_t count, parallel_body *body, int terms, double *total)
{
    size_t grain = (count + MAX_BLOCKS - 1) / MAX_BLOCKS;
    if (grain < BLOCK_POINTS)
        grain = BLOCK_POINTS;
    if (count <= grain)
        body(0, 0, count, sums); /* most sets have only a few points: bypass the scheduler */
    else
        parallel_blocks(count, grain, body, sums);
    for (int k = 0; k < terms; k++) {
        total[k] = sums->sum[0][k];
        for (size_t block = 1; block < parallel_block_count(count, grain); block++)
            total[k] += sums->sum[block][k];
    }
}

void moments_compute(const cloud_point *points, size_t count, moments *out)
{
    block_sums sums;
    sums.points = points;
    const double first[3] = {(double)points[0].position[0], (double)points[0].position[1],
                             (double)points[0].position[2]};
    double total[6];
    sums.about = first;
    run_blocks(&sums, count, sum_offsets, 3, total);
    for (int k = 0; k < 3; k++)
        out->mean[k] = first[k] + total[k] / (double)count;
    sums.about = out->mean;
    run_blocks(&sums, count, sum_products, 6, total);
    for (int k = 0; k < 6; k++)
        out->covariance[k] = total[k] / (double)count;
}

double moments_radius(const moments *m)
{
    return sqrt(m->covariance[0] + m->covariance[3] + m->covariance[5]);
}

double moments_color_std(const cloud_point *points, size_t count, const float *color, double mean[3])
{
    const float *first = color + 3 * (size_t)points[0].index;
    double sum[3] = {0, 0, 0}, square[3] = {0, 0, 0};
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            sum[c] += (double)color[3 * (size_t)points[i].index + c] - (double)first[c];
    for (int c = 0; c < 3; c++)
        mean[c] = (double)first[c] + sum[c] / (double)count;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            const double d = (double)color[3 * (size_t)points[i].index + c] - mean[c];
            square[c] += d * d;
        }
    return (sqrt(square[0] / (double)count) + sqrt(square[1] / (double)count) +
            sqrt(square[2] / (double)count)) /
           3;
}
