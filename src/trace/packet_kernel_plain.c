/* trace/packet_kernel_plain.c -- the packet kernel for plain; compiled with the flags of that instruction set. */
#define KERNEL_NAME packet_kernel_plain
#include "trace/packet_kernel.inc.h"
