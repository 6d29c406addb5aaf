/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/recipe.h -- what a scene file gives: geometry, colours, and where the cameras stand. */
#ifndef GBT_SCENES_RECIPE_H
#define GBT_SCENES_RECIPE_H

#include "scenes/world.h"

/** Cameras stand on one ring per row, sharing the views in turn, and look at `target`. */
typedef struct recipe_ring {
    float radius, height;
} recipe_ring;

typedef struct recipe {
    const char *name;
    const char *summary;     /* one line, for lists of scenes */
    const char *about;       /* one paragraph for SCENE.md */
    void (*build)(world *w); /* shapes, lamp and look; not finished */
    recipe_ring rings[2];
    float target[3];
    float jitter;       /* std-dev of eye and target, scene units */
    float focal_widths; /* focal length in image widths */
    int bake_rays;
} recipe;

extern const recipe recipe_tabletop;
extern const recipe recipe_courtyard;
extern const recipe recipe_terrain;

#endif
