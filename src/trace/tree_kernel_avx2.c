/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_kernel_avx2.c -- the tree kernel for avx2; compiled with the flags of that instruction set. */
#define KERNEL_NAME tree_kernel_avx2
#include "trace/tree_kernel.inc.h"
