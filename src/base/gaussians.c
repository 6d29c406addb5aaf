/* SPDX-License-Identifier: Apache-2.0 */
/* base/gaussians.c -- the padded arrays of Gaussians. */
#include "base/gaussians.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"

static size_t padded(size_t count)
{
    return (count + GAUSSIANS_LANES - 1) / GAUSSIANS_LANES * GAUSSIANS_LANES;
}

gbt_status gaussians_resize(gaussians *g, size_t count, gbt_error *err)
{
    if (padded(count) > g->capacity || g->mean_x == NULL) {
        /* One allocation for all fields, with an eighth of spare room because the count varies from view to
           view. */
        const size_t capacity = padded(count + count / 8 + 1);
        float *block = mem_alloc(capacity, GAUSSIANS_FIELD_COUNT * sizeof *block, "gaussians", err);
        if (block == NULL)
            return GBT_ERR_NO_MEMORY;
        mem_free(g->mean_x);
        g->capacity = capacity;
#define X(name, pad, meaning) g->name = block, block += capacity;
        GAUSSIANS_FIELDS(X)
#undef X
    }
    g->count = count;
    return GBT_OK;
}

void gaussians_pad(gaussians *g)
{
    for (size_t i = g->count; i < padded(g->count); i++) {
#define X(name, pad, meaning) g->name[i] = pad;
        GAUSSIANS_FIELDS(X)
#undef X
    }
}

void gaussians_zero(gaussians *g)
{
#define X(name, pad, meaning) memset(g->name, 0, padded(g->count) * sizeof(float));
    GAUSSIANS_FIELDS(X)
#undef X
}

void gaussians_zero_padding(gaussians *g)
{
    for (size_t i = g->count; i < padded(g->count); i++) {
#define X(name, pad, meaning) g->name[i] = 0;
        GAUSSIANS_FIELDS(X)
#undef X
    }
}

void gaussians_copy_range(const gaussians *g, size_t begin, size_t end, gaussians *out)
{
    if (begin >= end)
        return;
#define X(name, pad, meaning) memcpy(out->name + begin, g->name + begin, (end - begin) * sizeof *g->name);
    GAUSSIANS_FIELDS(X)
#undef X
}

gbt_status gaussians_copy(const gaussians *g, gaussians *out, gbt_error *err)
{
    GBT_TRY(gaussians_resize(out, g->count, err));
    gaussians_copy_range(g, 0, g->count, out);
    gaussians_pad(out);
    return GBT_OK;
}

void gaussians_free(gaussians *g)
{
    mem_free(g->mean_x); /* the first field starts the one block */
    memset(g, 0, sizeof *g);
}
