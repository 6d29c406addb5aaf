/* SPDX-License-Identifier: Apache-2.0 */
/* gb/balls.h -- granular balls: the recursive PCA-median partition of a sparse cloud (Yang 2026, eqs 16-27).
 */
#ifndef GBT_GB_BALLS_H
#define GBT_GB_BALLS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/choices.h"
#include "gbtrace/status.h"

typedef struct balls_def {
    float voxel_size;    /* v, eqs 21 and 23: base spatial scale, scene units, > 0. No default: see
                            balls_voxel_size(). */
    float radius_factor; /* eta, eq 23: a set is compact when r <= eta v; > 0. Default 1.25 */
    float color_std_max; /* tau_a, eq 23: largest mean channel std-dev of an even set, [0, 1]. Default 0.02 */
    int min_points;      /* N_min, eq 23: sets this small are not split; >= 1. Default 2 */
    int max_depth;       /* D_max, eq 23: [0, 64]; the root has depth 0. Default 18 */
    float min_scale;     /* gamma, eq 21: s_min is at least max(gamma, 1e-6) v. Default 0.25 */
    float min_radius;    /* second lower bound of s_min, scene units, >= 0. Default 0; in the paper
                            BALLS_PAPER_MIN_RADIUS */
} balls_def;

/** The constant of eq 21. It is in the data's unit of length, so with it balls and scales depend on that
    unit. */
#define BALLS_PAPER_MIN_RADIUS 1e-6f

/** The paper's settings except min_radius; voxel_size is 0 and must be set. */
balls_def balls_def_default(void);

/** s_min, eq 21: the smallest radius of a ball. */
double balls_least_radius(const balls_def *def);

/** One ball per element: members, centre mu, radius r (Yang 2026, eqs 17-21), covariance and colour. All
    owned by the struct. */
typedef struct balls {
    size_t count, point_count;
    uint32_t *first;   /* [count + 1]: ball j holds points member[first[j] .. first[j+1]) (P, eq 17) */
    uint32_t *member;  /* [point_count]: input indices, each once; ascending inside a ball */
    float *center;     /* [count][3]: mean (mu, eq 19) */
    float *radius;     /* [count]: max(RMS distance, s_min) (r, eqs 20, 21) */
    float *covariance; /* [count][6]: xx xy xz yy yz zz, population (Sigma) */
    float *color;      /* [count][3]: mean colour */
    float *color_std;  /* [count]: mean over channels of the population std-dev (eq 22) */
    int *depth;        /* [count]: depth of the leaf */
} balls;

/**
 * Partition a cloud into balls. Every point lands in exactly one ball (eq 17); balls are emitted depth first,
 * left child first.
 *
 * @param position [in] [count][3], finite
 * @param color    [in] [count][3] in [0, 1], or NULL: colour then never stops or forces a split (sigma_a = 0)
 * @return GBT_OK, GBT_ERR_ARGUMENT (def out of range, non-finite point, colour outside [0, 1]: says which),
 *         GBT_ERR_NO_MEMORY; on failure *out is zeroed
 *
 * 0 points give 0 balls. Points that no axis can separate are one ball. A set whose median is its maximum is
 * split below the median, but stays whole when it has min_points + 1 points and a radius of at most 4
 * voxel_size. Results beyond the range of float saturate. docs/balls.md lists how every ambiguity of the
 * paper is resolved.
 * Threads: same bits for every thread count. Cost: O(n log n) time, 25 n bytes of scratch.
 */
gbt_status balls_build(const float *position, const float *color, size_t count, const balls_def *def,
                       balls *out, gbt_error *err);
void balls_free(balls *b);

/**
 * Base spatial scale of a cloud (v), > 0 and finite for >= 2 distinct points, else 1.
 *
 * GBT_VOXEL_RULE_MEDIAN: lower median of the distance to the nearest neighbour. GBT_VOXEL_RULE_SQUARED: as
 * the reference code, for each point the mean of the 3 squared neighbour distances, and of these n means the
 * floor(n / 2)-th smallest, one below the lower median when n is odd. When the median is 0 (duplicates), the
 * median over the points whose value is > 0; when there are none, over the distinct points. Fewer than 4
 * points have fewer than 3 neighbours to average.
 * @return GBT_OK, GBT_ERR_ARGUMENT (non-finite point: says which), GBT_ERR_NO_MEMORY; *out is 1 on failure
 * Threads: same bits for every thread count. Cost: one nearest-neighbour query per point.
 */
gbt_status balls_voxel_size(const float *position, size_t count, gbt_voxel_rule rule, float *out,
                            gbt_error *err);

/**
 * Voxel baseline of Scaffold-GS (Lu 2024; Yang 2026, eq 12): centres of the distinct cells round(p / v) (half
 * to even, in float32), times v, sorted by x, y, z cell.
 *
 * @param centers [out] [*out_count][3], free with mem_free(); NULL on failure
 * @return GBT_OK, GBT_ERR_ARGUMENT (voxel_size, non-finite point, or a cell out of the range of float: says
 *         which), GBT_ERR_NO_MEMORY
 * Cost: O(n log n) time, one thread.
 */
gbt_status voxel_centers(const float *position, size_t count, float voxel_size, float **centers,
                         size_t *out_count, gbt_error *err);

#endif
