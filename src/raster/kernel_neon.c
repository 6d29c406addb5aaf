/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel_neon.c -- the rasterizer's kernels for NEON, which every 64-bit ARM has. */
#define KERNEL_NAME raster_kernel_neon
#include "raster/kernel.inc.h"
