/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_bin.h -- COLMAP's cameras.bin, images.bin and points3D.bin from bytes. */
#ifndef GBT_DATA_COLMAP_BIN_H
#define GBT_DATA_COLMAP_BIN_H

#include "data/colmap_model.h"

/**
 * Read the three files of a binary model (little endian; layout in docs/formats.md).
 *
 * @param out [in,out] zeroed by the caller; free with raw_free(), also after a failure
 * @return GBT_OK, GBT_ERR_FORMAT with the offset, GBT_ERR_NO_MEMORY
 * Threads: any. Cost: one pass; memory is at most a small multiple of the file size, even if the counts in
 * the file are wrong.
 */
gbt_status colmap_bin_read(const colmap_files *files, raw_scene *out, gbt_error *err);

#endif
