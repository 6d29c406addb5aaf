/* SPDX-License-Identifier: Apache-2.0 */
/* bvh/proxy.h -- padded boxes around the ellipsoids that Gaussians can be seen in: what every tree over
   Gaussians is built from.

   The proxy of Gaussian i is the ellipsoid at radius sqrt(2 ln(opacity / alpha_min)) std-devs: exactly the
   set where its response reaches alpha_min. Its tight box is padded so that float32 traversal misses
   nothing. */
#ifndef GBT_BVH_PROXY_H
#define GBT_BVH_PROXY_H

#include <stddef.h>

#include "base/gaussians.h"
#include "bvh/embree_api.h"

typedef struct proxy_boxes {
    struct RTCBuildPrimitive *box; /* [count], by increasing primID, which is the index of the Gaussian;
                                      geomID is 0 */
    size_t count;                  /* Gaussians with opacity <= alpha_min or non-finite fields have no box */
    size_t rejected_count;         /* of these, the non-finite or out-of-range ones */
    size_t capacity;      /* at least a quarter more than count: working space of Embree's builders */
    float coordinate_max; /* largest |coordinate| of any box before padding */
} proxy_boxes;

/**
 * Make (or make again) the boxes of `g`.
 *
 * @param alpha_min [in] smallest response that counts, (0, 1)
 * @param reach     [in] largest |coordinate| of any ray origin that will be traced: boxes are padded for it
 * @param boxes     [in,out] start from {0}; memory is kept from call to call; free with proxy_boxes_free()
 * @return GBT_OK, GBT_ERR_NO_MEMORY (2^31 Gaussians too); on failure there are 0 boxes
 *
 * Threads: uses all; the same boxes for every thread count. Cost: O(n); 40 bytes per Gaussian.
 */
gbt_status proxy_boxes_make(const gaussians *g, float alpha_min, float reach, proxy_boxes *boxes,
                            gbt_error *err);
void proxy_boxes_free(proxy_boxes *boxes); /* back to {0} */

#endif
