/* SPDX-License-Identifier: Apache-2.0 */
/* base/cpu.h -- which vector instructions the kernels use: the widest that this processor has, limited by
   GBT_ISA. */
#ifndef GBT_BASE_CPU_H
#define GBT_BASE_CPU_H

#include <stdbool.h>

/** From the narrowest to the widest. Every 64-bit ARM processor has NEON; AVX2 and AVX-512 exist on x86-64
    only. */
typedef enum cpu_isa { CPU_PLAIN, CPU_NEON, CPU_AVX2, CPU_AVX512, CPU_ISA_COUNT } cpu_isa;

/* For a kernel that is compiled once per instruction set as NAME_plain, NAME_avx2, ... (gbt_kernels in
   CMakeLists.txt): CPU_DECLARE_VARIANTS declares them, CPU_VARIANT points to the one for `isa`. CPU_CLONE
   does so for one C source that is compiled with several compiler options; on ARM there is only the
   default. */
#if defined(__x86_64__)
#define CPU_DECLARE_VARIANTS(type, name) extern const type name##_plain, name##_avx2, name##_avx512
#define CPU_VARIANT(name, isa)                                                                               \
    ((isa) == CPU_AVX512 ? &name##_avx512 : (isa) == CPU_AVX2 ? &name##_avx2 : &name##_plain)
#define CPU_CLONE CPU_VARIANT
#elif defined(__aarch64__)
#define CPU_DECLARE_VARIANTS(type, name) extern const type name##_plain, name##_neon
#define CPU_VARIANT(name, isa) ((isa) == CPU_PLAIN ? &name##_plain : &name##_neon)
#define CPU_CLONE(name, isa) ((void)(isa), &name##_plain)
#else
#define CPU_DECLARE_VARIANTS(type, name) extern const type name##_plain
#define CPU_VARIANT(name, isa) ((void)(isa), &name##_plain)
#define CPU_CLONE CPU_VARIANT
#endif

/** Chosen once per process: the widest that the processor has and that the environment variable GBT_ISA
    (plain, neon, avx2, avx512) allows. */
cpu_isa cpu_best_isa(void);

bool cpu_has_isa(cpu_isa isa);

/** Test only: pretend the processor has no more than `isa`. Never raises above what it has. */
void cpu_limit_isa(cpu_isa isa);

const char *cpu_isa_name(cpu_isa isa);

#endif
