/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_kernel.h -- the interface between list_build.c, trace.c, gradients.c and the kernels over lists,
   which are written once (list_kernel.inc.h) and compiled per instruction set. */
#ifndef GBT_TRACE_LIST_KERNEL_H
#define GBT_TRACE_LIST_KERNEL_H

#include "base/cpu.h"
#include "base/gaussians.h"
#include "trace/list_view.h"

/* Memory of one tile in flight. Start from {0}. */
typedef struct list_scratch {
    float *list; /* the tile's Gaussians, list16.h */
    size_t list_capacity;
    float *rows; /* of a packet, list_rows16.h */
    size_t row_capacity;
    void *hits; /* of one ray */
    size_t hit_bytes;
    gradient_slot *sums;
    size_t sum_capacity;
} list_scratch;

static inline void list_scratch_free(list_scratch *s)
{
    mem_free(s->list);
    mem_free(s->rows);
    mem_free(s->hits);
    mem_free(s->sums);
    *s = (list_scratch){0};
}

typedef struct list_kernel {
    /** Set view->reached of the Gaussians of a block, and count them in view->kept. */
    void (*find_reached)(const kernel_scene *scene, const gaussians *g, list_view *view, size_t block);
    /** Write the records of those Gaussians of a block that can be seen within the bounds of a face, in
        order. `reached`: a word for each sixteen, with a bit per Gaussian that may be seen; NULL: all may
        be. */
    list_kept (*make_records)(const kernel_scene *scene, const gaussians *g, const list_face *face,
                              size_t block, const uint16_t *reached, list_record *records,
                              list_shape *shapes);
    /** The parts of a face in which a record may be hit, in order; returns how many. `parts` has room for
        sixteen more than the face has. */
    size_t (*find_parts)(const list_view *view, const list_face *face, size_t record, uint32_t *parts);
    /** Trace a part of a tile, as a tree_forward_fn traces a tile. */
    bool (*forward)(const kernel_scene *scene, const list_view *view, size_t part, const tile_rays *rays,
                    packet_output out[TILE_PACKETS], hit_tape *tape, list_scratch *scratch,
                    kernel_counters *counters);
    /** Its adjoint, into the slots of the part's pairs. */
    bool (*backward)(const kernel_scene *scene, list_view *view, size_t part, const tile_rays *rays,
                     float d_rgb[TILE_PACKETS][3][PACKET_LANES], const hit_tape *tape, list_scratch *scratch);
    /** Sums of the records [begin, end) of a face, a block at most, over their slots, turned into the
        Gaussians' own axes. */
    void (*turn_sums)(const kernel_scene *scene, const list_view *view, const list_face *face, size_t begin,
                      size_t end, block_sums *out);
} list_kernel;

CPU_DECLARE_VARIANTS(list_kernel, list_kernel);

#endif
