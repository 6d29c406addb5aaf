/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_formats.h -- the formats of plain Gaussians: THE list. A new one is a file that defines its
   row, and its name here. */
#ifndef GBT_DATA_GAUSSIAN_FORMATS_H
#define GBT_DATA_GAUSSIAN_FORMATS_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

typedef struct gaussian_format {
    const char *ending; /* of file names; in any case */
    const char *what;   /* what it keeps, in a few words, for help and pages */
    int degree;         /* of the colours it keeps */
    bool keeps_origin;  /* apart from the means, in double */

    /** Free the cloud with gaussian_cloud_free(); zeroed on failure. */
    gbt_status (*read)(const source_file *file, gaussian_cloud *out, gbt_error *err);

    /** Are there Gaussians in such a file? NULL: in every one. */
    bool (*holds)(const source_file *file);

    /** Write one atomically; `origin` is added to every mean in double, or kept apart. The cloud's own is 0.
     */
    gbt_status (*write)(const char *path, const gaussian_cloud *cloud, const double origin[3],
                        gbt_error *err);
} gaussian_format;

#define GAUSSIAN_FORMATS(X) X(ply) X(compressed_ply) X(splat) X(spz) X(spz4) X(sog) X(glb) X(usda) X(usdz)

#define X(name) extern const gaussian_format gaussian_format_##name;
GAUSSIAN_FORMATS(X)
#undef X

#endif
