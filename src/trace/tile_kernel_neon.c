/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_kernel_neon.c -- the tile kernel for NEON, which every 64-bit ARM has. */
#define KERNEL_NAME tile_kernel_neon
#include "trace/tile_kernel.inc.h"
