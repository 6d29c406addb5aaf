/* SPDX-License-Identifier: Apache-2.0 */
/* data/compressed_ply.h -- .ply files with Gaussians quantized in chunks, as SuperSplat writes them. */
#ifndef GBT_DATA_COMPRESSED_PLY_H
#define GBT_DATA_COMPRESSED_PLY_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"
#include "data/ply.h"

/** Whether the header describes compressed Gaussians. */
bool compressed_ply_is(const ply_header *header);

/** Read them with the rules of gaussian_ply_read(). The caller zeroes `out`, and frees it even after a
    failure. */
gbt_status compressed_ply_read(const source_file *file, const ply_header *header, gaussian_cloud *out,
                               gbt_error *err);

/**
 * Write one: 16 bytes per Gaussian, 72 per chunk, and one byte per SH coefficient above degree 0, in steps of
 * 1/32. Positions are quantized to 2^10 or 2^11 steps of the chunk's bounding box; Gaussians are therefore
 * written in spatial order (data/gaussian_order.h), which keeps the boxes small. `origin` is added to every
 * mean in double.
 */
gbt_status compressed_ply_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                                gbt_error *err);

#endif
