/* SPDX-License-Identifier: Apache-2.0 */
/* tests/child.h -- work in a process of its own, whose memory is not that of other tests. */
#ifndef GBT_TEST_CHILD_H
#define GBT_TEST_CHILD_H

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test_support.h"

/** @return the process's largest resident memory, bytes. `exit_code`: what `work` returned. */
static inline size_t in_child(int (*work)(void *), void *context, int *exit_code)
{
    struct rusage used;
    int ended;
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0)
        _exit(work(context));
    assert_int_equal(wait4(child, &ended, 0, &used), child);
    assert_true(WIFEXITED(ended));
    *exit_code = WEXITSTATUS(ended);
    return (size_t)used.ru_maxrss * 1024;
}

#endif
