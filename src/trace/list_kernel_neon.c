/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel_neon.c -- the list kernel for NEON, which every 64-bit ARM has. */
#define KERNEL_NAME list_kernel_neon
#include "trace/list_kernel.inc.h"
