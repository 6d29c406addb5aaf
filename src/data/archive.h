/* SPDX-License-Identifier: Apache-2.0 */
/* data/archive.h -- .zip archives in memory, by libzip. */
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
 * Put an archive of members that are stored as they are, the same bytes for the same members.
 *
 * @param align [in] each member's bytes begin at a multiple of this; 1: anywhere
 * @return GBT_OK; GBT_ERR_ARGUMENT (4 GiB or more); GBT_ERR_NO_MEMORY
 */
gbt_status archive_put(sink *out, const char *path, const archive_member *members, size_t count, size_t align,
                       gbt_error *err);

/**
 * A member's bytes, unpacked, with an extra zero byte behind them (not counted). Free with mem_free().
 *
 * @return GBT_OK; GBT_ERR_FORMAT (no archive, no such member, damaged, encrypted); GBT_ERR_NO_MEMORY
 */
gbt_status archive_take(const source_file *file, const char *member, unsigned char **bytes, size_t *size,
                        gbt_error *err);

/** The name of the first member that ends so, in `out`; GBT_ERR_FORMAT when there is none. */
gbt_status archive_find(const source_file *file, const char *ending, char *out, size_t out_size,
                        gbt_error *err);

#endif
