/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_place.h -- in which folder of a data set its COLMAP model is. */
#ifndef GBT_DATA_COLMAP_PLACE_H
#define GBT_DATA_COLMAP_PLACE_H

#include <stddef.h>

#include "gbtrace/status.h"

/** Where a model is looked for. */
typedef enum colmap_layout {
    COLMAP_USUAL,     /* sparse/0, sparse or the folder itself */
    COLMAP_NERFSTUDIO /* colmap/sparse/0 alone, of which nerfstudio makes its transforms.json */
} colmap_layout;

/**
 * Find the COLMAP model of a data set, complete or not.
 *
 * @param model  [out] its folder; empty when there is none
 * @param ending [out] of its three files: "bin" or "txt"
 */
gbt_status colmap_place_find(const char *folder, colmap_layout layout, char *model, size_t size,
                             const char **ending, gbt_error *err);

/** When some other folder below this one holds a COLMAP model: GBT_ERR_FORMAT, and what to do. Else GBT_OK.
 */
gbt_status colmap_place_check(const char *folder, gbt_error *err);

#endif
