/* SPDX-License-Identifier: Apache-2.0 */
/* io/container.h -- the file format for everything that we save: named, typed, checksummed arrays.

   Layout (little endian; io/container_format.h): a 64-byte header, a table of 128 bytes per section, then the
   sections in table order, each at a multiple of 64 bytes with zeros between. The table determines the whole
   layout, and every byte is either covered by a checksum or must be zero, so any changed byte and any
   truncated or extended file is detected. */
#ifndef GBT_IO_CONTAINER_H
#define GBT_IO_CONTAINER_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

enum {
    CONTAINER_NAME_SIZE = 64,
    CONTAINER_MAX_DIMS = 4,
    CONTAINER_SMALL_BYTES = 64,
    CONTAINER_MAX_SECTIONS = 4096
};

/** As a requested size: any size is accepted. */
#define CONTAINER_ANY SIZE_MAX

/** These numbers are in files: never renumber. */
typedef enum container_dtype {
    CONTAINER_F32 = 1,
    CONTAINER_F64 = 2,
    CONTAINER_U32 = 3,
    CONTAINER_U64 = 4,
    CONTAINER_I64 = 5,
    CONTAINER_U8 = 6
} container_dtype;

typedef struct container_section {
    char name[CONTAINER_NAME_SIZE];
    container_dtype dtype;
    int dim_count; /* [1, CONTAINER_MAX_DIMS] */
    size_t dims[CONTAINER_MAX_DIMS];
    size_t byte_count;
    const void *data; /* NULL: the bytes are in `small` */
    unsigned char small[CONTAINER_SMALL_BYTES];
} container_section;

/* ---- writing ---- */

/** Collects sections. Start from `container_writer w = {0};`. The first failure is kept and returned by
    container_save(). */
typedef struct container_writer {
    size_t count, capacity;
    container_section *sections;
    gbt_error failure;
} container_writer;

/**
 * Add one array.
 *
 * @param name      [in] 1 to 63 bytes, not yet in the file
 * @param dim_count [in] [1, CONTAINER_MAX_DIMS]
 * @param dims      [in] sizes, row-major; a size of 0 is fine
 * @param data      [in] borrowed until container_save() or container_encode() returns
 */
void container_add(container_writer *w, const char *name, container_dtype dtype, int dim_count,
                   const size_t *dims, const void *data);

/** Add up to CONTAINER_SMALL_BYTES bytes as a vector. They are copied, so a temporary may be passed. */
void container_add_small(container_writer *w, const char *name, container_dtype dtype, size_t count,
                         const void *data);

/** Add a string without its final zero as a vector of CONTAINER_U8; borrowed like container_add(). */
void container_add_text(container_writer *w, const char *name, const char *text);

/** Make the file in memory; free `*bytes` with mem_free(). Cost: one copy of everything. */
gbt_status container_encode(const container_writer *w, unsigned char **bytes, size_t *byte_count,
                            gbt_error *err);

/** Write the file atomically (file_write_atomic()). GBT_ERR_ARGUMENT for an invalid container_add();
    GBT_ERR_NO_MEMORY and GBT_ERR_IO. */
gbt_status container_save(const container_writer *w, const char *path, gbt_error *err);

void container_writer_free(container_writer *w);

/* ---- reading ---- */

typedef struct container {
    size_t count;
    container_section *sections; /* data points into the file's bytes */
    const char *path;            /* for messages; borrowed */
    unsigned char *owned;        /* the file's bytes, if container_load() read them; else NULL */
} container;

/**
 * Check a complete file in memory: header, table, layout and every checksum.
 *
 * @param bytes [in]  borrowed until container_free(); on a multiple of 8 bytes, as mem_alloc() gives
 * @param path  [in]  what messages call it; borrowed until container_free()
 * @param out   [out] zeroed on failure
 * @return GBT_OK, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_ARGUMENT (alignment)
 * Cost: one pass over the bytes; allocates 216 bytes per section, of which there are at most as many as the
 * file has room for.
 */
gbt_status container_parse(const unsigned char *bytes, size_t byte_count, const char *path, container *out,
                           gbt_error *err);

/** Read and check a file. GBT_ERR_IO if it cannot be read, else as container_parse(). `path` is borrowed
    until container_free(). */
gbt_status container_load(const char *path, container *out, gbt_error *err);

/** The section with this name; NULL if there is none. */
const container_section *container_section_named(const container *c, const char *name);

/**
 * The data of a section, which must have the given type and shape.
 *
 * @param dims [in,out] [dim_count] required sizes; CONTAINER_ANY is replaced by the actual size
 * @param data [out]    borrowed until container_free(); aligned for its type; NULL on failure
 * @return GBT_OK or GBT_ERR_FORMAT with file, section, wanted and got
 */
gbt_status container_find(const container *c, const char *name, container_dtype dtype, int dim_count,
                          size_t *dims, const void **data, gbt_error *err);

/** Copy a vector of exactly `count` values out. */
gbt_status container_get(const container *c, const char *name, container_dtype dtype, size_t count, void *out,
                         gbt_error *err);

/** Copy a string and terminate it with zero. Fails if it does not fit or contains a zero. */
gbt_status container_get_text(const container *c, const char *name, char *out, size_t size, gbt_error *err);

void container_free(container *c);

#endif
