/* SPDX-License-Identifier: Apache-2.0 */
/* growth/from_points.c -- growth candidates at the sparse points, which lie on known surface. Where there is
   much detail they are closer together than v, so their cells are finer by one level. */
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "growth/sources.h"

/* Does any Gaussian of the anchor qualify? `well_sampled`: only those that enough views saw. `steepest`
   becomes the largest of their mean gradients. */
static bool any_gaussian_counts(const growth_search *s, size_t anchor, bool well_sampled, float *steepest)
{
    const size_t offsets = (size_t)s->a->offset_count;
    bool any = false;
    for (size_t slot = anchor * offsets; slot < (anchor + 1) * offsets; slot++) {
        if (well_sampled && !growth_well_sampled(s->def, s->stats->grad_count[slot]))
            continue;
        const float gradient = growth_mean_gradient(s->stats, slot);
        *steepest = any ? fmaxf(*steepest, gradient) : gradient;
        any = true;
    }
    return any;
}

static gbt_status add_points(growth_search *s, gbt_error *err)
{
    const growth_points *points = &s->def->points;
    const int finest = s->def->level_count - 1;
    const float threshold = growth_level_threshold(s->def, points->as_start ? 0 : finest),
                finest_size = growth_cell_size(s->def, finest);
    for (size_t p = 0; p < points->count; p++) {
        growth_candidate known = {.scale = points->as_start ? points->scale[p] : finest_size,
                                  .parent = points->anchor[p]};
        memcpy(known.position, points->position + 3 * p, sizeof known.position);
        if (any_gaussian_counts(s, known.parent, !points->as_start, &known.gradient) &&
            known.gradient >= threshold)
            GBT_TRY(growth_search_add(s, &known, err));
    }
    return GBT_OK;
}

gbt_status growth_from_points(growth_search *s, gbt_error *err)
{
    if (!growth_search_begin(s, s->def->level_count))
        return GBT_OK;
    GBT_TRY(add_points(s, err));
    return growth_search_end(s, growth_anywhere, NULL, err); /* no may_stand test: several photos have already
                                                                triangulated the points */
}
