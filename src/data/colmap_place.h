/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_place.h -- in which folder of a data set its COLMAP model is. */
#ifndef GBT_DATA_COLMAP_PLACE_H
#define GBT_DATA_COLMAP_PLACE_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

/**
 * Find the COLMAP model of a data set, complete or not: in sparse/0, sparse or the folder itself.
 *
 * @param of_nerfstudio [in] look in colmap/sparse/0 alone, where nerfstudio leaves the model of which its
 *                      transforms.json is made
 * @param model  [out] its folder; empty when there is none
 * @param ending [out] of its three files: "bin" or "txt"
 */
gbt_status colmap_place_find(const char *folder, bool of_nerfstudio, char *model, size_t size,
                             const char **ending, gbt_error *err);

/** When some other folder below this one holds a COLMAP model: GBT_ERR_FORMAT, and what to do. Else GBT_OK.
 */
gbt_status colmap_place_check(const char *folder, gbt_error *err);

#endif
