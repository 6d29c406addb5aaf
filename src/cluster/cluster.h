/* SPDX-License-Identifier: Apache-2.0 */
/* cluster/cluster.h -- communication between the processes of a run (gbtrace/cluster.h: how they join).

   These are collective calls: all processes make them in the same order, on one thread. In a process that is
   alone they return its own data. Any communication failure ends all processes, which is MPI's default. */
#ifndef GBT_CLUSTER_CLUSTER_H
#define GBT_CLUSTER_CLUSTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "gbtrace/cluster.h"

enum { CLUSTER_SIZE_MAX = 4096 };

static inline bool cluster_leads(void) { return gbt_cluster_rank() == 0; }

/**
 * Every process gets the data of all processes, in order of rank (MPI_Allgatherv).
 *
 * @param mine   [in]  [counts[rank]]
 * @param counts [in]  [size] number of 32-bit words of each process; the same on all
 * @param all    [out] the data of all processes, one after the other
 */
void cluster_gather(const void *mine, const size_t *counts, void *all);

/** Every process sends a part to each process, and receives a part from each (MPI_Alltoallv). `send_counts`
    and `counts`: [size] number of 32-bit words sent to and received from each; the parts follow each other.
    */
void cluster_exchange(const void *send, const size_t *send_counts, void *all, const size_t *counts);

/** Every process gets the data of the first process. */
void cluster_broadcast(void *data, size_t bytes);

/** Every process gets the first failure, in order of rank, with its message; GBT_OK if none failed. */
gbt_status cluster_agree(gbt_status status, gbt_error *err);

/** Every process gets the status of the first process, with its message. */
gbt_status cluster_follow(gbt_status status, gbt_error *err);

/** on: from now on this process works independently, as if it were alone; off: no longer. */
void cluster_stand_alone(bool on);

/** Bytes that this process has sent so far (or received, in calls where all processes get the same), and the
    seconds spent in these calls. */
typedef struct cluster_traffic {
    uint64_t bytes;
    double seconds;
} cluster_traffic;
cluster_traffic cluster_traffic_so_far(void);

#endif
