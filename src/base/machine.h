/* SPDX-License-Identifier: Apache-2.0 */
/* base/machine.h -- the processors and memory that this process may use. */
#ifndef GBT_BASE_MACHINE_H
#define GBT_BASE_MACHINE_H

#include <stddef.h>

typedef struct machine {
    char processor[128];       /* name; "" when unknown */
    int processors;            /* in the machine, >= 1 */
    int processors_allowed;    /* available to this process, >= 1 */
    double processors_quota;   /* quota of its control group, in processors; infinite: none */
    size_t memory_bytes;       /* of the machine; 0: unknown */
    size_t memory_free_bytes;  /* available without swapping; 0: unknown */
    size_t memory_limit_bytes; /* the smallest limit: control group, address space; SIZE_MAX: none */
} machine;

/**
 * Read /proc and /sys/fs/cgroup (version 2, else 1; the group of this process and all above it).
 *
 * @param root [in] prefix of these paths: "" (tests use their own trees). What cannot be read counts as no
 * limit. Threads: any.
 */
machine machine_read(const char *root);

/**
 * Useful number of threads: the processors available to this process, at most its group's quota, rounded; >=
 * 1.
 *
 * More threads would only wait: a group that has used up its quota is suspended until the next period.
 */
int machine_threads(const machine *m);

#endif
