/* SPDX-License-Identifier: Apache-2.0 */
/* trace/rounding_band.h -- rays on which float32 and double may decide differently: at a cut-off, or between
   equal depths. */
#ifndef GBT_TRACE_ROUNDING_BAND_H
#define GBT_TRACE_ROUNDING_BAND_H

#include <stdbool.h>

#include "trace/reference.h"

/** Hits of a ray, used again from ray to ray. Start from {0}; free with band_scratch_free(). */
typedef struct band_scratch {
    reference_hit *hits;
    size_t capacity;
} band_scratch;

/**
 * May rounding change which hits a ray blends, or their order?
 *
 * It may when an alpha is within 1e-6 of alpha_min or alpha_max, a transmittance within 1e-5 of T_min
 * (relative), or two neighbours' depths within 2e-6 (relative).
 *
 * @param origin, dir [in] as traced: rounded to float
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: any, with distinct `scratch`. Cost: that of reference_scene_ray_hits().
 */
gbt_status rounding_band_find(const reference_scene *scene, const trace_settings *settings,
                              const float origin[3], const float dir[3], band_scratch *scratch,
                              bool *in_band);

void band_scratch_free(band_scratch *scratch);

#endif
