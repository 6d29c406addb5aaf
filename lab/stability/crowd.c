/* SPDX-License-Identifier: Apache-2.0 */
/* stability/crowd.c -- a scene with many overlapping Gaussians, and the rays on which rounding may be
   visible. */
#include "stability/crowd.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/rng.h"
#include "stability/draw.h"
#include "trace/reference.h"

void stability_crowd(stability *s, gaussians *g)
{
    gaussians two = {0};
    const size_t more = (size_t)stability_number(s, "more_gaussians");
    const uint64_t seed = (uint64_t)stability_number(s, "seed");
    stability_gaussians(s, &two);
    draw_alloc(s, g, two.count + more);
    for (size_t i = 0; i < g->count && s->status == GBT_OK; i++) {
        double mean[3], scale[3], quat[4], color[3];
        draw_random_turn(seed, 20, i, quat);
        for (uint64_t k = 0; k < 3; k++) {
            mean[k] = rng_normal(seed, k, i) + (k == 2 ? 6 : 0);
            scale[k] = 0.1 + 0.6 * (double)rng_uniform(seed, 3 + k, i);
            color[k] = (double)rng_uniform(seed, 6 + k, i);
        }
        draw_set(g, i, mean, scale, quat, 0.2 + 0.7 * (double)rng_uniform(seed, 9, i), color);
    }
    if (s->status == GBT_OK) {
#define X(name, pad, meaning) memcpy(g->name, two.name, two.count * sizeof(float));
        GAUSSIANS_FIELDS(X)
#undef X
    }
    gaussians_free(&two);
}

size_t stability_find_edges(stability *s, const gaussians *g, const float *dirs, size_t ray_count,
                            bool *on_edge)
{
    trace_settings settings = trace_settings_default();
    const double alpha_min = (double)settings.alpha_min, stop = (double)settings.transmittance_min;
    reference_scene exact = {0};
    reference_hit *hits = NULL;
    size_t count = 0, capacity = 0, edges = 0;
    settings.alpha_min *= 0.99999f; /* also find those just below the cut-off */
    stability_ok(s, reference_scene_make(g, &exact, s->err));
    for (size_t i = 0; i < ray_count && s->status == GBT_OK; i++) {
        const double origin[3] = {0, 0, 0},
                     dir[3] = {(double)dirs[3 * i], (double)dirs[3 * i + 1], (double)dirs[3 * i + 2]};
        double T = 1;
        stability_ok(
            s, reference_scene_ray_hits(&exact, &settings, origin, dir, &hits, &count, &capacity, s->err));
        on_edge[i] = false;
        for (size_t h = 0; h < count && T >= 0.9 * stop && s->status == GBT_OK; h++) {
            T *= 1 - hits[h].alpha;
            on_edge[i] = on_edge[i] || (h > 0 && hits[h].t - hits[h - 1].t < 2e-6 * hits[h].t) ||
                         fabs(hits[h].alpha / alpha_min - 1) < 1e-5 || fabs(T / stop - 1) < 1e-5;
        }
        edges += on_edge[i];
    }
    reference_scene_free(&exact);
    mem_free(hits);
    return edges;
}
