/* SPDX-License-Identifier: Apache-2.0 */
/* bake/export_def.h -- whether an export can be made as asked, before anything is read or written. */
#ifndef GBT_BAKE_EXPORT_DEF_H
#define GBT_BAKE_EXPORT_DEF_H

#include "gbtrace/export.h"

enum { EXPORT_OUTPUTS_MAX = 16 };

/**
 * Check the settings, that every output can be written, once, and that none is read from.
 *
 * @param outputs [in] [output_count] paths, as gbt_export() takes them
 * @return GBT_OK; GBT_ERR_ARGUMENT or GBT_ERR_IO, naming the setting or the file
 */
gbt_status export_check(const char *input, const gbt_export_def *def, const char *const *outputs,
                        size_t output_count, gbt_error *err);

#endif
