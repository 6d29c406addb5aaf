/* SPDX-License-Identifier: Apache-2.0 */
/* query/rows.h -- rows of numbers from text and from PLY: balls, and queries. */
#ifndef GBT_QUERY_ROWS_H
#define GBT_QUERY_ROWS_H

#include <stddef.h>

#include "gbtrace/status.h"

enum { ROW_WIDTH_MAX = 8 };

/** Start from {0}; free with query_rows_free() after success or failure. */
typedef struct query_rows {
    size_t count, width; /* numbers of each row */
    double *value;       /* [count][width] */
    size_t capacity;
} query_rows;

/**
 * Text: a row per line, all of one width, between `least` and `most` numbers, with blanks or commas between
 * them; # begins a comment, and lines without numbers are left out.
 *
 * @param name [in] for messages
 * @return GBT_OK, GBT_ERR_FORMAT with the line, GBT_ERR_NO_MEMORY
 */
gbt_status query_rows_parse(const char *name, const char *text, size_t size, size_t least, size_t most,
                            query_rows *out, gbt_error *err);

/** A file of such text, or a .ply: x y z of its vertices, and their radius if `most` is 4 and there is one.
    Also GBT_ERR_IO. */
gbt_status query_rows_read(const char *path, size_t least, size_t most, query_rows *out, gbt_error *err);

void query_rows_free(query_rows *rows);

#endif
