/* SPDX-License-Identifier: Apache-2.0 */
/* base/clones.h -- one function in plain C, compiled for several instruction sets; the loader picks.

   The widest that the processor has, whatever GBT_ISA says. */
#ifndef GBT_BASE_CLONES_H
#define GBT_BASE_CLONES_H

/** Before a function. The project compiles without contraction (no fused operations), so every clone gives
    the same bits. None under ThreadSanitizer, which is not up yet when the loader picks, nor with clang,
   which cannot pass vectors between clones, nor where the compiler's own instruction set is all there is. */
#if defined(__SANITIZE_THREAD__) || defined(__clang__) || !defined(__x86_64__)
#define FASTEST_CLONE
#else
#define FASTEST_CLONE __attribute__((target_clones("avx512f", "avx2", "default")))
#endif

#endif
