/* SPDX-License-Identifier: Apache-2.0 */
/* base/cpu.c -- choose the instruction set of the kernels at run time. */
#include "base/cpu.h"

#include <stdio.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[] = {"plain", "avx2", "avx512"};
static int chosen = -1;

static cpu_isa detect(void)
{
    __builtin_cpu_init();
    cpu_isa best = CPU_PLAIN;
#ifdef __clang__ /* does not know the name f16c; no processor has AVX2 without it */
    const bool halves = true;
#else
    const bool halves = __builtin_cpu_supports("f16c");
#endif
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && halves)
        best = CPU_AVX2;
    if (best == CPU_AVX2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
        best = CPU_AVX512;
    return best;
}

cpu_isa cpu_best_isa(void)
{
    if (chosen >= 0)
        return (cpu_isa)chosen;
    cpu_isa best = detect();
    const char *wanted = getenv("GBT_ISA");
    for (int i = 0; wanted != NULL && i < (int)best; i++)
        if (strcmp(wanted, names[i]) == 0)
            best = (cpu_isa)i;
    chosen = (int)best;
    return best;
}

void cpu_limit_isa(cpu_isa isa)
{
    const cpu_isa best = detect();
    chosen = (int)(isa < best ? isa : best);
}

const char *cpu_isa_name(cpu_isa isa) { return names[isa]; }

void cpu_processor_name(char *out, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    snprintf(out, size, "?");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        const char *value = strchr(line, ':');
        if (strncmp(line, "model name", 10) != 0 || value == NULL)
            continue;
        value += strspn(value, ": \t");
        snprintf(out, size, "%.*s", (int)strcspn(value, "\r\n"), value);
        break;
    }
    if (file != NULL)
        fclose(file);
}
