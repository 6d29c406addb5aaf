/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel_avx512.c -- the list kernel for avx512; compiled with the flags of that instruction
   set. */
#define KERNEL_NAME list_kernel_avx512
#include "trace/list_kernel.inc.h"
