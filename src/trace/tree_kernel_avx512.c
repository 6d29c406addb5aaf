/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_kernel_avx512.c -- the tree kernel for avx512; compiled with the flags of that instruction
   set. */
#define KERNEL_NAME tree_kernel_avx512
#include "trace/tree_kernel.inc.h"
