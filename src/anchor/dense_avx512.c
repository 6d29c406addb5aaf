/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense_avx512.c -- the decoder's arithmetic for AVX-512. */
#include <immintrin.h>

#include "anchor/dense_elementwise.inc.h"

enum {
    LANES = 16,
    TILE_ROWS = 10 /* 20 of 32 registers hold sums; 10 divides the outputs of every network for K = 10 */
};
typedef __m512 vec;
#define vec_load _mm512_loadu_ps
#define vec_store _mm512_storeu_ps
#define vec_set1 _mm512_set1_ps
#define vec_zero _mm512_setzero_ps
#define vec_fma _mm512_fmadd_ps
#define vec_max _mm512_max_ps
#define vec_where_above_zero(gate, x)                                                                        \
    _mm512_maskz_mov_ps(_mm512_cmp_ps_mask(gate, _mm512_setzero_ps(), _CMP_GT_OQ), x)
#include "anchor/dense_tiles.inc.h"

const dense_kernels dense_kernels_avx512 = {dense_multiply, dense_exp, dense_tanh, dense_sigmoid,
                                            dense_normalize};
