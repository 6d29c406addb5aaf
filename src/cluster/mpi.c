/* SPDX-License-Identifier: Apache-2.0 */
/* cluster/mpi.c -- the loadable module: implements the interface with collective calls of MPI 3.

   It is built once for each installed MPI, and loaded in processes that were started by that MPI's mpirun.
   MPI's default error handler is kept: it ends all processes. */
#include <mpi.h>
#include <stddef.h>

#include "cluster/module.h"

static void join(int *rank, int *size)
{
    int provided;
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, rank);
    MPI_Comm_size(MPI_COMM_WORLD, size);
}

static void gather(const void *mine, int count, void *all, const int *counts, const int *offsets)
{
    MPI_Allgatherv(mine, count, MPI_INT32_T, all, counts, offsets, MPI_INT32_T, MPI_COMM_WORLD);
}

static void exchange(const void *send, const int *send_counts, const int *send_offsets, void *all,
                     const int *counts, const int *offsets)
{
    MPI_Alltoallv(send, send_counts, send_offsets, MPI_INT32_T, all, counts, offsets, MPI_INT32_T,
                  MPI_COMM_WORLD);
}

static void broadcast(void *data, int count) { MPI_Bcast(data, count, MPI_INT32_T, 0, MPI_COMM_WORLD); }

static void leave(void) { MPI_Finalize(); }

static void end_all(int exit_code) { MPI_Abort(MPI_COMM_WORLD, exit_code); }

__attribute__((visibility("default"))) extern const cluster_module gbt_cluster_module;
const cluster_module gbt_cluster_module = {.version = CLUSTER_MODULE_VERSION,
                                           .open = join,
                                           .gather = gather,
                                           .exchange = exchange,
                                           .broadcast = broadcast,
                                           .close = leave,
                                           .abort = end_all};
