/* SPDX-License-Identifier: Apache-2.0 */
/* trace/list_build.h -- which Gaussians each tile of a picture may see, for rays that all start at one
   point. */
#ifndef GBT_TRACE_LIST_BUILD_H
#define GBT_TRACE_LIST_BUILD_H

#include "trace/list_kernel.h"
#include "trace/rays.h"

/** The lists of one view, and the memory they are made in, used again from view to view. Start from {0}. */
typedef struct list_builder {
    list_view view;
    struct record_batch *batches; /* internal, as all that follows */
    uint32_t *histogram;          /* [batches][parts] */
    uint8_t *tile_faces;          /* [tiles] bit per face that sees the tile */
    size_t part_capacity, part_box_capacity, box16_capacity, box256_capacity, tile_face_capacity,
        reached_capacity, record_capacity, kept_capacity, pair_capacity, first_capacity, batch_capacity,
        histogram_capacity, slot_capacity, slot_used_capacity;
} list_builder;

/**
 * Make the lists for `rays`.
 *
 * @param usable [out] false: these rays do not start at one point, or too many Gaussians are near that point:
 *                     there are no lists, and the tree has to be walked
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 * Threads: uses all; the same lists for every thread count.
 */
gbt_status list_builder_make(list_builder *lists, const list_kernel *kernel, const kernel_scene *scene,
                             const gaussians *g, const ray_image *rays, bool *usable, gbt_error *err);

/** Memory for what the adjoint leaves. GBT_OK or GBT_ERR_NO_MEMORY. */
gbt_status list_builder_reserve_slots(list_builder *lists, gbt_error *err);

/** Bytes that the records and pairs of the lists take, with their room to spare; not what is per tile, and
   not what the adjoint leaves. */
size_t list_builder_bytes(const list_builder *lists);

void list_builder_free(list_builder *lists); /* back to {0} */

#endif
