/* SPDX-License-Identifier: Apache-2.0 */
/* growth/from_gaussians.c -- candidates at the means of Gaussians whose position would still move: their
   screen-space gradient is large. */
#include <math.h>

#include "anchor/activations.h"
#include "base/fail.h"
#include "base/rng.h"
#include "growth/sources.h"

/* Not lost to the random drop. */
static bool is_drawn(const growth_def *def, int level, uint64_t slot)
{
    return rng_uniform(def->seed, def->step * GROWTH_MAX_LEVELS + (uint64_t)level, slot) >
           ldexpf(1.0f, -(level + 1));
}

static gbt_status add_means(growth_search *s, int level, gbt_error *err)
{
    const anchors *a = s->a;
    const size_t offsets = (size_t)a->offset_count;
    const float threshold = growth_level_threshold(s->def, level);
    for (size_t slot = 0; slot < a->count * offsets; slot++) {
        const float gradient = growth_mean_gradient(s->stats, slot);
        if (!growth_well_sampled(s->def, s->stats->grad_count[slot]) || !(gradient >= threshold) ||
            !is_drawn(s->def, level, slot))
            continue;
        const size_t i = slot / offsets;
        growth_candidate mean = {.scale = growth_cell_size(s->def, level), .gradient = gradient, .parent = i};
        for (size_t c = 0; c < 3; c++)
            mean.position[c] =
                a->position[i * 3 + c] + a->offset[slot * 3 + c] * activation_exp(a->scale_log[i * 6 + c]);
        GBT_TRY(growth_search_add(s, &mean, err));
    }
    return GBT_OK;
}

gbt_status growth_from_gaussians(growth_search *s, gbt_error *err)
{
    for (int level = 0; level < s->def->level_count; level++) {
        if (!growth_search_begin(s, level))
            continue;
        GBT_TRY(add_means(s, level, err));
        GBT_TRY(growth_search_end(s, s->def->may_stand, s->def->may_stand_context, err));
    }
    return GBT_OK;
}
