/* SPDX-License-Identifier: Apache-2.0 */
/* data/sog.h -- .sog bundles, version 2, as PlayCanvas defines them: a .zip with meta.json and lossless .webp
   tables, one pixel per Gaussian. */
#ifndef GBT_DATA_SOG_H
#define GBT_DATA_SOG_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

enum {
    SOG_PALETTE_MAX = 65536, /* labels have 16 bits */
    SOG_ENTRIES_PER_ROW = 64 /* in the table of SH coefficients */
};

/** The near distance: our own number in `asset` of meta.json. */
#define SOG_NEAR "gbtrace_near"

/** As gaussian_format.read. */
gbt_status sog_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

#endif
