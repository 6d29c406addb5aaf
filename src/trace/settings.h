/* SPDX-License-Identifier: Apache-2.0 */
/* trace/settings.h -- the numbers in the definition of what one ray sees. */
#ifndef GBT_TRACE_SETTINGS_H
#define GBT_TRACE_SETTINGS_H

#include <stdbool.h>

#include "base/sky.h"
#include "gbtrace/choices.h"

typedef struct trace_settings {
    float alpha_min; /* a hit counts when alpha >= this; > 0. Default 1/255 */
    float alpha_max; /* alpha is cut here; the gradient through the cut is exactly 0. (0, 1). Default 0.99 */
    float transmittance_min; /* stop before the hit that would bring T below this. Default 1e-4 */
    float t_near;            /* nearest depth of a response, scene-local units, >= 0. Default 0.01 */
    float background[3];     /* blended last, with the remaining T. Default 0 */
    sky sky;                 /* added to it as a function of the ray's direction. Default nothing */
    bool packet_order; /* an approximation for training (docs/tracing.md): the hits of 4 x 4 neighbouring rays
                          are blended in one order, and not in each ray's own. First the Gaussians that one of
                          these rays hits at t_near, by index; then the others by their depth on a ray in the
                          middle, kept between half and twice that on the next ray that is hit. Hits behind
                          those that have made a ray opaque may be left out. Only rays that go over lists heed
                          it. Default false */
    float spread; /* with packet_order, the adjoint adds the gradient of spread * sum over rays and over pairs
                     of their hits, i blended before j, of 2 w_i w_j (u_i - u_j), where w = T alpha and u =
                     t_near / max(t, t_near) is a constant: opacities change so that a ray's weight gathers at
                     one depth (Barron 2022, eq 15). Default 0 */
} trace_settings;

static inline trace_settings trace_settings_default(void)
{
    return (trace_settings){
        .alpha_min = 1.0f / 255.0f, .alpha_max = 0.99f, .transmittance_min = 1e-4f, .t_near = 0.01f};
}

/**
 * Set how much is left out of a picture; bounds on what that changes: docs/accuracy.md.
 *
 * Sets alpha_min and transmittance_min. The rest is what the model was trained with, and stays.
 * GBT_PRESET_AS_TRAINED sets nothing.
 */
static inline void trace_settings_preset(gbt_preset preset, trace_settings *out)
{
    static const struct {
        float alpha_min, transmittance_min;
    } presets[] = {[GBT_PRESET_EXACT] = {1e-5f, 1e-6f},
                   [GBT_PRESET_DEFAULT] = {1.0f / 255.0f, 1e-4f},
                   [GBT_PRESET_FAST] = {0.02f, 1e-3f}};
    if (preset == GBT_PRESET_AS_TRAINED)
        return;
    out->alpha_min = presets[preset].alpha_min;
    out->transmittance_min = presets[preset].transmittance_min;
}

#endif
