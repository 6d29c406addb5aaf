/* SPDX-License-Identifier: Apache-2.0 */
/* base/cpu.c -- choose the instruction set of the kernels at run time. */
#include "base/cpu.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"

static const char *const names[CPU_ISA_COUNT] = {"plain", "neon", "avx2", "avx512"};
static atomic_int chosen = -1;

bool cpu_has_isa(cpu_isa isa)
{
#if defined(__x86_64__)
    __builtin_cpu_init();
#ifdef __clang__ /* clang does not know the name f16c; every processor with AVX2 has it */
    const bool halves = true;
#else
    const bool halves = __builtin_cpu_supports("f16c");
#endif
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && halves;
    if (isa == CPU_AVX512)
        return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    return isa == CPU_PLAIN || (isa == CPU_AVX2 && avx2);
#elif defined(__aarch64__)
    return isa == CPU_PLAIN || isa == CPU_NEON;
#else
    return isa == CPU_PLAIN;
#endif
}

/* The widest available instruction set that is not wider than `isa`. */
static cpu_isa within(cpu_isa isa)
{
    while (!cpu_has_isa(isa))
        isa--;
    return isa;
}

cpu_isa cpu_best_isa(void)
{
    int isa = chosen;
    if (isa < 0) {
        cpu_isa most = CPU_AVX512;
        const char *wanted = getenv("GBT_ISA");
        bool known = wanted == NULL || wanted[0] == '\0';
        for (int i = 0; !known && i < CPU_ISA_COUNT; i++)
            if (strcmp(wanted, names[i]) == 0) {
                most = (cpu_isa)i;
                known = true;
            }
        if (!known)
            log_warn("GBT_ISA=%.20s: no instruction set (wanted plain, neon, avx2 or avx512)", wanted);
        chosen = isa = (int)within(most);
    }
    return (cpu_isa)isa;
}

void cpu_limit_isa(cpu_isa isa) { chosen = (int)within(isa); }

const char *cpu_isa_name(cpu_isa isa) { return names[isa]; }
