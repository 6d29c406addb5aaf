/* SPDX-License-Identifier: Apache-2.0 */
/* data/compressed_ply.h -- .ply files whose Gaussians are packed into chunks, as SuperSplat writes them. */
#ifndef GBT_DATA_COMPRESSED_PLY_H
#define GBT_DATA_COMPRESSED_PLY_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"
#include "data/ply.h"

/** Whether the header has packed Gaussians. */
bool compressed_ply_is(const ply_header *header);

/** Read them, as gaussian_ply_read(). `out` zeroed by the caller; on failure its memory is the caller's to
    free. */
gbt_status compressed_ply_read(const source_file *file, const ply_header *header, gaussian_cloud *out,
                               gbt_error *err);

/**
 * Write one: 16 bytes a Gaussian, 72 a chunk, and a byte for each value of a harmonic above the first, in
 * steps of 1/32. Positions have 2^10 to 2^11 steps in the chunk's box, which is why Gaussians are put in the
 * order of space (data/gaussian_order.h). `origin` is added to every mean in double.
 */
gbt_status compressed_ply_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                                gbt_error *err);

#endif
