/* SPDX-License-Identifier: Apache-2.0 */
/* io/row_sections.h -- stores arrays that have a row per anchor as sections PREFIX.NAME of a file, and reads
   them. */
#ifndef GBT_IO_ROW_SECTIONS_H
#define GBT_IO_ROW_SECTIONS_H

#include "anchor/rows.h"
#include "io/container.h"

/** Add a section for every field; `arrays` are borrowed until the writer has saved. */
void row_sections_add(container_writer *w, const char *prefix, const row_field *fields, int field_count,
                      size_t count, size_t offset_count, float *const *arrays);

/**
 * Find the data of every field.
 *
 * @param count, offset_count [in,out] required; CONTAINER_ANY is replaced by the size in the first section
 *                            that has this dimension
 * @param data                [out] [field_count] borrowed until container_free()
 * @return GBT_OK or GBT_ERR_FORMAT with file, section, wanted and got
 */
gbt_status row_sections_find(const container *c, const char *prefix, const row_field *fields, int field_count,
                             size_t *count, size_t *offset_count, const void **data, gbt_error *err);

/** Copy every field into `arrays`, which must have room; the shapes must match exactly. */
gbt_status row_sections_get(const container *c, const char *prefix, const row_field *fields, int field_count,
                            size_t count, size_t offset_count, float *const *arrays, gbt_error *err);

#endif
