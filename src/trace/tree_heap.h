/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_heap.h -- nodes and leaves of a tree waiting for their turn, nearest first. */
#ifndef GBT_TRACE_TREE_HEAP_H
#define GBT_TRACE_TREE_HEAP_H

#include <stdint.h>

typedef struct heap_entry {
    float t;        /* lower bound of every t_c inside */
    uint64_t child; /* as in tree_node */
} heap_entry;

static inline void heap_push(heap_entry *heap, int *count, float t, uint64_t child)
{
    int i = (*count)++;
    while (i > 0) {
        const int parent = (i - 1) / 2;
        if (heap[parent].t <= t)
            break;
        heap[i] = heap[parent];
        i = parent;
    }
    heap[i] = (heap_entry){t, child};
}

static inline uint64_t heap_pop(heap_entry *heap, int *count)
{
    const uint64_t top = heap[0].child;
    const heap_entry last = heap[--*count];
    int i = 0;
    for (;;) {
        int child = 2 * i + 1;
        if (child >= *count)
            break;
        if (child + 1 < *count && heap[child + 1].t < heap[child].t)
            child++;
        if (heap[child].t >= last.t)
            break;
        heap[i] = heap[child];
        i = child;
    }
    heap[i] = last;
    return top;
}

#endif
