/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_file.h -- plain Gaussians in any of the supported formats, chosen by the ending of the file
   name. */
#ifndef GBT_DATA_GAUSSIAN_FILE_H
#define GBT_DATA_GAUSSIAN_FILE_H

#include <stdbool.h>

#include "data/gaussian_cloud.h"

/** Whether gaussian_file_read() accepts the path: its ending is one of the formats'
    (data/gaussian_formats.h), .usd or .usdc, or it is a 3DGS result folder (data/result_folder.h). */
bool gaussian_file_readable(const char *path);

/** Like gaussian_file_readable(), but also looks at the header of a .ply: false for a point cloud or another
    program's anchors. */
bool gaussian_file_has_gaussians(const char *path);

/** Read a file, or the newest .ply of a result folder. GBT_ERR_ARGUMENT for anything else; other errors as
    the format's reader. Free with gaussian_cloud_free(). */
gbt_status gaussian_file_read(const char *given, gaussian_cloud *out, gbt_error *err);

/** GBT_ERR_ARGUMENT unless the name has the ending of a writable format; to be called before any work is
    done. */
gbt_status gaussian_file_check_writable(const char *path, gbt_error *err);

/** The highest SH degree that the format stores: 0 for .splat, else 3. */
int gaussian_file_degree(const char *path);

/** Write atomically in the format of the ending. `origin` and the cloud's own origin are added to every mean
    in double, or stored separately (gaussian_format.keeps_origin). Warns when floats are too coarse for the
    coordinates. Errors as the format's writer. */
gbt_status gaussian_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                               gbt_error *err);

#endif
