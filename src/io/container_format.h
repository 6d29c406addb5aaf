/* SPDX-License-Identifier: Apache-2.0 */
/* io/container_format.h -- the byte layout of a container, shared by its reader and its writer.

   [header 64][table 128 x count][section 0][zeros][section 1]...   every part starts at a multiple of 64 */
#ifndef GBT_IO_CONTAINER_FORMAT_H
#define GBT_IO_CONTAINER_FORMAT_H

#include <stdbool.h>
#include <zlib.h>

#include "io/container.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "the file is little endian and so must be the machine"
#endif

enum { CONTAINER_VERSION = 1, CONTAINER_ALIGN = 64 };

#define CONTAINER_MAGIC "GBTMODEL"

typedef struct container_header {
    char magic[8];
    uint32_t version;
    uint32_t section_count;
    uint64_t file_bytes;
    uint32_t table_crc;
    uint32_t zero[8];
    uint32_t crc; /* of the 60 bytes before; at the same offset in every version */
} container_header;
_Static_assert(sizeof(container_header) == 64, "the header is 64 bytes");

typedef struct container_row {
    char name[CONTAINER_NAME_SIZE]; /* padded with zeros */
    uint32_t dtype;
    uint32_t dim_count;
    uint64_t dims[CONTAINER_MAX_DIMS]; /* zeros after dim_count sizes */
    uint64_t offset;
    uint64_t byte_count;
    uint32_t crc;
    uint32_t zero;
} container_row;
_Static_assert(sizeof(container_row) == 128, "a row of the table is 128 bytes");

static inline uint32_t container_checksum(const void *bytes, size_t count)
{
    return (uint32_t)crc32_z(crc32_z(0, NULL, 0), bytes, count);
}

static inline size_t container_dtype_size(container_dtype dtype)
{
    switch (dtype) {
    case CONTAINER_F32:
    case CONTAINER_U32:
        return 4;
    case CONTAINER_F64:
    case CONTAINER_U64:
    case CONTAINER_I64:
        return 8;
    case CONTAINER_U8:
        return 1;
    }
    return 0;
}

/** Size in bytes of an array; false if it overflows. A size of 0 does not excuse an overflow of the other
    factors: no valid file has that. */
static inline bool container_shape_bytes(container_dtype dtype, int dim_count, const size_t *dims,
                                         size_t *out)
{
    size_t bytes = container_dtype_size(dtype);
    bool is_empty = false;
    for (int i = 0; i < dim_count; i++) {
        if (dims[i] == 0)
            is_empty = true;
        else if (__builtin_mul_overflow(bytes, dims[i], &bytes))
            return false;
    }
    *out = is_empty ? 0 : bytes;
    return bytes <= PTRDIFF_MAX;
}

/** Next multiple of CONTAINER_ALIGN; false on overflow. */
static inline bool container_align_up(size_t offset, size_t *out)
{
    if (offset > SIZE_MAX - (CONTAINER_ALIGN - 1))
        return false;
    *out = (offset + (CONTAINER_ALIGN - 1)) / CONTAINER_ALIGN * CONTAINER_ALIGN;
    return true;
}

static inline const void *container_section_data(const container_section *s)
{
    return s->data != NULL ? s->data : s->small;
}

#endif
