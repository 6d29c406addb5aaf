/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz_streams.h -- what all versions of .spz share: one stream of bytes each for positions, opacities,
   colours, scales, rotations and spherical harmonics. */
#ifndef GBT_DATA_SPZ_STREAMS_H
#define GBT_DATA_SPZ_STREAMS_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

enum {
    SPZ_MAGIC = 0x5053474e, /* "NGSP" */
    SPZ_STREAMS = 6,
    SPZ_ANTIALIASED = 1, /* a flag, as the next */
    SPZ_EXTENSIONS = 2   /* a flag: there are extension records, which readers may skip, after the streams
                            (versions 2, 3) or before the table (4) */
};

/** The contents of a file's header. */
typedef struct spz_header {
    unsigned version; /* 2, 3 or 4 */
    uint32_t count;
    int degree;   /* of the SH, 0 to 3; in version 4 up to 4 */
    int fraction; /* fractional bits of a position */
    unsigned flags;
} spz_header;

/** Bytes of one Gaussian in each stream; 0 for the SH of degree 0. */
void spz_row_bytes(const spz_header *header, size_t out[SPZ_STREAMS]);

/**
 * Make the header for a cloud. Positions have 24 bits with sign; the largest coordinate determines how many
 * of them are fractional (at most 16). Warns about Gaussians that are too large or too small for the range of
 * scales in the format.
 *
 * @return GBT_OK; GBT_ERR_ARGUMENT (a coordinate beyond 8 million, too many Gaussians)
 */
gbt_status spz_header_of(const gaussian_cloud *cloud, const double origin[3], unsigned version,
                         const char *path, spz_header *out, gbt_error *err);

/** Check that the values of a header are valid; GBT_ERR_FORMAT if not. */
gbt_status spz_header_check(const spz_header *header, const char *name, gbt_error *err);

/** Append stream number `stream` of version 3 or 4; `origin` is added to every mean in double. */
void spz_put_stream(sink *s, const gaussian_cloud *cloud, const double origin[3], const spz_header *header,
                    int stream);

/** Decode all streams, which follow each other in memory. SH of degree 4 are dropped. Free with
    gaussian_cloud_free(). */
gbt_status spz_unpack(const unsigned char *streams, const spz_header *header, gaussian_cloud *out,
                      gbt_error *err);

/** Read version 4 (a file that starts with "NGSP", not gzip). As gaussian_format.read. */
gbt_status spz4_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** Write version 4: the same values as version 3, but smaller and faster to decompress. As
    gaussian_format.write. */
gbt_status spz4_write(const char *path, const gaussian_cloud *cloud, const double origin[3], gbt_error *err);

#endif
