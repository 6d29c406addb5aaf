/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_kernel_neon.c -- the tree kernel for NEON, which every 64-bit ARM has. */
#define KERNEL_NAME tree_kernel_neon
#include "trace/tree_kernel.inc.h"
