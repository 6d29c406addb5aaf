/* SPDX-License-Identifier: Apache-2.0 */
/* trace/row16.h -- arrays of rows: a row is one number for each ray of a packet. Included by kernels. */
#ifndef GBT_TRACE_ROW16_H
#define GBT_TRACE_ROW16_H

#include "base/simd16.h"
#include "trace/kernel.h"

static inline vfloat16 row_load(const float *rows, int i)
{
    return vfloat16_load(rows + (size_t)i * PACKET_LANES);
}

static inline void row_store(float *rows, int i, vfloat16 a)
{
    vfloat16_store(rows + (size_t)i * PACKET_LANES, a);
}

#endif
