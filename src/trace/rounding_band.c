/* SPDX-License-Identifier: Apache-2.0 */
/* trace/rounding_band.c -- rays on which float32 and double may decide differently. */
#include "trace/rounding_band.h"

#include <math.h>

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

typedef struct band_job {
    const reference_scene *scene;
    const trace_settings *settings;
    bool *in_band;
} band_job;

static void look_at_ray(void *context, size_t ray, const reference_hit *hits, size_t count)
{
    const band_job *job = context;
    job->in_band[ray] = is_in_band(job->scene, job->settings, hits, count);
}

gbt_status rounding_band_find(const reference_scene *scene, const trace_settings *settings,
                              const ray_image *rays, bool *in_band, gbt_error *err)
{
    trace_settings loose = *settings;
    band_job job = {scene, settings, in_band};
    loose.alpha_min = fmaxf(loose.alpha_min - 2 * (float)alpha_band, 0);
    loose.packet_order = false; /* neighbours in depth are wanted */
    return reference_scene_visit(scene, &loose, rays, in_band, look_at_ray, &job, err);
}
