/* SPDX-License-Identifier: Apache-2.0 */
/* data/splat_file.h -- .splat files: 32 bytes per Gaussian, one colour for all directions. */
#ifndef GBT_DATA_SPLAT_FILE_H
#define GBT_DATA_SPLAT_FILE_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

/**
 * Read one: rows with a value that is not finite, or a scale that is not above 0, are dropped and counted;
 * ratios of scales are limited.
 *
 * @param out [out] sh_degree 0; free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT (not a multiple of 32 bytes, no usable Gaussian); GBT_ERR_NO_MEMORY
 */
gbt_status splat_file_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/**
 * Write one, most opaque volume first: viewers show what has been loaded. Only the first spherical harmonic
 * is kept. `origin` as in gaussian_ply.h.
 */
gbt_status splat_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            gbt_error *err);

#endif
