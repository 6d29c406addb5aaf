/* SPDX-License-Identifier: Apache-2.0 */
/* base/paged.c -- large arrays in unnamed files. */
#include "base/paged.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/large_file.h"
#include "base/memory.h"

enum { MAPPINGS_MOST = 128 };
static const size_t least_bytes = (size_t)1 << 16; /* smaller arrays are memory like others */

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct {
    void *start;
    size_t bytes;
} mappings[MAPPINGS_MOST];           /* a free place has no start */
static atomic_size_t resident_limit; /* 0: not started */
static char place[LARGE_FILE_NAME];

gbt_status paged_start(const char *folder, size_t limit, gbt_error *err)
{
    large_file *probe = mem_calloc(1, sizeof *probe, "temporary file", err);
    if (probe == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status = large_file_scratch(folder, probe, err);
    large_file_close(probe, false, NULL);
    mem_free(probe);
    GBT_TRY(status);
    pthread_mutex_lock(&lock);
    snprintf(place, sizeof place, "%s", folder);
    pthread_mutex_unlock(&lock);
    atomic_store(&resident_limit, limit > 0 ? limit : 1);
    return GBT_OK;
}

void paged_stop(void) { atomic_store(&resident_limit, 0); }

/* `bytes` of a new file, mapped; NULL with a message. */
static void *map_file(size_t bytes, const char *what, gbt_error *err)
{
    large_file *file = mem_calloc(1, sizeof *file, what, err);
    if (file == NULL)
        return NULL;
    void *start = MAP_FAILED;
    if (large_file_scratch(place, file, err) == GBT_OK) {
        /* Room on the disk now, or a write to the array would end the process later. */
        const int failed = posix_fallocate(file->descriptor, 0, (off_t)bytes);
        if (failed != 0)
            base_fail(err, GBT_ERR_IO, "%s: no room for %zu bytes of %s: %s", place, bytes, what,
                      strerror(failed));
        else
            start = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file->descriptor, 0);
        if (failed == 0 && start == MAP_FAILED)
            base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for %zu bytes", what, bytes);
    }
    large_file_close(file, false, NULL); /* the mapping keeps it */
    mem_free(file);
    return start == MAP_FAILED ? NULL : start;
}

void *paged_alloc(size_t count, size_t size, const char *what, gbt_error *err)
{
    size_t bytes;
    if (atomic_load(&resident_limit) == 0 || __builtin_mul_overflow(count, size, &bytes) ||
        bytes < least_bytes)
        return mem_alloc(count, size, what, err);
    pthread_mutex_lock(&lock);
    int at = 0;
    while (at < MAPPINGS_MOST && mappings[at].start != NULL)
        at++;
    void *start = NULL;
    if (at < MAPPINGS_MOST) {
        start = map_file(bytes, what, err);
        mappings[at].start = start;
        mappings[at].bytes = bytes;
    }
    pthread_mutex_unlock(&lock);
    return at < MAPPINGS_MOST ? start : mem_alloc(count, size, what, err);
}

void paged_free(void *pointer)
{
    bool mapped = false;
    pthread_mutex_lock(&lock);
    for (int i = 0; i < MAPPINGS_MOST && pointer != NULL && !mapped; i++)
        if (mappings[i].start == pointer) {
            munmap(pointer, mappings[i].bytes);
            mappings[i].start = NULL;
            mapped = true;
        }
    pthread_mutex_unlock(&lock);
    if (!mapped)
        mem_free(pointer);
}

void paged_check(void)
{
    const size_t limit = atomic_load_explicit(&resident_limit, memory_order_relaxed);
    if (limit == 0 || mem_resident_bytes() <= limit)
        return;
    pthread_mutex_lock(&lock);
    for (int i = 0; i < MAPPINGS_MOST; i++)
        if (mappings[i].start != NULL)
            madvise(mappings[i].start, mappings[i].bytes, MADV_DONTNEED); /* of a shared file: values stay */
    pthread_mutex_unlock(&lock);
}

size_t mem_resident_bytes(void)
{
    char text[128];
    unsigned long long total, resident;
    const int fd = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return 0;
    const ssize_t got = read(fd, text, sizeof text - 1);
    close(fd);
    if (got <= 0)
        return 0;
    text[got] = '\0';
    return sscanf(text, "%llu %llu", &total, &resident) == 2
               ? (size_t)resident * (size_t)sysconf(_SC_PAGESIZE)
               : 0;
}
