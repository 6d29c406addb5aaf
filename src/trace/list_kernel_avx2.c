/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel_avx2.c -- the list kernel for avx2; compiled with the flags of that instruction set. */
#define KERNEL_NAME list_kernel_avx2
#include "trace/list_kernel.inc.h"
