/* SPDX-License-Identifier: Apache-2.0 */
/* trace/gradients.h -- the gradient records that tiles leave, and their sum over the image. */
#ifndef GBT_TRACE_GRADIENTS_H
#define GBT_TRACE_GRADIENTS_H

#include "base/gaussians.h"
#include "trace/list_kernel.h"

/** Free the hash table and trim the array to what is used. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status gradient_list_close(gradient_list *list);

void gradient_list_free(gradient_list *list); /* back to {0} */

/** Memory of gradients_reduce(), used again from view to view. Start from {0}. */
typedef struct gradient_order {
    const gradient_record **record; /* all records, ordered by Gaussian, then by list */
    size_t record_capacity;
    uint32_t *first; /* where each Gaussian's begin */
    size_t first_capacity;
} gradient_order;

/**
 * Sum the records of all lists in the order of the lists, and turn the sums into gradients of the fields.
 *
 * Envelope theorem: at the nearest point d(d2)/dt = 0 (or t is fixed at t_near), so t needs no derivative.
 * With v the canonical point: d(d2)/dmean = -2 (S^-1 R^T)^T v, d(d2)/dlog s_i = -2 v_i^2, d(d2)/domega = 2
 * (S^-1 v) x (S v).
 *
 * @param lists   [in]  [list_count]
 * @param records [in]  of the Gaussians (kernel.h)
 * @param out     [out] resized like `g` and overwritten: dL/dfield (scales linear, quaternion tangent)
 * @param weight  [out] optional (NULL), [count]: sum over rays of T alpha
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status gradients_reduce(gradient_order *order, const gradient_list *const *lists, size_t list_count,
                            const gaussians *g, const float *records, gaussians *out, float *weight,
                            gbt_error *err);

/**
 * gradients_reduce() for lists: from the sums that the tiles of a view left in the slots of their pairs.
 *
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; same bits for every thread count.
 */
gbt_status gradients_reduce_view(const list_kernel *kernel, const kernel_scene *scene, const list_view *view,
                                 const gaussians *g, gaussians *out, float *weight, gbt_error *err);

void gradient_order_free(gradient_order *order); /* back to {0} */

#endif
