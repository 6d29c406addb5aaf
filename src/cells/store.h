/* SPDX-License-Identifier: Apache-2.0 */
/* cells/store.h -- the Gaussians of a plain .ply in a temporary file, sorted by place: chunks of rows, which
   are the leaves of a k-d tree over the means. One pass over the .ply, in bounded memory. */
#ifndef GBT_CELLS_STORE_H
#define GBT_CELLS_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/large_file.h"

/** Floats of a row before the harmonics: number in the .ply (its bits), mean, scale_log, quaternion, opacity.
 */
enum {
    CELL_ROW_NUMBER,
    CELL_ROW_MEAN,
    CELL_ROW_SCALE = 4,
    CELL_ROW_QUAT = 7,
    CELL_ROW_OPACITY = 11,
    CELL_ROW_SH
};

/** A leaf of the tree. Its Gaussians reach out of its box: see `sigma`. */
typedef struct cell_chunk {
    size_t count;
    float low[3], high[3];              /* of the means, local */
    float sigma[3];                     /* largest std-dev along each axis */
    uint32_t first_extent, last_extent; /* valid when count > 0 */
} cell_chunk;

/** Consecutive rows of one chunk in the file, in the order of the .ply. */
typedef struct cell_extent {
    uint64_t at;
    uint32_t count, next; /* next: next extent of the same chunk; not set in the last */
} cell_extent;

/** Node i of the tree is cut at `at` along `axis` (local coordinates); its children are nodes 2 i + 1 (below)
   and 2 i + 2; those from chunk_count - 1 on are chunks. */
typedef struct cell_cut {
    int axis;
    float at;
} cell_cut;

typedef struct cell_store {
    size_t count;     /* Gaussians */
    double origin[3]; /* middle of the means, in the coordinates of the file; local coordinates are relative
                         to it */
    double middle[3]; /* the same in the coordinates of the rows */
    int sh_degree;
    bool antialiased; /* as in gaussian_cloud */
    float near;
    size_t chunk_count; /* a power of two */
    cell_chunk *chunks;
    cell_cut *cuts; /* [chunk_count - 1] */
    cell_extent *extents;
    size_t extent_count, extent_capacity;
    size_t row_floats;
    large_file rows;
} cell_store;

/**
 * Sort a .ply.
 *
 * @param folder     [in]  where the temporary file is made: as large as the .ply, gone with the store
 * @param memory     [in]  bytes that this may take, some 64 MB at least
 * @param chunk_rows [in]  about how many Gaussians a chunk has; 0: as suits
 * @param out        [out] start from {0}; free with cell_store_free() after success or failure
 * @return GBT_OK; as gaussian_ply_open(); GBT_ERR_FORMAT also when no Gaussian remains; GBT_ERR_IO;
 *         GBT_ERR_NO_MEMORY
 * Local coordinates, and so pictures, are those of the same file read whole.
 * Threads: uses all; the same store for every thread count.
 */
gbt_status cell_store_make(const char *ply, const char *folder, size_t memory, size_t chunk_rows,
                           cell_store *out, gbt_error *err);

/** `count` rows of an extent from `from` on, as they are in the file; [count * row_floats]. Threads: any. */
gbt_status cell_store_read(const cell_store *store, const cell_extent *extent, size_t from, size_t count,
                           float *out, gbt_error *err);

void cell_store_free(cell_store *store);

#endif
