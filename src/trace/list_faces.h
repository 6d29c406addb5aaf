/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_faces.h -- the faces of a view and their parts (list_view.h), from its rays. */
#ifndef GBT_TRACE_LIST_FACES_H
#define GBT_TRACE_LIST_FACES_H

#include "trace/rays.h"
#include "trace/list_build.h"

/**
 * Set faces, parts and boxes of `lists->view`.
 *
 * @param usable [out] false: these rays do not start at one sensible point
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; the same for every thread count.
 */
gbt_status list_faces_make(list_builder *lists, const ray_image *rays, bool *usable, gbt_error *err);

#endif
