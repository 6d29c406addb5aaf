/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_file.h -- plain Gaussians in whatever file people have: the format follows from the name. */
#ifndef GBT_DATA_GAUSSIAN_FILE_H
#define GBT_DATA_GAUSSIAN_FILE_H

#include <stdbool.h>

#include "data/gaussian_cloud.h"

/** Whether gaussian_file_read() takes it: a name with the ending of a format
    (data/gaussian_formats.h), .usd or .usdc, or a result folder of 3DGS (data/result_folder.h). */
bool gaussian_file_readable(const char *path);

/** gaussian_file_readable(), and a .ply is not a cloud of points or of another program's anchors: its header
    is looked at. */
bool gaussian_file_has_gaussians(const char *path);

/** Read a file, or the newest .ply of a result folder. GBT_ERR_ARGUMENT for anything
   else; else as its reader. Free with gaussian_cloud_free(). */
gbt_status gaussian_file_read(const char *given, gaussian_cloud *out, gbt_error *err);

/** GBT_ERR_ARGUMENT unless the name has the ending of a format: before any work is done. */
gbt_status gaussian_file_check_writable(const char *path, gbt_error *err);

/** The largest degree of colours that the format keeps: 0 for .splat, else 3. */
int gaussian_file_degree(const char *path);

/** Write one of these, atomically; `origin` and the cloud's own are added to every mean in double, or kept
   apart (gaussian_format.keeps_origin). A warning where floats are too coarse for that. As its writer. */
gbt_status gaussian_file_write(const char *path, const gaussian_cloud *cloud, const double origin[3],
                               gbt_error *err);

#endif
