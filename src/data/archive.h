/* SPDX-License-Identifier: Apache-2.0 */
/* data/archive.h -- .zip archives in memory, read and written with libzip. */
#ifndef GBT_DATA_ARCHIVE_H
#define GBT_DATA_ARCHIVE_H

#include "data/bytes.h"

/** A file in an archive; borrowed. */
typedef struct archive_member {
    const char *name;
    const void *bytes;
    size_t size;
} archive_member;

/**
 * Append an archive with uncompressed members. The same members always give the same bytes.
 *
 * @param align [in] each member's data starts at a multiple of this many bytes; 1: no alignment
 * @return GBT_OK; GBT_ERR_ARGUMENT (4 GiB or more); GBT_ERR_NO_MEMORY
 */
gbt_status archive_put(sink *out, const char *path, const archive_member *members, size_t count, size_t align,
                       gbt_error *err);

/**
 * Extract a member. One zero byte is added behind its data and not counted in `size`. Free with mem_free().
 *
 * @return GBT_OK; GBT_ERR_FORMAT (not an archive, no such member, damaged, encrypted); GBT_ERR_NO_MEMORY
 */
gbt_status archive_take(const source_file *file, const char *member, unsigned char **bytes, size_t *size,
                        gbt_error *err);

/** Whether a member is the one that is looked for. */
typedef bool archive_wanted(const source_file *member);

/**
 * Extract the first member with this ending that is wanted, as archive_take().
 *
 * @param name  [out] its name, as FILE: MEMBER
 * @param bytes [out] NULL when there is none
 */
gbt_status archive_take_first(const source_file *file, const char *ending, archive_wanted *wanted, char *name,
                              size_t name_size, unsigned char **bytes, size_t *size, gbt_error *err);

/** Write the name of the first member with this ending into `out`. GBT_ERR_FORMAT when there is none. */
gbt_status archive_find(const source_file *file, const char *ending, char *out, size_t out_size,
                        gbt_error *err);

#endif
