/* SPDX-License-Identifier: Apache-2.0 */
/* growth/sources.h -- the list of sources of growth candidates, in order: X(source). A new source is a file
   of its own and a line here. */
#ifndef GBT_GROWTH_SOURCES_H
#define GBT_GROWTH_SOURCES_H

#include "growth/search.h"

#define GROWTH_SOURCES(X)                                                                                    \
    X(growth_from_gaussians) /* means of Gaussians whose gradient is large, on the grids of all levels */    \
    X(growth_from_points)    /* known surface, on a grid finer by one level */

/** Search the grids of one source. GBT_OK or GBT_ERR_NO_MEMORY. */
#define X(source) gbt_status source(growth_search *s, gbt_error *err);
GROWTH_SOURCES(X)
#undef X

#endif
