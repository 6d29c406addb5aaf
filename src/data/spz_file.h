/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz_file.h -- .spz files, versions 2 and 3: attributes quantised one after the other, then gzip. About
   a tenth of a .ply. */
#ifndef GBT_DATA_SPZ_FILE_H
#define GBT_DATA_SPZ_FILE_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

/**
 * Read one, in the axes that it has (those of the .ply it was made from, as nearly every writer keeps them).
 *
 * @param out [out] free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT (damaged, another version, more than the streams hold); GBT_ERR_NO_MEMORY
 */
gbt_status spz_file_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/**
 * Write version 3, in the cloud's own axes. Positions get as many fractional bits, up to 16, as their largest
 * coordinate leaves of 23; scales are steps of 6 % between e^-10 and e^5.9, spherical harmonics 5 bits in
 * degree 1 and 4 above.
 *
 * @param origin [in] added to every mean in double
 * @return GBT_OK; GBT_ERR_ARGUMENT (a coordinate beyond 8 million); as file_write_atomic()
 */
gbt_status spz_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                          gbt_error *err);

#endif
