/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/cluster.h -- several processes that share one task, on one machine or many, started by MPI's
   mpirun. */
#ifndef GBTRACE_CLUSTER_H
#define GBTRACE_CLUSTER_H

#include "gbtrace/status.h"

GBT_API_BEGIN

/**
 * Join the processes that mpirun has started, if this process is one of them; gbt_train() and others then
 * share their work. All processes must make the same calls in the same order. A process that does not call
 * this, or was not started by mpirun, works alone.
 *
 * Standard output and standard error of all processes but the first are closed: only the first one prints.
 *
 * The library does not link MPI. This call loads a module for it, one for Open MPI and one for MPICH; each
 * exists where that MPI was found at build time (docs/cluster.md).
 *
 * @return GBT_OK, or GBT_ERR_IO when the module is missing or cannot be loaded
 * Threads: before any other call, on the thread that makes all further ones.
 */
gbt_status gbt_cluster_open(gbt_error *err);

/** Rank of this process, from 0, and number of processes; 0 and 1 for a process that works alone. */
int gbt_cluster_rank(void);
int gbt_cluster_size(void);

/**
 * Leave the group; call it before the process ends. Afterwards the process works alone. A failure that only
 * this process has seen ends the others too, and this process prints it on standard error.
 *
 * @param exit_code [in] with which this process will end
 * @param error     [in] one line; NULL: no failure, or it was already printed
 */
void gbt_cluster_close(int exit_code, const char *error);

GBT_API_END
#endif
