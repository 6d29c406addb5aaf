/* SPDX-License-Identifier: Apache-2.0 */
/* raster/kernel.h -- the interface between raster.c and its kernels, which are compiled per instruction set
   (kernel.inc.h).

   Image points are counted in pixels from the centre of the first pixel: pixel (i, j) is at (i, j). */
#ifndef GBT_RASTER_KERNEL_H
#define GBT_RASTER_KERNEL_H

#include "base/cpu.h"
#include "raster/raster.h"

enum {
    BLOCK_PIXELS = 4, /* a block is 4 x 4 pixels: the sixteen lanes */
    BLOCKS_ACROSS = 4,
    TILE_BLOCKS = BLOCKS_ACROSS * BLOCKS_ACROSS,
    TILE_PIXELS = BLOCKS_ACROSS * BLOCK_PIXELS,
    PIXEL_LANES = 16,
    TILE_LIMIT = 65535, /* tiles along a side */
    SPLAT_GRAIN = 2048  /* Gaussians that are projected together; their splats begin at a multiple of this */
};

typedef struct raster_view {
    raster_settings settings;
    double rotation[9],
        center[3];          /* world to camera; the centre as float32 has it, where the tracer's rays start */
    double fx, fy, cx, cy;  /* cx, cy: from the centre of the first pixel */
    double low[2], high[2]; /* raster_limits() */
    int width, height, tiles_across, tiles_down;
} raster_view;

/* A Gaussian that is drawn: where it reaches, and what a pixel of the EWA form needs. With (dx, dy) from a
   pixel to the centre, u = chol[0] dx + chol[1] dy and v = chol[2] dy, nothing is drawn where u^2 + v^2 >
   reach. EWA: the response is 2^-(u^2 + v^2), so (u, v) is the canonical point times the root of
   HALF_LOG2_E. */
typedef struct splat {
    double center[2];
    float chol[3], reach;
    float opacity, color[3];
    float depth; /* z of the centre */
    uint32_t id;
    uint16_t box[4]; /* tiles: first and end across, first and end down */
} splat;

/* A Gaussian on the rays of the per-ray form. On the ray (a, b, 1) of camera space, with da = a - a0, db = b
   - b0:

       w = w0 + da wa + db wb      y = y0 + m/sigma (da wa + db wb)      v = y + k w      depth = m + k sigma

   w: canonical direction in units of 1 / sigma, the smallest scale. In front of the camera (a0, b0, 1) points
   to the mean, m is its depth and y0 = 0, so that nothing large is subtracted; elsewhere m = a0 = b0 = 0 and
   y0 is the canonical position of the eye. */
typedef struct ray_splat {
    double a0, b0;
    float depth, depth_per_sigma, sigma, sigma_inverse;
    float y0[3], w0[3], wa[3], wb[3];
} ray_splat;

/* A splat in the list of a tile. */
typedef struct tile_entry {
    uint32_t splat;
    uint32_t pair; /* number of its gradient record; those of one splat are consecutive */
} tile_entry;

/* The pixels of one tile, block by block. */
typedef struct tile_pixels {
    _Alignas(64) float rgb[TILE_BLOCKS][3][PIXEL_LANES]; /* forward: out, with the background; backward:
                                                            dL/d(rgb), 0 outside the image */
    _Alignas(64) float transmittance[TILE_BLOCKS][PIXEL_LANES];
    _Alignas(64) float background[TILE_BLOCKS][3][PIXEL_LANES]; /* in */
} tile_pixels;

/* What the forward pass leaves for the adjoint, in addition to the lists. */
typedef struct tile_tape {
    _Alignas(64) float transmittance[TILE_BLOCKS][PIXEL_LANES];
    _Alignas(64) float stop[TILE_BLOCKS][PIXEL_LANES]; /* EWA: number of the entry that the pixel stopped at,
                                                          or infinite */
    size_t used;                                       /* EWA: entries that were looked at */
} tile_tape;

/* The sums that a tile leaves for each pair, with q = dL/d(log alpha), which is 0 where alpha is cut. EWA: q,
   q u, q v, q u u, q u v, q v v; colour; weight T alpha. Per ray: q, q v (3), q v v (xx yy zz yz zx xy);
   colour; weight. */
enum { EWA_COLOR = 6, EWA_WEIGHT = 9, EWA_SUMS, RAY_COLOR = 10, RAY_WEIGHT = 13, RAY_SUMS };

static inline size_t raster_sum_count(raster_form form) { return form == RASTER_EWA ? EWA_SUMS : RAY_SUMS; }

/* Growing memory of the per-ray form, one per tile in flight. Start from {0}, free all. */
typedef struct ray_scratch {
    struct ray_row *rows;
    size_t row_capacity;
    struct splat_hit *hits;
    size_t hit_capacity;
    uint16_t *reached; /* per entry: bit per block */
    size_t reached_capacity;
} ray_scratch;

typedef struct tile_job {
    const raster_view *view;
    const splat *splats;
    const ray_splat *rays; /* per ray: [splats] */
    const tile_entry *entries;
    size_t count;
    int x0, y0; /* first pixel */
    tile_pixels *pixels;
    tile_tape *tape;  /* forward: NULL when no adjoint will follow */
    uint16_t *blocks; /* EWA, [count]: bit per block in which the entry was blended; NULL with the tape */
    float *records;   /* backward, [pairs][sums]: those of this tile's entries are written */
    uint64_t blended; /* pairs of Gaussian and pixel, added to */
} tile_job;

typedef struct raster_kernel {
    /** Write the Gaussians [begin, end) that are drawn, in their order; returns how many. begin is a multiple
        of 16. */
    size_t (*project)(const raster_view *view, const gaussians *g, size_t begin, size_t end, splat *out,
                      ray_splat *rays);
    /** Write the numbers of the tiles that a splat reaches; returns how many: at most the area of its box. */
    size_t (*reach)(const raster_view *view, const splat *s, uint32_t *tiles);
    /** One tile, forward and back. False when memory ran out. */
    bool (*forward[2])(tile_job *job, ray_scratch *scratch); /* by raster_form */
    bool (*backward[2])(tile_job *job, ray_scratch *scratch);
} raster_kernel;

CPU_DECLARE_VARIANTS(raster_kernel, raster_kernel);

#endif
