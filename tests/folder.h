/* SPDX-License-Identifier: Apache-2.0 */
/* tests/folder.h -- a folder of its own for a test's files, and what tests do with files. */
#ifndef GBT_TEST_FOLDER_H
#define GBT_TEST_FOLDER_H

#include "test_support.h"

#include <dirent.h>
#include <ftw.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"

static char test_folder[256];

/** A set-up of cmocka, for a group or a test: an empty folder, in TMPDIR or /tmp. */
static inline int folder_make(void **state)
{
    (void)state;
    const char *root = getenv("TMPDIR");
    snprintf(test_folder, sizeof test_folder, "%.200s/gbt_test_XXXXXX", root != NULL ? root : "/tmp");
    return mkdtemp(test_folder) == NULL;
}

static inline int remove_entry(const char *path, const struct stat *info, int kind, struct FTW *walk)
{
    (void)info;
    (void)kind;
    (void)walk;
    return remove(path);
}

/** A folder and all that is in it: 0, or what nftw() returns of a failure. */
static inline int remove_tree(const char *path) { return nftw(path, remove_entry, 16, FTW_DEPTH | FTW_PHYS); }

/** The tear-down. */
static inline int folder_remove(void **state)
{
    (void)state;
    return remove_tree(test_folder);
}

/** A path below test_folder. It stays as long as the program runs. */
__attribute__((format(printf, 1, 2))) static inline const char *in_folder(const char *format, ...)
{
    static struct kept {
        struct kept *before; /* else they would be leaks */
        char path[512];
    } * last;
    struct kept *k = calloc(1, sizeof *k);
    assert_non_null(k);
    k->before = last;
    last = k;
    const int length = snprintf(k->path, sizeof k->path, "%s/", test_folder);
    va_list list;
    va_start(list, format);
    vsnprintf(k->path + length, sizeof k->path - (size_t)length, format, list);
    va_end(list);
    return k->path;
}

/** The folder that the file is to be in is made. */
static inline void make_folder_of(const char *path)
{
    char parent[512];
    snprintf(parent, sizeof parent, "%.*s", (int)(strrchr(path, '/') - path), path);
    assert_ok(file_make_folder(parent, &assert_ok_err_));
}

static inline void write_text(const char *path, const char *text)
{
    make_folder_of(path);
    assert_ok(file_write_atomic(path, text, strlen(text), &assert_ok_err_));
}

typedef struct file_bytes {
    unsigned char *data; /* a zero byte behind them; free with mem_free() */
    size_t count;
} file_bytes;

static inline file_bytes read_bytes(const char *path)
{
    file_bytes b;
    assert_ok(file_read(path, &b.data, &b.count, &assert_ok_err_));
    return b;
}

static inline void copy_file(const char *from, const char *to)
{
    file_bytes b = read_bytes(from);
    make_folder_of(to);
    assert_ok(file_write_atomic(to, b.data, b.count, &assert_ok_err_));
    mem_free(b.data);
}

static inline bool is_same_file(const char *a, const char *b)
{
    file_bytes x = read_bytes(a), y = read_bytes(b);
    const bool same = x.count == y.count && memcmp(x.data, y.data, x.count) == 0;
    mem_free(x.data);
    mem_free(y.data);
    return same;
}

static inline void assert_same_file(const char *a, const char *b)
{
    if (!is_same_file(a, b))
        fail_msg("%s and %s differ", a, b);
}

/** Entries of a folder, without . and .. */
static inline int count_files(const char *path)
{
    int count = 0;
    DIR *folder = opendir(path);
    assert_non_null(folder);
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;)
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(folder);
    return count;
}

#endif
