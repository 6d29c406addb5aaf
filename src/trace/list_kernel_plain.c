/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel_plain.c -- the list kernel for plain; compiled with the flags of that instruction set. */
#define KERNEL_NAME list_kernel_plain
#include "trace/list_kernel.inc.h"
