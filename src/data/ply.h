/* SPDX-License-Identifier: Apache-2.0 */
/* data/ply.h -- PLY files: reads any element as rows of doubles and point clouds; writes point clouds and
   meshes. */
#ifndef GBT_DATA_PLY_H
#define GBT_DATA_PLY_H

#include "data/bytes.h"
#include "data/raw.h"

typedef enum ply_format { PLY_ASCII, PLY_LITTLE_ENDIAN, PLY_BIG_ENDIAN } ply_format;

typedef enum ply_type {
    PLY_INT8,
    PLY_UINT8,
    PLY_INT16,
    PLY_UINT16,
    PLY_INT32,
    PLY_UINT32,
    PLY_FLOAT,
    PLY_DOUBLE,
    PLY_TYPE_COUNT
} ply_type;

typedef struct ply_property {
    const char *name; /* not zero-terminated; borrowed from the file */
    size_t name_length;
    ply_type type;
    bool is_list;
    ply_type count_type; /* type of the item count, if this is a list */
} ply_property;

typedef struct ply_element {
    const char *name; /* as above */
    size_t name_length;
    uint64_t count;
    size_t first_property, property_count;
} ply_element;

enum { PLY_MAX_ELEMENTS = 16, PLY_MAX_PROPERTIES = 512, PLY_MAX_HEADER_BYTES = 65536 };

typedef struct ply_header {
    ply_format format;
    size_t element_count, property_count;
    ply_element elements[PLY_MAX_ELEMENTS];
    ply_property properties[PLY_MAX_PROPERTIES]; /* of all elements, in file order */
    size_t data_at;                              /* offset of the first byte after the header */
    size_t line_count;                           /* lines of the header, for messages about ASCII rows */
} ply_header;

/** Parse the header; names in `out` point into `file`. */
gbt_status ply_read_header(const source_file *file, ply_header *out, gbt_error *err);

/** Index of an element, or of a property within an element; -1 when it is not there. */
int ply_find_element(const ply_header *header, const char *name);
int ply_find_property(const ply_header *header, int element, const char *name);

/** Bytes of a row, if all rows of the element have the same size; 0 for ASCII and for rows with lists. */
size_t ply_row_bytes(const ply_header *header, int element);

/** Receives one row: the requested columns in the requested order; integers are not scaled. */
typedef void ply_row(void *context, const double *values);

enum { PLY_MAX_COLUMNS = 128 };

/**
 * Call `row` for each row of an element.
 *
 * @param columns  [in] property indices within the element, none of them a list; lists and other properties
 *                      are skipped
 * @return GBT_OK or GBT_ERR_FORMAT with the line or offset, possibly after some rows. Counts are checked
 *         against the bytes left before the first row.
 */
gbt_status ply_read_rows(const source_file *file, const ply_header *header, int element, const int *columns,
                         size_t column_count, ply_row *row, void *context, gbt_error *err);

/** Receives one list of a row; integers are not scaled. `items` is borrowed for the call. A failure ends the
    reading. */
typedef gbt_status ply_list(void *context, const double *items, size_t count, gbt_error *err);

/** Call `take` with the list `property` (an index within the element) of each row; otherwise as
    ply_read_rows(). May also return GBT_ERR_NO_MEMORY. */
gbt_status ply_read_lists(const source_file *file, const ply_header *header, int element, int property,
                          ply_list *take, void *context, gbt_error *err);

/** Read x y z of element "vertex", and red green blue if present; everything else is skipped. The caller
    zeroes `out` and frees it with raw_free(). */
gbt_status ply_read_points(const source_file *file, raw_scene *out, gbt_error *err);

/** An additional float property of each vertex to write: values[i * stride]. Borrowed. */
typedef struct ply_extra {
    const char *name; /* letters, digits and underscores */
    const float *values;
    size_t stride; /* >= 1 */
} ply_extra;

/** What ply_write() writes; everything is borrowed for the call. Start from `= {0}`. */
typedef struct ply_cloud {
    size_t vertex_count;
    const float *position; /* [vertex_count][3], written as x y z: as doubles, or as floats if the origin is 0
                            */
    double origin[3];      /* added to every position before it is written (see scene.origin) */
    size_t extra_count;
    const ply_extra *extras; /* written between z and red, in this order */
    const float *color;      /* [vertex_count][3] in [0, 1], written as uchar red green blue; NULL: none */
    size_t face_count;
    const uint32_t *faces; /* [face_count][3], indices of vertices */
    const char *comment;   /* one line; NULL: none */
} ply_cloud;

/** Write a binary little-endian PLY atomically. GBT_ERR_ARGUMENT for a bad name, comment or vertex index;
    else as file_write_atomic(). */
gbt_status ply_write(const char *path, const ply_cloud *cloud, gbt_error *err);

#endif
