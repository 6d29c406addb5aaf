/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense.h -- the vectorised arithmetic of the decoder: a matrix product and the activations.

   All implementations (plain C, NEON, AVX2, AVX-512) give the same bits: every sum is a chain of fused
   multiply-adds in the order of the summation index. */
#ifndef GBT_ANCHOR_DENSE_H
#define GBT_ANCHOR_DENSE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/cpu.h"

enum { DENSE_COLUMNS = 16 /* n is a multiple of it */ };

/** c[i * c_row + j] = start + sum over t of a[i * a_row + t * a_step] * b[t * b_row + j]; start is bias[j],
    or c itself for bias NULL. */
typedef struct dense_product {
    size_t m, n, k;
    const float *a;
    size_t a_row, a_step;
    const float *b;
    size_t b_row;
    const float *bias; /* [n] or NULL */
    bool relu;         /* max(result, 0); a NaN becomes 0 */
    const float *gate; /* [m][c_row] or NULL: the result is 0 where this is not > 0: the adjoint of a ReLU */
    float *c;
    size_t c_row;
} dense_product;

typedef struct dense_kernels {
    void (*product)(const dense_product *job);
    void (*exp)(float *x, size_t count); /* these four work in place; see activations.h */
    void (*tanh)(float *x, size_t count);
    void (*sigmoid)(float *x, size_t count);
    /** Normalise quaternions, and return one over the old length. Lengths below 1e-12 give (1, 0, 0, 0) and
        0. Components are clamped to +-1e18. */
    void (*normalize)(float *w, float *x, float *y, float *z, float *inverse_length, size_t count);
} dense_kernels;

CPU_DECLARE_VARIANTS(dense_kernels, dense_kernels);

/** The implementation for cpu_best_isa(). */
const dense_kernels *dense_best(void);

#endif
