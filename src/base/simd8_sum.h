/* SPDX-License-Identifier: Apache-2.0 */
/* base/simd8_sum.h -- sums of rows of eight floats, for AVX2 and AVX-512. */
#ifndef GBT_BASE_SIMD8_SUM_H
#define GBT_BASE_SIMD8_SUM_H

#include <immintrin.h>

/* Lane j: all lanes of in[j]. A shuffle and a blend bring lanes four apart together, in place of two
 * shuffles. */
static inline __m256 sum8_rows(const __m256 in[8])
{
    __m256 y[4], z[2];
    for (int j = 0; j < 4; j++) /* rows j and j + 4, of four lanes */
        y[j] = _mm256_add_ps(_mm256_blend_ps(in[j], in[j + 4], 0xF0),
                             _mm256_permute2f128_ps(in[j], in[j + 4], 0x21));
    for (int j = 0; j < 2; j++)
        z[j] = _mm256_add_ps(_mm256_unpacklo_ps(y[2 * j], y[2 * j + 1]),
                             _mm256_unpackhi_ps(y[2 * j], y[2 * j + 1]));
    const __m256d a = _mm256_castps_pd(z[0]), b = _mm256_castps_pd(z[1]);
    return _mm256_add_ps(_mm256_castpd_ps(_mm256_unpacklo_pd(a, b)),
                         _mm256_castpd_ps(_mm256_unpackhi_pd(a, b)));
}

#endif
