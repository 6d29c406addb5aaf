/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_place.h -- finds the COLMAP model inside a data set folder. */
#ifndef GBT_DATA_COLMAP_PLACE_H
#define GBT_DATA_COLMAP_PLACE_H

#include <stddef.h>

#include "gbtrace/status.h"

/** Where to look for a model. */
typedef enum colmap_layout {
    COLMAP_USUAL,     /* sparse/0, sparse or the folder itself */
    COLMAP_NERFSTUDIO /* only colmap/sparse/0, from which nerfstudio makes its transforms.json */
} colmap_layout;

/**
 * Find the COLMAP model of a data set, even if it is incomplete.
 *
 * @param model  [out] its folder; empty when there is none
 * @param ending [out] the ending of its three files: "bin" or "txt"
 */
gbt_status colmap_place_find(const char *folder, colmap_layout layout, char *model, size_t size,
                             const char **ending, gbt_error *err);

/**
 * GBT_ERR_FORMAT when another folder below this one holds a COLMAP model; the message says which folder to
 * give instead. Otherwise GBT_OK.
 */
gbt_status colmap_place_check(const char *folder, gbt_error *err);

#endif
