/* trace/packet_kernel_avx512.c -- the packet kernel for avx512; compiled with the flags of that instruction set. */
#define KERNEL_NAME packet_kernel_avx512
#include "trace/packet_kernel.inc.h"
