/* SPDX-License-Identifier: Apache-2.0 */
/* trace/rounding_band.c -- rays on which float32 and double may decide differently. */
#include "trace/rounding_band.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"

static const double alpha_band = 1e-6, transmittance_band = 1e-5, depth_band = 2e-6;

/* `hits` include some that are a little below alpha_min. */
static bool is_in_band(const reference_scene *scene, const trace_settings *s, const reference_hit *hits,
                       size_t count)
{
    const double alpha_min = (double)s->alpha_min, alpha_max = (double)s->alpha_max,
                 stop = (double)s->transmittance_min;
    double T = 1, before = -1;
    for (size_t i = 0; i < count; i++) {
        const reference_hit *h = &hits[i];
        const double raw = scene->fields[REFERENCE_opacity * scene->count + h->id] * exp(-0.5 * h->d2);
        if (fabs(raw - alpha_min) < alpha_band || fabs(raw - alpha_max) < alpha_band)
            return true;
        if (h->alpha < alpha_min)
            continue;
        if (h->t != before && h->t - before < depth_band * h->t)
            return true;
        before = h->t;
        const double next = T * (1 - h->alpha);
        if (fabs(next - stop) < transmittance_band * stop)
            return true;
        if (next < stop)
            return false;
        T = next;
    }
    return false;
}

gbt_status rounding_band_find(const reference_scene *scene, const trace_settings *settings,
                              const float origin[3], const float dir[3], band_scratch *scratch, bool *in_band)
{
    trace_settings loose = *settings;
    size_t count;
    double from[3], along[3];
    loose.alpha_min = fmaxf(loose.alpha_min - 2 * (float)alpha_band, 0);
    for (int k = 0; k < 3; k++) {
        from[k] = (double)origin[k];
        along[k] = (double)dir[k];
    }
    GBT_TRY(reference_scene_ray_hits(scene, &loose, from, along, &scratch->hits, &count, &scratch->capacity,
                                     NULL));
    *in_band = is_in_band(scene, settings, scratch->hits, count);
    return GBT_OK;
}

void band_scratch_free(band_scratch *scratch)
{
    mem_free(scratch->hits);
    memset(scratch, 0, sizeof *scratch);
}
