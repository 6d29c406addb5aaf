/* SPDX-License-Identifier: Apache-2.0 */
/* io/position_code.h -- anchor positions as cells of a cube, in Morton order (Morton 1966), and these cells
   as an octree. */
#ifndef GBT_IO_POSITION_CODE_H
#define GBT_IO_POSITION_CODE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"
#include "io/range_coder.h"

enum { POSITION_LEVELS_MAX = 21 };

/** Cell (i, j, k) has its middle at origin + (i + 1/2, j + 1/2, k + 1/2) cell; 2^levels cells along each
    side. */
typedef struct position_grid {
    float origin[3], cell;
    int levels; /* [0, POSITION_LEVELS_MAX] */
} position_grid;

/** The grid over the box of some points, its cells as near to `cell_wanted` as 2^21 of them allow. */
position_grid position_grid_over(const float *position, size_t count, double cell_wanted);

/** The Morton code of the cell a point is in, x in the lowest bit; a point outside is moved to the border. */
uint64_t position_cell(const position_grid *grid, const float position[3]);

/** Cell numbers along the axes. */
void position_split(uint64_t code, uint32_t cell[3]);

/** The middle of a cell, in float: one product and one sum per axis. */
void position_middle(const position_grid *grid, uint64_t code, float position[3]);

/**
 * Write or read ascending codes of cells, some perhaps more than once.
 *
 * @param codes [in,out] [count]
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_FORMAT (what was read is not `count` codes; without a text)
 */
gbt_status positions_code(range_coder *c, int levels, uint64_t *codes, size_t count, gbt_error *err);

#endif
