/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_ply.h -- plain 3DGS models (.ply with f_dc, f_rest, opacity, scale and rot) from bytes. */
#ifndef GBT_DATA_GAUSSIAN_PLY_H
#define GBT_DATA_GAUSSIAN_PLY_H

#include <stdio.h>

#include "base/large_file.h"
#include "data/bytes.h"
#include "data/gaussian_cloud.h"
#include "data/ply.h"

/** The line of a header that says that Gaussians are to be drawn as wide as pixels. */
#define GAUSSIAN_PLY_MIP "comment SplatRenderMode: mip"

/** The line of our own that says how near to a camera they are drawn, and a number. */
#define GAUSSIAN_PLY_NEAR "comment gbtrace near "

/** That line, where it holds. */
static inline void gaussian_ply_put_near(sink *s, const gaussian_cloud *cloud)
{
    char line[64];
    if (!(cloud->near > 0))
        return;
    snprintf(line, sizeof line, GAUSSIAN_PLY_NEAR "%.9g\n", (double)cloud->near);
    sink_put_text(s, line);
}

/**
 * Read a 3DGS .ply: any property order and types, extra properties ignored, ASCII or binary; or one whose
 * Gaussians are packed into chunks (data/compressed_ply.h).
 *
 * colour = max(0, 0.5 + sum sh_k Y_k). A row is dropped when a value is NaN or infinite; but an opacity logit
 * of +-inf is 1 or 0 and a log-scale of -inf is a flat axis, both as exporters write them. A log-scale above
 * GAUSSIAN_SCALE_LOG_LIMIT also drops the row. filter_3D of Mip-Splatting, f, makes scales sqrt(s^2 + f^2),
 * and opacities those of the same integral.
 *
 * @param out [out] free with gaussian_cloud_free(); zeroed on failure
 * @return GBT_OK; GBT_ERR_FORMAT also when no Gaussian remains; GBT_ERR_NO_MEMORY
 * Threads: any.
 */
gbt_status gaussian_ply_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** Whether the header names what every Gaussian has: false for points, anchors, and what is no .ply. */
bool gaussian_ply_has_gaussians(const source_file *file);

/** A binary .ply of plain Gaussians that is read by parts, because it may be larger than memory. Start from
    {0}; end with gaussian_ply_close(). */
typedef struct gaussian_ply_parts {
    size_t count; /* rows */
    int sh_degree;
    bool antialiased; /* as in gaussian_cloud */
    float near;
    large_file file; /* the rest is internal */
    unsigned char *head;
    ply_header header;
    int columns[PLY_MAX_COLUMNS + 1];
    size_t rest_count, row_bytes;
    bool has_filter;
} gaussian_ply_parts;

/** GBT_OK; GBT_ERR_IO; GBT_ERR_FORMAT, also for files whose rows are not all of one size (ASCII, packed). */
gbt_status gaussian_ply_open(const char *path, gaussian_ply_parts *out, gbt_error *err);

/**
 * Rows [first, first + count), checked as gaussian_ply_read() does.
 *
 * @param bytes [in,out] room for count * row_bytes
 * @param out   [in,out] has room for `count`; its Gaussians are replaced, what was left out is added up
 * @param kept  [out]    [count] number of the row of each Gaussian in `out`, from `first`
 * Threads: any, with distinct arrays.
 */
gbt_status gaussian_ply_part(const gaussian_ply_parts *parts, size_t first, size_t count,
                             unsigned char *bytes, gaussian_cloud *out, uint32_t *kept, gbt_error *err);

void gaussian_ply_close(gaussian_ply_parts *parts);

#endif
