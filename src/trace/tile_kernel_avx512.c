/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_kernel_avx512.c -- the tile kernel for avx512; compiled with the flags of that instruction
   set. */
#define KERNEL_NAME tile_kernel_avx512
#include "trace/tile_kernel.inc.h"
