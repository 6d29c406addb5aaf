/* SPDX-License-Identifier: Apache-2.0 */
/* base/parallel.h -- the only way to use threads. Implemented in shim/ (oneTBB, or pthreads for the tsan
   preset). */
#ifndef GBT_BASE_PARALLEL_H
#define GBT_BASE_PARALLEL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Work on elements [begin, end), which are block number `block`. */
typedef void parallel_body(size_t block, size_t begin, size_t end, void *context);

/**
 * Call `body` once per block of `grain` elements (the last may be shorter), on as many threads as
 * parallel_set_threads() allows.
 *
 * The cut depends on `count` and `grain` only, so results that are kept per block and combined in block order
 * have the same bits for 1 thread and for 64. Index results with `block`, never with a thread id. Bodies run
 * in the default floating-point environment (denormals are kept). Returns when all blocks are done. May be
 * nested.
 */
void parallel_blocks(size_t count, size_t grain, parallel_body *body, void *context);

/** Number of blocks that parallel_blocks() makes. */
static inline size_t parallel_block_count(size_t count, size_t grain) { return (count + grain - 1) / grain; }

/** Seconds that the calls of one thread have taken; those from inside a block are part of its work and span.
 */
typedef struct parallel_account {
    double wall; /* from call to return */
    double work; /* of all blocks, on whatever threads */
    double span; /* of the longest block of each call: more threads do not make it shorter */
} parallel_account;

/** Of the calling thread, since it began. */
parallel_account parallel_account_now(void);

/** What parallel_blocks() runs blocks by, without the account. */
void parallel_run(size_t count, size_t grain, parallel_body *body, void *context);

enum { PARALLEL_THREADS_MAX = 1024 };

void parallel_set_threads(int threads); /* brought into 1 to PARALLEL_THREADS_MAX; process-wide */
int parallel_threads(void);             /* the number set, else machine_threads() of this machine */

/** Name and version of the library behind these, as it runs: "oneTBB 2021.8". Static. */
const char *parallel_library(void);

#ifdef __cplusplus
}
#endif
#endif
