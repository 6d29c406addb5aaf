/* SPDX-License-Identifier: Apache-2.0 */
/* base/compare.h -- minimum and maximum of two numbers, and comparison functions for qsort(). */
#ifndef GBT_BASE_COMPARE_H
#define GBT_BASE_COMPARE_H

#include <math.h>
#include <stddef.h>

/** fmaxf() and fminf() for arguments that are not NaN, inlined. */
static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }

/** Maximum and minimum; NaN when either argument is NaN. */
static inline double larger_or_nan(double a, double b) { return b > a || isnan(b) ? b : a; }
static inline double smaller_or_nan(double a, double b) { return b < a || isnan(b) ? b : a; }

static inline size_t smaller_size(size_t a, size_t b) { return a < b ? a : b; }

/** Ascending floats, none of them NaN. */
static inline int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/** Ascending doubles, none of them NaN. */
static inline int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

#endif
