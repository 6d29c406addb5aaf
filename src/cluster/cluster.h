/* SPDX-License-Identifier: Apache-2.0 */
/* cluster/cluster.h -- what the processes of a run tell each other (gbtrace/cluster.h has how they meet).

   Every call is made by all processes, in the same order, on one thread; a process that is alone is told what
   it has said. Whatever goes wrong on the way ends all processes: MPI's own rule. */
#ifndef GBT_CLUSTER_CLUSTER_H
#define GBT_CLUSTER_CLUSTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/cluster.h"

enum { CLUSTER_SIZE_MAX = 4096 };

static inline bool cluster_leads(void) { return gbt_cluster_rank() == 0; }

/** Everybody gets what everybody has, in the order of the processes.
    @param mine  [in] [counts[rank]]
    @param counts [in] [size] of 32-bit words; the same for all
    @param all   [out] their sum */
void cluster_gather(const void *mine, const size_t *counts, void *all);

/** A part for each process, and from each a part. `send_counts` and `counts`: [size] 32-bit words that go to,
   and come from, each; parts lie one after the other. */
void cluster_exchange(const void *send, const size_t *send_counts, void *all, const size_t *counts);

/** What the first process has becomes everybody's. */
void cluster_broadcast(void *data, size_t bytes);

/** The first failure, in the order of the processes, becomes everybody's, with its line. */
gbt_status cluster_agree(gbt_status status, gbt_error *err);

/** The first process's status becomes everybody's, with its line. */
gbt_status cluster_follow(gbt_status status, gbt_error *err);

/** From now on, or no longer, this process does something of its own: as if it were alone. */
void cluster_apart(bool on);

/** What this process has sent to others so far, or received where all get the same; and how long it was in
   these calls. */
typedef struct cluster_traffic {
    uint64_t bytes;
    double seconds;
} cluster_traffic;
cluster_traffic cluster_traffic_so_far(void);

#endif
