/* SPDX-License-Identifier: Apache-2.0 */
/* trace/rounding_band.h -- rays on which float32 and double may decide differently: at a cut-off, or between
   equal depths. */
#ifndef GBT_TRACE_ROUNDING_BAND_H
#define GBT_TRACE_ROUNDING_BAND_H

#include <stdbool.h>

#include "trace/reference.h"

/**
 * Finds the rays on which rounding may change which hits are blended, or their order.
 *
 * It may when an alpha is within 1e-6 of alpha_min or alpha_max, a transmittance within 1e-5 of T_min
 * (relative), or two neighbours' depths within 2e-6 (relative).
 *
 * @param in_band [in,out] [rays]; rays with false are not examined and stay so
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: parallel over rays. Cost: that of reference_scene_forward().
 */
gbt_status rounding_band_find(const reference_scene *scene, const trace_settings *settings,
                              const ray_image *rays, bool *in_band, gbt_error *err);

#endif
