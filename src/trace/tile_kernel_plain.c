/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_kernel_plain.c -- the tile kernel for plain; compiled with the flags of that instruction set. */
#define KERNEL_NAME tile_kernel_plain
#include "trace/tile_kernel.inc.h"
