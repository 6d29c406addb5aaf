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
    /* where camera `view` of `view_count` stands, and what it looks at, in place of the rings; NULL: rings */
    void (*stand)(int view, int view_count, double eye[3], double target[3]);
    float jitter;       /* std-dev of eye and target, scene units */
    float focal_widths; /* focal length in image widths */
    float sight;        /* views find no points farther than this; 0: they find them at any distance */
    int bake_rays;
} recipe;

extern const recipe recipe_tabletop;
extern const recipe recipe_courtyard;
extern const recipe recipe_terrain;
extern const recipe recipe_district;

#endif
