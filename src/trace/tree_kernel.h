/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tree_kernel.h -- the interface between trace.c and the kernels that walk a tree, which are written
   once (tree_kernel.inc.h) and compiled per instruction set. */
#ifndef GBT_TRACE_TREE_KERNEL_H
#define GBT_TRACE_TREE_KERNEL_H

#include "base/cpu.h"
#include "trace/kernel.h"

/* Growing scratch of one worker. Start from {0}. */
typedef struct tree_scratch {
    float *rows;
    size_t row_capacity; /* floats */
    void *hits;
    size_t hit_bytes;
    struct heap_entry *heap;
    size_t heap_capacity;
    struct lane_hit {
        ray_hit hit;
        uint32_t lane;
    } * lane_hits;
    size_t lane_hit_capacity;
} tree_scratch;

/** Trace a tile. `tape` is NULL when no adjoint will follow. False when memory ran out. */
typedef bool tree_forward_fn(const kernel_scene *scene, const tile_rays *rays,
                             packet_output out[TILE_PACKETS], hit_tape *tape, tree_scratch *scratch,
                             kernel_counters *counters);

/**
 * Adjoint of a tile: replay the hits that forward left on the tape, add to the record of every Gaussian that
 * was blended.
 *
 * @param d_rgb [in] dL/d(rgb)
 */
typedef bool tree_backward_fn(const kernel_scene *scene, const tile_rays *rays,
                              float d_rgb[TILE_PACKETS][3][PACKET_LANES], const tape_entry *tape,
                              gradient_list *out, tree_scratch *scratch);

typedef struct tree_kernel {
    tree_forward_fn *forward, *forward_single,
        *forward_embree; /* in tiles; ray by ray; by Embree's traversal */
    tree_backward_fn *backward;
} tree_kernel;

CPU_DECLARE_VARIANTS(tree_kernel, tree_kernel);

#endif
