/* SPDX-License-Identifier: Apache-2.0 */
/* gb/cloud.h -- what every entry of this room asks of a cloud. */
#ifndef GBT_GB_CLOUD_H
#define GBT_GB_CLOUD_H

#include <stddef.h>

#include "gbtrace/status.h"

/**
 * Points finite, colours in [0, 1], count within uint32_t indices.
 *
 * @param color [in] may be NULL
 * @return GBT_OK, or GBT_ERR_ARGUMENT with a message that begins with `who` and names the first bad point
 */
gbt_status cloud_check(const char *who, const float *position, const float *color, size_t count,
                       gbt_error *err);

#endif
