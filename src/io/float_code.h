/* SPDX-License-Identifier: Apache-2.0 */
/* io/float_code.h -- lossless coding of floats: the upper 16 bits are entropy coded, the lower 16, which are
   mostly noise, are stored as they are. */
#ifndef GBT_IO_FLOAT_CODE_H
#define GBT_IO_FLOAT_CODE_H

#include <stddef.h>

#include "gbtrace/status.h"
#include "io/range_coder.h"

/** Write or read values [rows][columns]; any bit patterns are allowed. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status floats_code(range_coder *c, float *values, size_t rows, size_t columns, gbt_error *err);

#endif
