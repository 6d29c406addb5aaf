/* SPDX-License-Identifier: Apache-2.0 */
/* io/position_code.c -- codes the cells of positions as an octree, level by level. */
#include "io/position_code.h"

#include <math.h>

#include "base/memory.h"
#include "base/morton.h"

/* ---- cells ---- */

/* The inverse of morton_spread(). */
static uint32_t gather(uint64_t x)
{
    x &= UINT64_C(0x1249249249249249);
    x = (x | x >> 2) & UINT64_C(0x10C30C30C30C30C3);
    x = (x | x >> 4) & UINT64_C(0x100F00F00F00F00F);
    x = (x | x >> 8) & UINT64_C(0x1F0000FF0000FF);
    x = (x | x >> 16) & UINT64_C(0x1F00000000FFFF);
    return (uint32_t)((x | x >> 32) & 0x1FFFFF);
}

static uint64_t code_of(const uint32_t cell[3])
{
    return morton_spread(cell[0]) | morton_spread(cell[1]) << 1 | morton_spread(cell[2]) << 2;
}

void position_split(uint64_t code, uint32_t cell[3])
{
    for (int k = 0; k < 3; k++)
        cell[k] = gather(code >> k);
}

position_grid position_grid_over(const float *position, size_t count, double cell_wanted)
{
    position_grid grid = {0};
    float high[3] = {0};
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 3; k++) {
            const float x = position[3 * i + k];
            grid.origin[k] = i == 0 || x < grid.origin[k] ? x : grid.origin[k];
            high[k] = i == 0 || x > high[k] ? x : high[k];
        }
    double side = 0;
    for (int k = 0; k < 3; k++)
        side = fmax(side, (double)high[k] - (double)grid.origin[k]);
    while (grid.levels < POSITION_LEVELS_MAX && side > cell_wanted * ldexp(1, grid.levels))
        grid.levels++;
    /* Cells are not made smaller than wanted, even if the box allows it. */
    const double least = side / ldexp(1, grid.levels) * (1 + 1e-6);
    grid.cell = (float)fmin(fmax(fmax(least, cell_wanted), 1e-37), 1e38);
    return grid;
}

uint64_t position_cell(const position_grid *grid, const float position[3])
{
    uint32_t cell[3];
    const double last = ldexp(1, grid->levels) - 1;
    for (int k = 0; k < 3; k++) {
        const double at = floor(((double)position[k] - (double)grid->origin[k]) / (double)grid->cell);
        cell[k] = (uint32_t)(at > 0 ? fmin(at, last) : 0);
    }
    return code_of(cell);
}

void position_middle(const position_grid *grid, uint64_t code, float position[3])
{
    uint32_t cell[3];
    position_split(code, cell);
    const float half = 0.5f * grid->cell;
    for (int k = 0; k < 3; k++) {
        const float along = (float)(2 * cell[k] + 1) * half;
        position[k] = grid->origin[k] + along;
    }
}

/* ---- octree ---- */

enum { SIDES = 8, SET_MAX = 4, TREE_NODES = 256 };

typedef struct tree_models {
    coder_bit_model by_level[POSITION_LEVELS_MAX][SET_MAX][SIDES];
    coder_bit_model by_path[TREE_NODES][4];
    coder_bit_model by_sides[SIDES][8][SET_MAX];
    coder_mixer mixer[POSITION_LEVELS_MAX][8];
    coder_int_model extra; /* points in a cell after the first */
} tree_models;

typedef struct node_list {
    uint64_t *codes;
    size_t count;
} node_list;

static bool holds(const node_list *nodes, uint64_t code)
{
    size_t low = 0, high = nodes->count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (nodes->codes[middle] < code)
            low = middle + 1;
        else
            high = middle;
    }
    return low < nodes->count && nodes->codes[low] == code;
}

/* Bit 2 k + s tells whether there is a neighbour node on the lower (s = 0) or upper (s = 1) side along axis
   k. */
static unsigned find_sides(const node_list *nodes, int level, uint64_t code)
{
    uint32_t cell[3];
    unsigned sides = 0;
    position_split(code, cell);
    for (int k = 0; k < 3; k++)
        for (int s = 0; s < 2; s++) {
            uint32_t beside[3] = {cell[0], cell[1], cell[2]};
            if (s == 0 ? cell[k] == 0 : cell[k] + 1 == UINT32_C(1) << level)
                continue;
            beside[k] = s == 0 ? cell[k] - 1 : cell[k] + 1;
            sides |= (unsigned)holds(nodes, code_of(beside)) << (2 * k + s);
        }
    return sides;
}

/* Write or read which of its eight children a node has. */
static unsigned code_children(range_coder *c, tree_models *m, int level, unsigned sides, unsigned children)
{
    unsigned out = 0, path = 1, set = 0;
    const unsigned side_count = (unsigned)__builtin_popcount(sides);
    for (unsigned o = 0; o < 8; o++) {
        unsigned touching = 0; /* nodes that share a face with this child */
        for (unsigned k = 0; k < 3; k++)
            touching |= (sides >> (2 * k + (o >> k & 1)) & 1) << k;
        const unsigned near_count = set < SET_MAX ? set : SET_MAX - 1;
        coder_bit_model *const models[CODER_INPUTS] = {
            &m->by_level[level][near_count][__builtin_popcount(touching)], &m->by_path[path][side_count / 2],
            &m->by_sides[touching][o][near_count]};
        int bit = children >> o & 1;
        if (o == 7 && set == 0)
            bit = 1; /* every node has at least one child */
        else
            bit = coder_mixed(c, models, &m->mixer[level][o], bit);
        out |= (unsigned)bit << o;
        path = path << 1 | (unsigned)bit;
        set += (unsigned)bit;
    }
    return out;
}

/* Write or read the children of all nodes of one level. `codes`: the points, when writing. */
static gbt_status code_level(range_coder *c, tree_models *m, int level, int levels, const node_list *nodes,
                             const uint64_t *codes, size_t count, node_list *next)
{
    const int shift = 3 * (levels - level - 1);
    size_t point = 0;
    next->count = 0;
    for (size_t i = 0; i < nodes->count; i++) {
        unsigned children = 0;
        for (; !c->reading && point < count && codes[point] >> shift >> 3 == nodes->codes[i]; point++)
            children |= 1u << (codes[point] >> shift & 7);
        children = code_children(c, m, level, find_sides(nodes, level, nodes->codes[i]), children);
        for (unsigned o = 0; o < 8; o++) {
            if ((children >> o & 1) == 0)
                continue;
            if (next->count == count)
                return GBT_ERR_FORMAT;
            next->codes[next->count++] = nodes->codes[i] << 3 | o;
        }
    }
    return GBT_OK;
}

/* Write or read how many points each cell holds. */
static gbt_status code_counts(range_coder *c, tree_models *m, const node_list *cells, uint64_t *codes,
                              size_t count)
{
    size_t point = 0;
    for (size_t i = 0; i < cells->count; i++) {
        size_t here = 0;
        while (!c->reading && point + here < count && codes[point + here] == cells->codes[i])
            here++;
        here = (size_t)coder_int_alone(c, &m->extra, (int32_t)here - 1) + 1;
        if (here < 1 || here > count - point)
            return GBT_ERR_FORMAT;
        for (; here > 0; here--)
            codes[point++] = cells->codes[i];
    }
    return point == count ? GBT_OK : GBT_ERR_FORMAT;
}

static void start_models(tree_models *m)
{
    coder_bits_start(&m->by_level[0][0][0], sizeof m->by_level / sizeof(coder_bit_model));
    coder_bits_start(&m->by_path[0][0], sizeof m->by_path / sizeof(coder_bit_model));
    coder_bits_start(&m->by_sides[0][0][0], sizeof m->by_sides / sizeof(coder_bit_model));
    coder_mixers_start(&m->mixer[0][0], sizeof m->mixer / sizeof(coder_mixer));
    coder_ints_start(&m->extra, 1);
}

gbt_status positions_code(range_coder *c, int levels, uint64_t *codes, size_t count, gbt_error *err)
{
    tree_models *m = mem_alloc(1, sizeof *m, "octree contexts", err);
    node_list nodes = {mem_alloc(count + 1, sizeof *nodes.codes, "octree nodes", err), 0};
    node_list next = {mem_alloc(count + 1, sizeof *next.codes, "octree nodes", err), 0};
    gbt_status status = m == NULL || nodes.codes == NULL || next.codes == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK && count > 0) {
        start_models(m);
        nodes.codes[nodes.count++] = 0;
        for (int level = 0; level < levels && status == GBT_OK; level++) {
            status = code_level(c, m, level, levels, &nodes, codes, count, &next);
            const node_list done = nodes;
            nodes = next;
            next = done;
        }
        if (status == GBT_OK)
            status = code_counts(c, m, &nodes, codes, count);
    }
    mem_free(m);
    mem_free(nodes.codes);
    mem_free(next.codes);
    return status;
}
