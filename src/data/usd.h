/* SPDX-License-Identifier: Apache-2.0 */
/* data/usd.h -- USD scenes with a prim ParticleField3DGaussianSplat (OpenUSD 26.03), as text (.usda) or as
   text in a package (.usdz).

   The prim has the axes of the data set; half a turn about z puts them into USD's, whose y is up. The scene's
   origin is a translation in double, so that coordinates of a country are kept. */
#ifndef GBT_DATA_USD_H
#define GBT_DATA_USD_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

/** The near distance: an attribute of our own, which others pass over. */
#define USD_NEAR "gbtrace:near"

/**
 * As gaussian_format.read: the first such prim of a text. Its coordinates are read with its translation; a
 * transformation of another kind is left out, with a warning, if it is not that half turn, and so are all
 * transformations of the prims that it is in.
 */
gbt_status usda_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** The first .usda in a package. */
gbt_status usdz_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

#endif
