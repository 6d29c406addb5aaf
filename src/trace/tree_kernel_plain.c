/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_kernel_plain.c -- the tree kernel in plain C. */
#define SIMD16_PLAIN
#define KERNEL_NAME tree_kernel_plain
#include "trace/tree_kernel.inc.h"
