/* SPDX-License-Identifier: Apache-2.0 */
/* tests/anchor/fixture.h -- random anchors and decoders of any size, from a seed. */
#ifndef GBT_TESTS_ANCHOR_FIXTURE_H
#define GBT_TESTS_ANCHOR_FIXTURE_H

#include "gaussians_support.h"

#include "anchor/decode.h"
#include "base/hash.h"
#include "base/memory.h"

static inline float spread(uint64_t seed, uint64_t stream, uint64_t index, float low, float high)
{
    return low + (high - low) * rng_uniform(seed, stream, index);
}

static inline anchors random_anchors(size_t count, int offset_count, uint64_t seed)
{
    anchors a = {.offset_count = offset_count};
    assert_ok(anchors_resize(&a, count, NULL));
    for (size_t i = 0; i < count * 3; i++)
        a.position[i] = spread(seed, 100, i, -2.0f, 2.0f);
    for (size_t i = 0; i < count * ANCHOR_FEATURE_DIM; i++)
        a.feature[i] = spread(seed, 101, i, -1.0f, 1.0f);
    for (size_t i = 0; i < count * (size_t)offset_count * 3; i++)
        a.offset[i] = spread(seed, 102, i, -1.0f, 1.0f);
    for (size_t i = 0; i < count * 6; i++)
        a.scale_log[i] = spread(seed, 103, i, -3.0f, 0.5f);
    return a;
}

static inline decoder random_decoder(int offset_count, bool has_distance, uint64_t seed)
{
    decoder d;
    assert_ok(decoder_init(&d, offset_count, has_distance, seed, NULL));
    d.distance_scale = 0.4f;
    d.distance_min = 0.2f;
    d.distance_max = 2.5f;
    return d;
}

/* Every `step`-th anchor. */
static inline uint32_t *every(size_t count, size_t step, size_t *visible_count)
{
    uint32_t *visible = mem_alloc(count, sizeof *visible, "test", NULL);
    *visible_count = 0;
    for (size_t i = 0; i < count; i += step)
        visible[(*visible_count)++] = (uint32_t)i;
    return visible;
}

static inline uint64_t hash_gaussians(uint64_t hash, const gaussians *g)
{
    float *fields[GAUSSIANS_FIELD_COUNT];
    field_list(g, fields);
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        hash = hash_bytes(hash, fields[f], g->count * sizeof(float));
    return hash;
}

#endif
