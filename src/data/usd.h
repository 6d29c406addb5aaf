/* SPDX-License-Identifier: Apache-2.0 */
/* data/usd.h -- USD scenes with a ParticleField3DGaussianSplat prim (OpenUSD 26.03), as text (.usda), or as
   text in a package (.usdz).

   The prim keeps the data set's axes; a rotation by 180 degrees about z converts them to USD's, where y is
   up. The scene's origin is a translation in double, so that large coordinates, such as those of a national
   grid, stay accurate. */
#ifndef GBT_DATA_USD_H
#define GBT_DATA_USD_H

#include "data/bytes.h"
#include "data/gaussian_cloud.h"

/** The near distance: an attribute of our own, which other programs ignore. */
#define USD_NEAR "gbtrace:near"

/**
 * Read the first such prim of a text, as gaussian_format.read; a warning counts them if there are more. Its
 * translation becomes the origin. The other transformations that its xformOpOrder lists, except that half
 * turn, are ignored with a warning, and so are all transformations of its parents.
 */
gbt_status usda_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

/** Read the first .usda in a package that has such a prim. */
gbt_status usdz_read(const source_file *file, gaussian_cloud *out, gbt_error *err);

#endif
