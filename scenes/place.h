/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/place.h -- short forms for colours, boxes and tubes in scene recipes. */
#ifndef GBT_SCENES_PLACE_H
#define GBT_SCENES_PLACE_H

#include "scenes/world.h"

static inline void set(float out[3], float r, float g, float b)
{
    out[0] = r;
    out[1] = g;
    out[2] = b;
}

static inline void box(world *w, int material, int variant, float x, float y, float z, float half_x,
                       float half_y, float half_z, float cell)
{
    world_box(w, material, variant, (const float[3]){x, y, z}, (const float[3]){half_x, half_y, half_z},
              cell);
}

static inline void tube(world *w, int material, float ax, float ay, float az, float bx, float by, float bz,
                        float radius)
{
    world_tube(w, material, (const float[3]){ax, ay, az}, (const float[3]){bx, by, bz}, radius, 8);
}

#endif
