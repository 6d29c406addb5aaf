/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/cluster.h -- several processes at one task, on one machine or many, started by MPI's mpirun. */
#ifndef GBTRACE_CLUSTER_H
#define GBTRACE_CLUSTER_H

#include "gbtrace/status.h"

GBT_API_BEGIN

/**
 * Join the processes that mpirun has started, if this one was started by it; gbt_train() and others then
 * share their work. All processes make the same calls in the same order. Without it, and without mpirun, a
 * process is alone.
 *
 * Standard output and standard error of all processes but the first are closed: what there is to tell, the
 * first one tells.
 *
 * MPI itself is in a module that is loaded here and nowhere else: one for Open MPI, one for MPICH, built
 * where these were (docs/cluster.md).
 *
 * @return GBT_OK, GBT_ERR_IO: the module is missing or cannot be loaded
 * Threads: before any other call, on the thread that makes all further ones.
 */
gbt_status gbt_cluster_open(gbt_error *err);

/** Which process this is, from 0 on, and how many there are; 0 and 1 for one that is alone. */
int gbt_cluster_rank(void);
int gbt_cluster_size(void);

/**
 * Leave, before the process ends; from then on it is alone. A failure that the others do not know of ends
 * them too, and is told on standard error by the process that has it.
 *
 * @param exit_code [in] with which this process ends
 * @param error     [in] one line; NULL: none, or it was told
 */
void gbt_cluster_close(int exit_code, const char *error);

GBT_API_END
#endif
