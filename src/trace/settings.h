/* trace/settings.h -- the numbers in the definition of what one ray sees. */
#ifndef GBT_TRACE_SETTINGS_H
#define GBT_TRACE_SETTINGS_H

#include <math.h>

typedef struct trace_settings {
    float alpha_min;         /* a hit counts when alpha >= this; > 0. Default 1/255 */
    float alpha_max;         /* alpha is cut here; the gradient through the cut is exactly 0. (0, 1). Default 0.99 */
    float transmittance_min; /* stop before the hit that would bring T below this. Default 1e-4 */
    float proxy_radius;      /* a hit counts within this many std-devs; > 0. Default: infinite, alpha_min alone decides */
    float t_near;            /* nearest depth of a response, scene-local units, >= 0. Default 0.01 */
    float background[3];     /* blended last, with the remaining T. Default 0 */
} trace_settings;

static inline trace_settings trace_settings_default(void)
{
    return (trace_settings){.alpha_min = 1.0f / 255.0f, .alpha_max = 0.99f, .transmittance_min = 1e-4f, .proxy_radius = INFINITY, .t_near = 0.01f};
}

#endif
