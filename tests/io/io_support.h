/* SPDX-License-Identifier: Apache-2.0 */
/* tests/io/io_support.h -- a folder of its own for a test's files. */
#ifndef GBT_TEST_IO_SUPPORT_H
#define GBT_TEST_IO_SUPPORT_H

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "test_support.h"

static char test_folder[256];

static inline int make_test_folder(void **state)
{
    (void)state;
    const char *root = getenv("TMPDIR");
    snprintf(test_folder, sizeof test_folder, "%.200s/gbt_io_XXXXXX", root != NULL ? root : "/tmp");
    return mkdtemp(test_folder) != NULL ? 0 : -1;
}

static inline int remove_test_folder(void **state)
{
    (void)state;
    char path[1024];
    DIR *folder = opendir(test_folder);
    if (folder == NULL)
        return -1;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        snprintf(path, sizeof path, "%s/%s", test_folder, entry->d_name);
        unlink(path);
    }
    closedir(folder);
    return rmdir(test_folder);
}

static inline const char *test_path(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", test_folder, name);
    return path;
}

/** Two files of test_folder hold the same bytes. */
static inline void assert_same_files(const char *name_a, const char *name_b)
{
    unsigned char *a, *b;
    size_t a_count, b_count;
    assert_ok(file_read(test_path(name_a), &a, &a_count, NULL));
    assert_ok(file_read(test_path(name_b), &b, &b_count, NULL));
    assert_int_equal(a_count, b_count);
    assert_memory_equal(a, b, a_count);
    mem_free(a);
    mem_free(b);
}

/** Files in a folder, without . and .. */
static inline int count_files(const char *path)
{
    int count = 0;
    DIR *folder = opendir(path);
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;)
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(folder);
    return count;
}

#endif
