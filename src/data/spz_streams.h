/* SPDX-License-Identifier: Apache-2.0 */
/* data/spz_streams.h -- what all versions of .spz have in common: positions, opacities, colours, scales,
   rotations and spherical harmonics, a stream of bytes each. */
#ifndef GBT_DATA_SPZ_STREAMS_H
#define GBT_DATA_SPZ_STREAMS_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

enum {
    SPZ_MAGIC = 0x5053474e, /* "NGSP" */
    SPZ_STREAMS = 6,
    SPZ_ANTIALIASED = 1, /* of the flags */
    SPZ_EXTENSIONS = 2 /* records that other programs may pass over: behind the streams, or before a table */
};

/** What a file's header says. */
typedef struct spz_header {
    unsigned version; /* 2, 3 or 4 */
    uint32_t count;
    int degree;   /* of the harmonics, 0 to 3; in version 4 to 4 */
    int fraction; /* bits of a position behind the point */
    unsigned flags;
} spz_header;

/** Bytes of one Gaussian in each stream: 0 of harmonics of degree 0. */
void spz_row_bytes(const spz_header *header, size_t out[SPZ_STREAMS]);

/**
 * The header of a cloud: as many fractional bits, up to 16, as its largest coordinate leaves of 23. A warning
 * says how many Gaussians are too large or too small for the scales that the format has.
 *
 * @return GBT_OK; GBT_ERR_ARGUMENT (a coordinate beyond 8 million, too many Gaussians)
 */
gbt_status spz_header_of(const gaussian_cloud *cloud, const double origin[3], unsigned version,
                         const char *path, spz_header *out, gbt_error *err);

/** Is what a header says possible? GBT_ERR_FORMAT. */
gbt_status spz_header_check(const spz_header *header, const char *name, gbt_error *err);

/** Put stream number `stream`, of version 3 or 4; `origin` is added to every mean in double. */
void spz_put_stream(sink *s, const gaussian_cloud *cloud, const double origin[3], const spz_header *header,
                    int stream);

/** The Gaussians of all streams, one behind the other, without harmonics of degree 4. Free with
    gaussian_cloud_free(). */
gbt_status spz_unpack(const unsigned char *streams, const spz_header *header, gaussian_cloud *out,
                      gbt_error *err);

/** Read version 4: a file that begins with the bytes NGSP. As gaussian_format.read. */
gbt_status spz4_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** Write version 4: the values of version 3, packed better and unpacked faster. As gaussian_format.write. */
gbt_status spz4_write(const char *path, const gaussian_cloud *cloud, const double origin[3], gbt_error *err);

#endif
