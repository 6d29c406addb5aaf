/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_ply.h -- reads plain 3DGS models (.ply with f_dc, f_rest, opacity, scale and rot). */
#ifndef GBT_DATA_GAUSSIAN_PLY_H
#define GBT_DATA_GAUSSIAN_PLY_H

#include <stdio.h>

#include "base/large_file.h"
#include "data/bytes.h"
#include "data/gaussian_cloud.h"
#include "data/ply.h"

/** The header line which says that Gaussians are to be drawn with a filter as wide as a pixel. */
#define GAUSSIAN_PLY_MIP "comment SplatRenderMode: mip"

/** Our own header line for the near distance; a number follows. */
#define GAUSSIAN_PLY_NEAR "comment gbtrace near "

/** Append that line, if the cloud has a near distance. */
static inline void gaussian_ply_put_near(sink *s, const gaussian_cloud *cloud)
{
    char line[64];
    if (!(cloud->near > 0))
        return;
    snprintf(line, sizeof line, GAUSSIAN_PLY_NEAR "%.9g\n", (double)cloud->near);
    sink_put_text(s, line);
}

/**
 * Read a 3DGS .ply: any property order and types, extra properties ignored, ASCII or binary; or the
 * compressed form (data/compressed_ply.h).
 *
 * colour = max(0, 0.5 + sum sh_k Y_k). A row is dropped when a value is NaN or infinite, with two exceptions
 * that exporters do write: an opacity logit of +-inf means 1 or 0, and a log-scale of -inf means a flat axis.
 * A log-scale above GAUSSIAN_SCALE_LOG_LIMIT also drops the row. Mip-Splatting's filter_3D, f, turns scales s
 * into sqrt(s^2 + f^2) and scales the opacity so that the integral stays the same. If x is a double, the
 * cloud has an origin: the median of a sample of the means, rounded to whole numbers.
 *
 * @param out [out] free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT also when no Gaussian remains; GBT_ERR_NO_MEMORY
 * Threads: any.
 */
gbt_status gaussian_ply_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** Whether the header has all properties of a Gaussian; false for point clouds, anchors and files that are no
    .ply. */
bool gaussian_ply_has_gaussians(const source_file *file);

/** A binary .ply of plain Gaussians that is read in parts, because it may be larger than memory. Start from
    {0}; end with gaussian_ply_close(). */
typedef struct gaussian_ply_parts {
    size_t count; /* rows */
    int sh_degree;
    bool antialiased; /* as in gaussian_cloud */
    float near;
    double origin[3]; /* of the Gaussians of all parts */
    large_file file;  /* internal, as all below */
    unsigned char *head;
    ply_header header;
    int columns[PLY_MAX_COLUMNS + 1];
    size_t rest_count, row_bytes;
    bool has_filter;
} gaussian_ply_parts;

/** GBT_OK; GBT_ERR_IO; GBT_ERR_FORMAT, also for files whose rows have no fixed size (ASCII) and compressed
    ones. */
gbt_status gaussian_ply_open(const char *path, gaussian_ply_parts *out, gbt_error *err);

/**
 * Rows [first, first + count), checked as gaussian_ply_read() does.
 *
 * @param bytes [in,out] room for count * row_bytes
 * @param out   [in,out] has room for `count`; its Gaussians and its origin are replaced, its counts of
 *                       dropped and corrected rows are increased
 * @param kept  [out]    [count] for each Gaussian in `out`, its row relative to `first`
 * Threads: any, with distinct arrays.
 */
gbt_status gaussian_ply_part(const gaussian_ply_parts *parts, size_t first, size_t count,
                             unsigned char *bytes, gaussian_cloud *out, uint32_t *kept, gbt_error *err);

void gaussian_ply_close(gaussian_ply_parts *parts);

#endif
