/* SPDX-License-Identifier: Apache-2.0 */
/* gb/cloud.h -- checks of an input cloud, shared by all functions of this folder. */
#ifndef GBT_GB_CLOUD_H
#define GBT_GB_CLOUD_H

#include <stddef.h>

#include "gbtrace/status.h"

/**
 * Check that points are finite, colours in [0, 1], and the count fits uint32_t indices.
 *
 * @param color [in] may be NULL
 * @return GBT_OK, or GBT_ERR_ARGUMENT with a message that begins with `who` and names the first bad point
 */
gbt_status cloud_check(const char *who, const float *position, const float *color, size_t count,
                       gbt_error *err);

#endif
