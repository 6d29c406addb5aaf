/* SPDX-License-Identifier: Apache-2.0 */
/* base/compare.h -- orders for qsort(). */
#ifndef GBT_BASE_COMPARE_H
#define GBT_BASE_COMPARE_H

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
