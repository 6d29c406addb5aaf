/* SPDX-License-Identifier: Apache-2.0 */
/* io/position_code.h -- codes anchor positions: as cells of a cube in Morton order (Morton 1966), stored as
   an octree. */
#ifndef GBT_IO_POSITION_CODE_H
#define GBT_IO_POSITION_CODE_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"
#include "io/range_coder.h"

enum { POSITION_LEVELS_MAX = 21 };

/** A cube of 2^levels cells per side. The centre of cell (i, j, k) is origin + (i + 1/2, j + 1/2, k + 1/2)
    cell. */
typedef struct position_grid {
    float origin[3], cell;
    int levels; /* [0, POSITION_LEVELS_MAX] */
} position_grid;

/** The grid over the bounding box of some points. Cells are as close to `cell_wanted` as at most 2^21 cells
    per side allow. */
position_grid position_grid_over(const float *position, size_t count, double cell_wanted);

/** The Morton code of the cell that contains a point, x in the lowest bit. A point outside of the cube is
    moved to the nearest cell. */
uint64_t position_cell(const position_grid *grid, const float position[3]);

/** The cell's indices along the axes, from its Morton code. */
void position_split(uint64_t code, uint32_t cell[3]);

/** The centre of a cell, in float: one product and one sum per axis. */
void position_middle(const position_grid *grid, uint64_t code, float position[3]);

/**
 * Write or read the Morton codes of cells, ascending, possibly with duplicates.
 *
 * @param codes [in,out] [count]
 * @return GBT_OK, GBT_ERR_NO_MEMORY, GBT_ERR_FORMAT (the bytes do not give `count` codes; without a text)
 */
gbt_status positions_code(range_coder *c, int levels, uint64_t *codes, size_t count, gbt_error *err);

#endif
