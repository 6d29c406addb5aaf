/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel_plain.c -- the list kernel in plain C. */
#define SIMD16_PLAIN
#define KERNEL_NAME list_kernel_plain
#include "trace/list_kernel.inc.h"
