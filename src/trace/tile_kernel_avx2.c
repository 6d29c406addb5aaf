/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_kernel_avx2.c -- the tile kernel for avx2; compiled with the flags of that instruction set. */
#define KERNEL_NAME tile_kernel_avx2
#include "trace/tile_kernel.inc.h"
