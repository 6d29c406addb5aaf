/* SPDX-License-Identifier: Apache-2.0 */
/* base/machine.h -- what this process may use of the machine: processors, memory, and who limits them. */
#ifndef GBT_BASE_MACHINE_H
#define GBT_BASE_MACHINE_H

#include <stddef.h>

typedef struct machine {
    char processor[128];       /* its name, "" when it is not known */
    int processors;            /* in the machine, >= 1 */
    int processors_allowed;    /* that this process may run on, >= 1 */
    double processors_quota;   /* of its control group, in processors; infinite: none */
    size_t memory_bytes;       /* in the machine; 0: not known */
    size_t memory_free_bytes;  /* that can be had without swapping; 0: not known */
    size_t memory_limit_bytes; /* the smallest limit: control group, address space; SIZE_MAX: none */
} machine;

/**
 * Read /proc and /sys/fs/cgroup (version 2, else 1; the group of this process and all above it).
 *
 * @param root [in] put in front of these paths: "" (tests have trees of their own)
 * What cannot be read is as without a limit. Threads: any.
 */
machine machine_read(const char *root);

/**
 * Threads that find processor time: the processors this process may run on, at most its group's quota,
 * rounded; >= 1.
 *
 * More of them would only wait for each other: a group that has used up its time stands still until the next
 * period.
 */
int machine_threads(const machine *m);

#endif
