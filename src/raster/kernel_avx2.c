/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel_avx2.c -- the rasterizer's kernels for avx2; compiled with the flags of that instruction
   set. */
#define KERNEL_NAME raster_kernel_avx2
#include "raster/kernel.inc.h"
