/* SPDX-License-Identifier: Apache-2.0 */
/* base/memory.c -- checked, aligned allocation with injected failures for tests. */
#include "base/memory.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include "base/fail.h"
#include "base/paged.h"
#include "gbtrace/train.h"

enum { COPY_BYTES = 1 << 22 };
static const size_t LARGE_PAGE = (size_t)2 << 20;

static atomic_long fail_countdown = -1;

static int must_fail(void)
{
    if (atomic_load_explicit(&fail_countdown, memory_order_relaxed) < 0)
        return 0;
    return atomic_fetch_sub(&fail_countdown, 1) == 0;
}

void mem_fail_after(long n) { atomic_store(&fail_countdown, n < 0 ? -1 : n); }

/* mem_alloc() with a report whether the memory is zero, as in a fresh file mapping; `zero` NULL: never use a
   file. */
static void *take(size_t count, size_t size, const char *what, bool *zero, gbt_error *err)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || bytes > PTRDIFF_MAX - LARGE_PAGE) {
        base_fail(err, GBT_ERR_NO_MEMORY, "%s: %zu elements of %zu bytes are more than memory can hold", what,
                  count, size);
        return NULL;
    }
    bytes = (bytes + MEM_ALIGN - 1) / MEM_ALIGN * MEM_ALIGN;
    if (bytes == 0)
        bytes = MEM_ALIGN;
    void *pointer = NULL;
    const bool fails = must_fail();
    if (!fails && zero != NULL && paged_map(bytes, what, &pointer, err) != GBT_OK)
        return NULL;
    if (zero != NULL)
        *zero = pointer != NULL;
    if (pointer != NULL)
        return pointer;
    /* Request huge pages for large arrays: trees are accessed in random order, where TLB misses cost as much
       as cache misses. */
    const bool large = bytes >= 4 * LARGE_PAGE;
    if (!fails)
        pointer = aligned_alloc(large ? LARGE_PAGE : MEM_ALIGN,
                                large ? (bytes + LARGE_PAGE - 1) / LARGE_PAGE * LARGE_PAGE : bytes);
    if (pointer != NULL && large)
        madvise(pointer, bytes, MADV_HUGEPAGE); /* only a hint */
    if (pointer == NULL)
        base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for %zu bytes", what, bytes);
    return pointer;
}

void *mem_alloc(size_t count, size_t size, const char *what, gbt_error *err)
{
    bool zero;
    return take(count, size, what, &zero, err);
}

void *mem_calloc(size_t count, size_t size, const char *what, gbt_error *err)
{
    bool zero;
    void *pointer = take(count, size, what, &zero, err);
    if (pointer != NULL && !zero)
        memset(pointer, 0, count * size);
    return pointer;
}

gbt_status mem_check(size_t count, size_t size, const char *what, gbt_error *err)
{
    void *volatile room = take(count, size, what, NULL, err); /* volatile: otherwise the compiler would remove
                                                                 both calls */
    free(room);
    return room != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

void mem_copy(void *to, const void *from, size_t bytes)
{
    for (size_t at = 0; at < bytes; at += COPY_BYTES) {
        memcpy((char *)to + at, (const char *)from + at, bytes - at < COPY_BYTES ? bytes - at : COPY_BYTES);
        paged_check();
    }
}

gbt_status mem_reserve(void **array, size_t *capacity, size_t used, size_t count, size_t size,
                       const char *what, gbt_error *err)
{
    if (count <= *capacity && *array != NULL)
        return GBT_OK;
    size_t grown = *capacity + *capacity / 2;
    if (grown < count)
        grown = count;
    void *bigger = mem_alloc(grown, size, what, err);
    if (bigger == NULL)
        return GBT_ERR_NO_MEMORY;
    if (used > 0)
        mem_copy(bigger, *array, used * size);
    mem_free(*array);
    *array = bigger;
    *capacity = grown;
    return GBT_OK;
}

gbt_status mem_trim(void **array, size_t *capacity, size_t used, size_t size, const char *what,
                    gbt_error *err)
{
    if (used == *capacity)
        return GBT_OK;
    void *exact = mem_alloc(used, size, what, err);
    if (exact == NULL)
        return GBT_ERR_NO_MEMORY;
    if (used > 0)
        mem_copy(exact, *array, used * size);
    mem_free(*array);
    *array = exact;
    *capacity = used;
    return GBT_OK;
}

void mem_free(void *pointer)
{
    if (!paged_unmap(pointer))
        free(pointer);
}

/* VmHWM is preferred to ru_maxrss, which includes the memory of the program that this process ran before
   exec(). */
size_t mem_peak_bytes(void)
{
    char line[128];
    unsigned long long kilobytes = 0;
    struct rusage usage;
    FILE *status = fopen("/proc/self/status", "re");
    while (status != NULL && kilobytes == 0 && fgets(line, sizeof line, status) != NULL)
        sscanf(line, "VmHWM: %llu", &kilobytes);
    if (status != NULL)
        fclose(status);
    if (kilobytes == 0 && getrusage(RUSAGE_SELF, &usage) == 0)
        kilobytes = (unsigned long long)usage.ru_maxrss;
    return (size_t)kilobytes * 1024;
}

size_t gbt_peak_memory(void) { return mem_peak_bytes(); }
