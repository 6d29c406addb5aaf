/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense_tiles.inc.h -- the matrix product in register tiles; the including file defines the vector
   type.

   Needs: vec, LANES, TILE_ROWS (rows of c held in registers, times two vectors), vec_load, vec_store,
   vec_set1, vec_zero, vec_fma, vec_max and vec_where_above_zero(gate, x). */
#include "anchor/dense.h"

/* `rows` and `vectors` are constants at every call, so the loops over them unroll and `sum` lives in
   registers. */
static inline __attribute__((always_inline)) void tile(const int rows, const int vectors,
                                                       const dense_product *job, size_t row, size_t column)
{
    const size_t a_row = job->a_row, a_step = job->a_step, b_row = job->b_row;
    vec sum[TILE_ROWS][2];
    float *c = job->c + row * job->c_row + column;
#pragma GCC unroll 16
    for (int i = 0; i < rows; i++)
#pragma GCC unroll 2
        for (int j = 0; j < vectors; j++)
            sum[i][j] = job->bias != NULL ? vec_load(job->bias + column + j * LANES)
                                          : vec_load(c + (size_t)i * job->c_row + j * LANES);

    /* One pointer per three rows: x86 addressing modes reach base, base + stride and base + 2 stride, so ten
       rows need only four registers. */
    const float *a[(TILE_ROWS + 2) / 3];
#pragma GCC unroll 16
    for (int i = 0; i < (rows + 2) / 3; i++)
        a[i] = job->a + (row + 3 * (size_t)i) * a_row;
    const float *b = job->b + column;
    for (size_t t = 0; t < job->k; t++) {
        vec right[2];
#pragma GCC unroll 2
        for (int j = 0; j < vectors; j++)
            right[j] = vec_load(b + j * LANES);
#pragma GCC unroll 16
        for (int i = 0; i < rows; i++) {
            const vec left = vec_set1(a[i / 3][(size_t)(i % 3) * a_row]);
#pragma GCC unroll 2
            for (int j = 0; j < vectors; j++)
                sum[i][j] = vec_fma(left, right[j], sum[i][j]);
        }
        b += b_row;
#pragma GCC unroll 16
        for (int i = 0; i < (rows + 2) / 3; i++)
            a[i] += a_step;
    }

#pragma GCC unroll 16
    for (int i = 0; i < rows; i++)
#pragma GCC unroll 2
        for (int j = 0; j < vectors; j++) {
            if (job->relu)
                sum[i][j] = vec_max(sum[i][j], vec_zero()); /* NaN gives the second operand, 0 */
            if (job->gate != NULL)
                sum[i][j] = vec_where_above_zero(
                    vec_load(job->gate + (row + (size_t)i) * job->c_row + column + j * LANES), sum[i][j]);
            vec_store(c + (size_t)i * job->c_row + j * LANES, sum[i][j]);
        }
}

static inline __attribute__((always_inline)) void tile_row(const int rows, const dense_product *job,
                                                           size_t row)
{
    size_t column = 0;
    for (; column + 2 * LANES <= job->n; column += 2 * LANES)
        tile(rows, 2, job, row, column);
    for (; column < job->n; column += LANES)
        tile(rows, 1, job, row, column);
}

static void dense_multiply(const dense_product *job)
{
    size_t row = 0;
    for (; row + TILE_ROWS <= job->m; row += TILE_ROWS)
        tile_row(TILE_ROWS, job, row);
    for (; row + 3 <= job->m; row += 3)
        tile_row(3, job, row);
    for (; row < job->m; row++)
        tile_row(1, job, row);
}
