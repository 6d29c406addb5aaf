/* SPDX-License-Identifier: Apache-2.0 */
/* raster/reach16.h -- which of sixteen squares of pixels a splat's ellipse reaches: tiles of the image,
   blocks of a tile. Included by kernel.inc.h. */
#ifndef GBT_RASTER_REACH16_H
#define GBT_RASTER_REACH16_H

#include "base/simd16.h"
#include "raster/kernel.h"

/* Lane i is column i % 4, row i / 4. */
static const _Alignas(64) float lane_column[16] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
static const _Alignas(64) float lane_row[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

static inline vfloat16 clamp16(vfloat16 a, vfloat16 low, vfloat16 high)
{
    return vfloat16_min(vfloat16_max(a, low), high);
}

/* u^2 + v^2 at (dx, dy). */
static inline vfloat16 ellipse_square(const float chol[3], vfloat16 dx, vfloat16 dy)
{
    const vfloat16 u = vfloat16_fma(vfloat16_set1(chol[0]), dx, vfloat16_mul(vfloat16_set1(chol[1]), dy)),
                   v = vfloat16_mul(vfloat16_set1(chol[2]), dy);
    return vfloat16_fma(u, u, vfloat16_mul(v, v));
}

/* Which of 4 x 4 squares of `side` pixels, counted from the origin, the ellipse about (x, y) reaches. The
   form is convex: in a square it is smallest at its centre, if that is inside, else on the edge nearest to
   the centre in x or that in y. So it is minimised along both lines, each clamped to the square. */
static inline unsigned reached_squares(const splat *s, float x, float y, float side)
{
    const vfloat16 zero = vfloat16_set1(0), last = vfloat16_set1(side - 1);
    const vfloat16 right = vfloat16_fnma(vfloat16_load(lane_column), vfloat16_set1(side), vfloat16_set1(x)),
                   left = vfloat16_sub(right, last);
    const vfloat16 bottom = vfloat16_fnma(vfloat16_load(lane_row), vfloat16_set1(side), vfloat16_set1(y)),
                   top = vfloat16_sub(bottom, last);
    const vfloat16 near_x = clamp16(zero, left, right), near_y = clamp16(zero, top, bottom);
    const float yy = s->chol[1] * s->chol[1] + s->chol[2] * s->chol[2];
    const float across = s->chol[0] > 0 ? -s->chol[1] / s->chol[0] : 0,
                down = yy > 0 ? -s->chol[0] * s->chol[1] / yy : 0;
    const vfloat16 on_row =
        ellipse_square(s->chol, clamp16(vfloat16_mul(vfloat16_set1(across), near_y), left, right), near_y);
    const vfloat16 on_column =
        ellipse_square(s->chol, near_x, clamp16(vfloat16_mul(vfloat16_set1(down), near_x), top, bottom));
    return vmask16_bits(vfloat16_le(vfloat16_min(on_row, on_column), vfloat16_set1(s->reach)));
}

static size_t reach(const raster_view *view, const splat *s, uint32_t *tiles)
{
    size_t count = 0;
    const int x0 = s->box[0], x1 = s->box[1], y0 = s->box[2], y1 = s->box[3];
    if (x1 - x0 == 1 && y1 - y0 == 1) {
        tiles[0] = (uint32_t)(y0 * view->tiles_across + x0);
        return 1;
    }
    for (int y = y0; y < y1; y += 4)
        for (int x = x0; x < x1; x += 4) {
            const int columns = x1 - x < 4 ? x1 - x : 4, rows = y1 - y < 4 ? y1 - y : 4;
            const unsigned inside = (0xFu >> (4 - columns)) * 0x1111u & 0xFFFFu >> (16 - 4 * rows);
            unsigned bits = reached_squares(s, (float)(s->center[0] - x * TILE_PIXELS),
                                            (float)(s->center[1] - y * TILE_PIXELS), TILE_PIXELS) &
                            inside;
            for (; bits != 0; bits &= bits - 1) {
                const int i = __builtin_ctz(bits);
                tiles[count++] = (uint32_t)((y + i / 4) * view->tiles_across + x + i % 4);
            }
        }
    return count;
}

#endif
