/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel_plain.c -- the rasterizer's kernels for plain; compiled with the flags of that instruction
   set. */
#define KERNEL_NAME raster_kernel_plain
#include "raster/kernel.inc.h"
