/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense_neon.c -- the decoder's arithmetic for NEON. */
#include <arm_neon.h>

#include "anchor/dense_elementwise.inc.h"

enum { LANES = 4, TILE_ROWS = 10 /* 20 of 32 registers hold sums */ };
typedef float32x4_t vec;
#define vec_load vld1q_f32
#define vec_store vst1q_f32
#define vec_set1 vdupq_n_f32
#define vec_zero() vdupq_n_f32(0)
#define vec_fma(a, b, sum) vfmaq_f32(sum, a, b)
#define vec_max(a, b) vbslq_f32(vcgtq_f32(a, b), a, b)
#define vec_where_above_zero(gate, x) vbslq_f32(vcgtq_f32(gate, vec_zero()), x, vec_zero())
#include "anchor/dense_tiles.inc.h"

const dense_kernels dense_kernels_neon = {dense_multiply, dense_exp, dense_tanh, dense_sigmoid,
                                          dense_normalize};
