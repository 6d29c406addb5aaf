/* SPDX-License-Identifier: Apache-2.0 */
/* data/glb_file.h -- binary glTF 2.0 with KHR_gaussian_splatting (release candidate): one primitive, all
   attributes as floats. */
#ifndef GBT_DATA_GLB_FILE_H
#define GBT_DATA_GLB_FILE_H

#include "data/gaussian_cloud.h"

/**
 * Write one. glTF's y is up and cameras' y is down: x and y change their signs, and rotations and spherical
 * harmonics with them.
 *
 * Viewers without the extension see points: COLOR_0 holds the mean colour, linear, with the opacity.
 *
 * @param origin [in] added to every mean in double
 * @return GBT_OK; GBT_ERR_ARGUMENT (beyond 4 GiB); GBT_ERR_NO_MEMORY; as file_write_atomic()
 */
gbt_status glb_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                          gbt_error *err);

#endif
