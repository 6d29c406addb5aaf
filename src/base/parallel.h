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
 * The division depends only on `count` and `grain`, so results that are kept per block and combined in block
 * order have the same bits for any number of threads. Index results with `block`, never with a thread id.
 * Bodies run in the default floating-point environment (denormals are kept). Returns when all blocks are
 * done. May be nested.
 */
void parallel_blocks(size_t count, size_t grain, parallel_body *body, void *context);

/** Number of blocks that parallel_blocks() makes. */
static inline size_t parallel_block_count(size_t count, size_t grain) { return (count + grain - 1) / grain; }

/** Seconds spent in the calls of one thread; nested calls are part of the work and span of their block. */
typedef struct parallel_account {
    double wall; /* from call to return */
    double work; /* of all blocks, over all threads */
    double span; /* sum of the longest block of each call: a lower bound for any number of threads */
} parallel_account;

/** Account of the calling thread since its start. */
parallel_account parallel_account_now(void);

/** parallel_blocks() without accounting. */
void parallel_run(size_t count, size_t grain, parallel_body *body, void *context);

enum { PARALLEL_THREADS_MAX = 1024 };

void parallel_set_threads(int threads); /* clamped to [1, PARALLEL_THREADS_MAX]; process-wide */
int parallel_threads(void);             /* the number set, else machine_threads() of this machine */

/** Name and version of the loaded scheduler library: "oneTBB 2021.8". Static. */
const char *parallel_library(void);

#ifdef __cplusplus
}
#endif
#endif
