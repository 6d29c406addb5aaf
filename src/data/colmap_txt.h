/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_txt.h -- COLMAP's cameras.txt, images.txt and points3D.txt from bytes. */
#ifndef GBT_DATA_COLMAP_TXT_H
#define GBT_DATA_COLMAP_TXT_H

#include "data/colmap_model.h"

/** The same results and checks as colmap_bin_read(); messages give line numbers. Line ends may be LF or CRLF,
    and a byte order mark is allowed. */
gbt_status colmap_txt_read(const colmap_files *files, raw_scene *out, gbt_error *err);

#endif
