/* SPDX-License-Identifier: Apache-2.0 */
/* base/cpu.h -- which vector instructions the kernels use: the widest this processor has, or what GBT_ISA
   says. */
#ifndef GBT_BASE_CPU_H
#define GBT_BASE_CPU_H

#include <stddef.h>

/** From the narrowest to the widest: tables of kernels have a row for each, in this order. */
typedef enum cpu_isa { CPU_PLAIN = 0, CPU_AVX2 = 1, CPU_AVX512 = 2 } cpu_isa;

/** Chosen once per process: the smaller of what the processor has and the environment variable GBT_ISA
    (plain, avx2, avx512). */
cpu_isa cpu_best_isa(void);

/** Test only: pretend the processor has no more than `isa`. Never raises above what it has. */
void cpu_limit_isa(cpu_isa isa);

const char *cpu_isa_name(cpu_isa isa);

/** What the system calls the first processor, "?" where it does not say. */
void cpu_processor_name(char *out, size_t size);

#endif
