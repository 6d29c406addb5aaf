/* SPDX-License-Identifier: Apache-2.0 */
/* gb/cloud.c -- checks of an input cloud, shared by all functions of this folder. */
#include "gb/cloud.h"

#include <math.h>
#include <stdint.h>

#include "base/fail.h"

gbt_status cloud_check(const char *who, const float *position, const float *color, size_t count,
                       gbt_error *err)
{
    if (count > 0 && position == NULL)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: no positions (wanted %zu points, got NULL)", who, count);
    if (count >= UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: too many points (wanted fewer than 2^32 - 1, got %zu)",
                         who, count);
    for (size_t i = 0; i < count; i++) {
        const float *p = position + 3 * i;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]))
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: point %zu is not finite (got %g %g %g)", who, i,
                             (double)p[0], (double)p[1], (double)p[2]);
    }
    for (size_t i = 0; color != NULL && i < count; i++) {
        const float *c = color + 3 * i;
        /* Colours in [0, 255] would silently fail every colour test. NaN fails these comparisons, too. */
        for (int k = 0; k < 3; k++)
            if (!(c[k] >= 0.0f && c[k] <= 1.0f))
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "%s: colour of point %zu is out of range (wanted 0 to 1, got %g %g %g)", who,
                                 i, (double)c[0], (double)c[1], (double)c[2]);
    }
    return GBT_OK;
}
