/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel_avx512.c -- the rasterizer's kernels for avx512; compiled with the flags of that instruction
   set. */
#define KERNEL_NAME raster_kernel_avx512
#include "raster/kernel.inc.h"
