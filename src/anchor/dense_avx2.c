/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense_avx2.c -- the decoder's arithmetic for AVX2 with FMA. */
#include <immintrin.h>

#include "anchor/dense_elementwise.inc.h"

enum { LANES = 8, TILE_ROWS = 5 /* 10 of 16 registers hold sums */ };
typedef __m256 vec;
#define vec_load _mm256_loadu_ps
#define vec_store _mm256_storeu_ps
#define vec_set1 _mm256_set1_ps
#define vec_zero _mm256_setzero_ps
#define vec_fma _mm256_fmadd_ps
#define vec_max _mm256_max_ps
#define vec_where_above_zero(gate, x) _mm256_and_ps(_mm256_cmp_ps(gate, _mm256_setzero_ps(), _CMP_GT_OQ), x)
#include "anchor/dense_tiles.inc.h"

const dense_kernels dense_kernels_avx2 = {dense_multiply, dense_exp, dense_tanh, dense_sigmoid,
                                          dense_normalize};
