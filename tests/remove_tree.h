/* SPDX-License-Identifier: Apache-2.0 */
/* tests/remove_tree.h -- a folder and all that is in it, removed. */
#ifndef GBT_TEST_REMOVE_TREE_H
#define GBT_TEST_REMOVE_TREE_H

#include <ftw.h>
#include <stdio.h>

static inline int remove_tree_entry(const char *path, const struct stat *info, int kind, struct FTW *walk)
{
    (void)info;
    (void)kind;
    (void)walk;
    return remove(path);
}

/** 0, or what nftw() returns of a failure. */
static inline int remove_tree(const char *folder)
{
    return nftw(folder, remove_tree_entry, 16, FTW_DEPTH | FTW_PHYS);
}

#endif
