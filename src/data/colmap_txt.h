/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_txt.h -- COLMAP's cameras.txt, images.txt and points3D.txt from bytes. */
#ifndef GBT_DATA_COLMAP_TXT_H
#define GBT_DATA_COLMAP_TXT_H

#include "data/colmap_model.h"

/** The text twin of colmap_bin_read(): same results, same checks, lines in messages. LF or CRLF, with or
    without a BOM. */
gbt_status colmap_txt_read(const colmap_files *files, raw_scene *out, gbt_error *err);

#endif
