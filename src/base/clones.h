/* SPDX-License-Identifier: Apache-2.0 */
/* base/clones.h -- compile one plain C function for several instruction sets; the loader picks the widest
   that the processor has, regardless of GBT_ISA. */
#ifndef GBT_BASE_CLONES_H
#define GBT_BASE_CLONES_H

/** Attribute to put before a function. The project is compiled without contraction (no fused operations), so
    every clone gives the same bits. There are no clones under ThreadSanitizer, which is not initialised yet
    when the loader picks, with clang, which cannot pass vectors between clones, and on architectures other
    than x86-64. */
#if defined(__SANITIZE_THREAD__) || defined(__clang__) || !defined(__x86_64__)
#define FASTEST_CLONE
#else
#define FASTEST_CLONE __attribute__((target_clones("avx512f", "avx2", "default")))
#endif

#endif
