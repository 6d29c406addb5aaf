/* trace/packet_kernel_avx2.c -- the packet kernel for avx2; compiled with the flags of that instruction set. */
#define KERNEL_NAME packet_kernel_avx2
#include "trace/packet_kernel.inc.h"
