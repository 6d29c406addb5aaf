/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_kernel_plain.c -- the tile kernel in plain C. */
#define SIMD16_PLAIN
#define KERNEL_NAME tile_kernel_plain
#include "trace/tile_kernel.inc.h"
