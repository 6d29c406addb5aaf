/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/device.h -- the one Embree device of the process, its errors and its memory, and what every caller must
   check before Embree.

   No Embree type appears here, so that folders above can report the version or set a limit without including
   Embree. */
#ifndef GBT_BVH_DEVICE_H
#define GBT_BVH_DEVICE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

/**
 * The process-wide Embree device (an RTCDevice), made at the first call and kept until the process ends.
 *
 * It uses the instruction sets of cpu_best_isa() at most. Embree's builders run on oneTBB, so
 * parallel_set_threads() limits them too, whenever it is called; with GBT_PTHREADS they use every processor.
 * Embree runs its builders, and the callbacks in them, in a floating-point mode that flushes denormals
 * (below 1.2e-38) to 0.
 *
 * @return NULL with GBT_ERR_NO_MEMORY or GBT_ERR_INTERNAL in `err` when Embree cannot start; it is not tried
 *         again
 * Threads: any.
 */
void *bvh_device(gbt_error *err);

/**
 * GBT_OK, or what Embree has complained about on this thread since the last call, in Embree's words.
 *
 * Call after every build: Embree's own calls report nothing. GBT_ERR_NO_MEMORY for exhaustion, else
 * GBT_ERR_INTERNAL.
 */
gbt_status bvh_check(const char *what, gbt_error *err);

/** Version of the Embree that runs, "3.13.5"; that of the headers when the device could not be made. */
const char *bvh_embree_version(void);

/** Bytes that Embree holds for all scenes now. */
size_t bvh_memory_bytes(void);

/**
 * Refuse builds that would take Embree's memory above `bytes` (SIZE_MAX, the default: no limit): they fail
 * with GBT_ERR_NO_MEMORY.
 *
 * A refusal is safe where a real exhaustion inside Embree is not (it ends the process). A build needs about
 * 100 bytes per primitive.
 */
void bvh_limit_memory(size_t bytes);

/** Largest |coordinate| that goes to Embree. Embree silently drops boxes beyond 1.844e18, and aborts on such
    rays. */
static const float bvh_coordinate_limit = 1e18f;

/** Whether a ray may go to Embree: finite, within the limit, 0 <= t_min <= t_max (t_max may be infinite), a
    direction. */
static inline bool bvh_ray_ok(const float origin[3], const float dir[3], float t_min, float t_max)
{
    bool some = false;
    for (int i = 0; i < 3; i++) {
        if (!(fabsf(origin[i]) <= bvh_coordinate_limit && fabsf(dir[i]) <= bvh_coordinate_limit))
            return false;
        some = some || dir[i] != 0;
    }
    return some && t_min >= 0 && t_min <= t_max && t_min <= bvh_coordinate_limit;
}

/**
 * The exponent of the power of two by which a direction is divided (exactly) and t is multiplied before they
 * go to Embree, which replaces components of directions below 1e-18 by others. 0 for directions of usual
 * length, and for those that are not finite.
 */
static inline int bvh_ray_exponent(const float dir[3])
{
    const float largest = fmaxf(fabsf(dir[0]), fmaxf(fabsf(dir[1]), fabsf(dir[2])));
    int exponent = 0;
    if (isfinite(largest) && (largest < 1e-3f || largest > 1e3f))
        frexpf(largest, &exponent);
    return exponent;
}

/**
 * How far the faces of a box must move out so that Embree's float32 slab test misses no ray, in addition to
 * one nextafterf().
 *
 * Embree tests boxes of user geometry without any margin, whatever RTC_SCENE_FLAG_ROBUST says. A quarter of
 * this removed every miss of 1.03 M rays at five scales. `reach`: largest |coordinate| of the boxes and of
 * the ray origins.
 */
static inline float bvh_box_pad(float reach) { return 0x1p-22f * reach; }

#endif
