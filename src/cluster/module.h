/* SPDX-License-Identifier: Apache-2.0 */
/* cluster/module.h -- the interface of a loadable module: MPI as gbtrace sees it. */
#ifndef GBT_CLUSTER_MODULE_H
#define GBT_CLUSTER_MODULE_H

/* Counts and offsets are in 32-bit words. */
typedef struct cluster_module {
    int version; /* CLUSTER_MODULE_VERSION */
    void (*open)(int *rank, int *size);
    void (*gather)(const void *mine, int count, void *all, const int *counts, const int *offsets);
    void (*exchange)(const void *send, const int *send_counts, const int *send_offsets, void *all,
                     const int *counts, const int *offsets);
    void (*broadcast)(void *data, int count);
    void (*close)(void);
    void (*abort)(int exit_code);
} cluster_module;

enum { CLUSTER_MODULE_VERSION = 1 };
#define CLUSTER_MODULE_SYMBOL "gbt_cluster_module"

#endif
