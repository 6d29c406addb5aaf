/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel_plain.c -- the rasterizer's kernels in plain C. */
#define SIMD16_PLAIN
#define KERNEL_NAME raster_kernel_plain
#include "raster/kernel.inc.h"
