/* SPDX-License-Identifier: Apache-2.0 */
/* base/paged.c -- large arrays in unnamed files. */
#include "base/paged.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/fail.h"
#include "base/unnamed_file.h"

enum {
    MAPPINGS_MOST = 1 << 15, /* half of Linux's default limit per process (vm.max_map_count) */
    PAGE_LEAST = 4096
};

typedef struct mapping {
    void *start;
    size_t bytes;
} mapping;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static mapping *mappings; /* sorted by `start` */
static size_t mapping_capacity;
static atomic_size_t mapping_count;
static atomic_size_t resident_limit; /* 0: not started */
static atomic_size_t page_out_above; /* threshold for paging out: the limit, or slightly more than what cannot
                                      be paged out if that is larger */
static char place[4096];

gbt_status paged_start(const char *folder, size_t limit, gbt_error *err)
{
    int probe;
    GBT_TRY(unnamed_file_open(folder, &probe, err));
    close(probe);
    pthread_mutex_lock(&lock);
    snprintf(place, sizeof place, "%s", folder);
    pthread_mutex_unlock(&lock);
    atomic_store(&page_out_above, limit);
    atomic_store(&resident_limit, limit > 0 ? limit : 1);
    return GBT_OK;
}

void paged_stop(void) { atomic_store(&resident_limit, 0); }

static gbt_status map_file(size_t bytes, const char *what, void **out, gbt_error *err)
{
    int file;
    gbt_error why = {0};
    if (unnamed_file_open(place, &file, &why) != GBT_OK)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s", why.text);
    /* Reserve disk space now; otherwise a later write to the array on a full disk would kill the process. */
    const int failed = posix_fallocate(file, 0, (off_t)bytes);
    void *start = failed == 0 ? mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0) : MAP_FAILED;
    close(file); /* the mapping keeps the file alive */
    if (failed != 0)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no room for %zu bytes of %s: %s", place, bytes, what,
                         strerror(failed));
    if (start == MAP_FAILED)
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for %zu bytes", what, bytes);
    *out = start;
    return GBT_OK;
}

/* Index of the mapping that begins at `start`, or where it would be inserted. */
static size_t place_of(const void *start)
{
    size_t low = 0, high = atomic_load(&mapping_count);
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if ((uintptr_t)mappings[middle].start < (uintptr_t)start)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Does not use mem_reserve(), which would recurse. */
static bool reserve_one(void)
{
    if (atomic_load(&mapping_count) < mapping_capacity)
        return true;
    const size_t capacity = 2 * mapping_capacity + 64;
    mapping *more = realloc(mappings, capacity * sizeof *more);
    if (more == NULL)
        return false;
    mappings = more;
    mapping_capacity = capacity;
    return true;
}

static gbt_status map_one(size_t bytes, const char *what, void **out, gbt_error *err)
{
    const size_t count = atomic_load(&mapping_count);
    if (count >= MAPPINGS_MOST)
        return GBT_OK;
    if (!reserve_one())
        return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for %zu bytes", what, bytes);
    GBT_TRY(map_file(bytes, what, out, err));
    const size_t at = place_of(*out);
    memmove(mappings + at + 1, mappings + at, (count - at) * sizeof *mappings);
    mappings[at] = (mapping){*out, bytes};
    atomic_store(&mapping_count, count + 1);
    return GBT_OK;
}

gbt_status paged_map(size_t bytes, const char *what, void **out, gbt_error *err)
{
    *out = NULL;
    if (atomic_load_explicit(&resident_limit, memory_order_relaxed) == 0 || bytes < PAGED_LEAST_BYTES)
        return GBT_OK;
    pthread_mutex_lock(&lock);
    const gbt_status status = map_one(bytes, what, out, err);
    pthread_mutex_unlock(&lock);
    return status;
}

bool paged_unmap(void *pointer)
{
    if (pointer == NULL || atomic_load_explicit(&mapping_count, memory_order_relaxed) == 0 ||
        (uintptr_t)pointer % PAGE_LEAST != 0)
        return false;
    pthread_mutex_lock(&lock);
    const size_t at = place_of(pointer), count = atomic_load(&mapping_count);
    const bool found = at < count && mappings[at].start == pointer;
    if (found) {
        munmap(pointer, mappings[at].bytes);
        memmove(mappings + at, mappings + at + 1, (count - at - 1) * sizeof *mappings);
        atomic_store(&mapping_count, count - 1);
    }
    pthread_mutex_unlock(&lock);
    return found;
}

/* When more than the limit cannot be paged out, the threshold is raised, because trying in every call would
   only cost time. */
void paged_check(void)
{
    const size_t limit = atomic_load_explicit(&resident_limit, memory_order_relaxed);
    if (limit == 0 || mem_resident_bytes() <= atomic_load_explicit(&page_out_above, memory_order_relaxed))
        return;
    pthread_mutex_lock(&lock);
    for (size_t i = 0; i < atomic_load(&mapping_count); i++)
        madvise(mappings[i].start, mappings[i].bytes, MADV_DONTNEED); /* a shared file mapping: values are
                                                                         kept in the file */
    const size_t stays = mem_resident_bytes() + limit / 16;
    atomic_store(&page_out_above, stays > limit ? stays : limit);
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
