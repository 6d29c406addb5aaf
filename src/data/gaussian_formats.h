/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_formats.h -- the list of all formats of plain Gaussians. To add one, write a file that
   defines its row and add the row's name here. */
#ifndef GBT_DATA_GAUSSIAN_FORMATS_H
#define GBT_DATA_GAUSSIAN_FORMATS_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

typedef struct gaussian_format {
    const char *ending; /* of file names, ignoring case */
    const char *what;   /* what the format keeps, in a few words, for the help text and the documentation */
    int degree;         /* highest SH degree that it keeps */
    bool keeps_origin;  /* stored separately from the means, in double */

    /** The caller frees the cloud with gaussian_cloud_free(); zeroed on failure. */
    gbt_status (*read)(const source_file *file, gaussian_cloud *out, gbt_error *err);

    /** Whether such a file contains Gaussians at all. NULL: always. */
    bool (*holds)(const source_file *file);

    /**
     * Write atomically. `origin` is added to every mean in double, or stored separately; the cloud's own
     * origin is 0 here.
     */
    gbt_status (*write)(const char *path, const gaussian_cloud *cloud, const double origin[3],
                        gbt_error *err);
} gaussian_format;

#define GAUSSIAN_FORMATS(X) X(ply) X(compressed_ply) X(splat) X(spz) X(spz4) X(sog) X(glb) X(usda) X(usdz)

#define X(name) extern const gaussian_format gaussian_format_##name;
GAUSSIAN_FORMATS(X)
#undef X

#endif
