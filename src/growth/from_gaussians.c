/* SPDX-License-Identifier: Apache-2.0 */
/* growth/from_gaussians.c -- growth candidates at the means of Gaussians with a large screen-space gradient:
   the loss still pulls them to move. */
#include <math.h>

#include "anchor/activations.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "growth/sources.h"

enum { CHOOSE_BLOCK = 4096 /* Gaussians */ };

/* Does the Gaussian survive the random drop of candidates? base/rng.h lists the random streams. */
static bool is_drawn(const growth_def *def, int level, uint64_t slot)
{
    return rng_uniform(def->seed, def->step * GROWTH_MAX_LEVELS + (uint64_t)level, slot) >
           ldexpf(1.0f, -(level + 1));
}

typedef struct choose_job {
    const growth_search *s;
    int level;
    float threshold;
    bool *chosen; /* one per Gaussian */
} choose_job;

static void choose_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const choose_job *job = context;
    const growth_search *s = job->s;
    for (size_t slot = begin; slot < end; slot++)
        job->chosen[slot] = growth_well_sampled(s->def, s->stats->grad_count[slot]) &&
                            growth_mean_gradient(s->stats, slot) >= job->threshold &&
                            is_drawn(s->def, job->level, slot);
}

static gbt_status add_means(growth_search *s, int level, bool *chosen, gbt_error *err)
{
    const anchors *a = s->a;
    const size_t offsets = (size_t)a->offset_count, slots = a->count * offsets;
    choose_job job = {s, level, growth_level_threshold(s->def, level), chosen};
    parallel_blocks(slots, CHOOSE_BLOCK, choose_block, &job);
    for (size_t slot = 0; slot < slots; slot++) {
        if (!chosen[slot])
            continue;
        const size_t i = slot / offsets;
        growth_candidate mean = {.scale = growth_cell_size(s->def, level),
                                 .gradient = growth_mean_gradient(s->stats, slot),
                                 .parent = i};
        for (size_t c = 0; c < 3; c++)
            mean.position[c] =
                a->position[i * 3 + c] + a->offset[slot * 3 + c] * activation_exp(a->scale_log[i * 6 + c]);
        GBT_TRY(growth_search_add(s, &mean, err));
    }
    return GBT_OK;
}

gbt_status growth_from_gaussians(growth_search *s, gbt_error *err)
{
    bool *chosen = mem_alloc(s->a->count * (size_t)s->a->offset_count, sizeof *chosen, "growth", err);
    gbt_status status = chosen != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    for (int level = 0; level < s->def->level_count && status == GBT_OK; level++) {
        if (!growth_search_begin(s, level))
            continue;
        status = add_means(s, level, chosen, err);
        if (status == GBT_OK)
            status = growth_search_end(s, s->def->may_stand, s->def->may_stand_context, err);
    }
    mem_free(chosen);
    return status;
}
