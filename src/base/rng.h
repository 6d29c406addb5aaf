/* SPDX-License-Identifier: Apache-2.0 */
/* base/rng.h -- counter-based random numbers (Philox 4x32-10, Salmon 2011).

   A number is a function of (seed, stream, index), so it is the same for any number of threads and any order
   of evaluation. */
#ifndef GBT_BASE_RNG_H
#define GBT_BASE_RNG_H

#include <math.h>
#include <stdint.h>

/**
 * All random streams that use the seed of a run (gbt_train_def.seed), with the meaning of their indices.
 *
 * Growth uses one stream per step and level, step * GROWTH_MAX_LEVELS + level, indexed by Gaussians. For
 * steps 0 and 1 these coincide with some of the streams below, so that a number may be used twice. A run
 * grows in these steps only if its first twentieth has at most one step; the numbers are still uniform, and
 * the two uses do not interact.
 */
enum {
    RNG_STREAM_RANDOM_ANCHORS = 0, /* points */
    RNG_STREAM_PHOTO_ORDER = 1,    /* epoch << 32 | position in the epoch */
    RNG_STREAM_NETWORKS = 2,       /* only index 0: the seed of decoder_init() */
    RNG_STREAM_SEED_POINTS = 3,    /* samples */
    RNG_STREAM_PIXELS = 4,         /* views of the run, in the order of steps */
    RNG_STREAM_BACKGROUND = 8,     /* views of the run */
    RNG_STREAM_LEFT_OUT = 10       /* (this << 48 | view of the run) is one stream per view, indexed by
                                      anchors */
};

/** Four independent 32-bit words for one key and counter. */
static inline void rng_philox(uint64_t seed, uint64_t stream, uint64_t index, uint32_t out[4])
{
    uint32_t key0 = (uint32_t)seed, key1 = (uint32_t)(seed >> 32);
    uint32_t c0 = (uint32_t)index, c1 = (uint32_t)(index >> 32), c2 = (uint32_t)stream,
             c3 = (uint32_t)(stream >> 32);
    for (int round = 0; round < 10; round++) {
        const uint64_t p0 = (uint64_t)0xD2511F53u * c0, p1 = (uint64_t)0xCD9E8D57u * c2;
        const uint32_t n0 = (uint32_t)(p1 >> 32) ^ c1 ^ key0, n2 = (uint32_t)(p0 >> 32) ^ c3 ^ key1;
        c1 = (uint32_t)p1;
        c3 = (uint32_t)p0;
        c0 = n0;
        c2 = n2;
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

/** A word as a number in [0, 1), 24 bits. */
static inline float rng_unit(uint32_t word) { return (float)(word >> 8) * 0x1p-24f; }

/** Uniform in [0, 1), 24 bits. */
static inline float rng_uniform(uint64_t seed, uint64_t stream, uint64_t index)
{
    uint32_t words[4];
    rng_philox(seed, stream, index, words);
    return rng_unit(words[0]);
}

/** Standard normal (Box 1958). */
static inline double rng_normal(uint64_t seed, uint64_t stream, uint64_t index)
{
    uint32_t words[4];
    rng_philox(seed, stream, index, words);
    const double u = ((double)words[0] + 1.0) * 0x1p-32, v = (double)words[1] * 0x1p-32;
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v);
}

#endif
