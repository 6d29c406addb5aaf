/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/recipe.h -- what a scene file provides: geometry, colours, and camera positions. */
#ifndef GBT_SCENES_RECIPE_H
#define GBT_SCENES_RECIPE_H

#include "scenes/world.h"

/** Cameras stand on rings, using the rings in turn, and look at `target`. */
typedef struct recipe_ring {
    float radius, height;
} recipe_ring;

typedef struct recipe {
    const char *name;
    const char *summary;     /* one line, for lists of scenes */
    const char *about;       /* one paragraph for SCENE.md */
    void (*build)(world *w); /* adds shapes, lamp and look; does not call world_finish() */
    recipe_ring rings[2];
    float target[3];
    /* where camera `view` of `view_count` stands and what it looks at; NULL: on the rings */
    void (*place_camera)(int view, int view_count, double eye[3], double target[3]);
    float jitter;        /* standard deviation of eye and target, scene units */
    float focal_widths;  /* focal length in image widths */
    float view_distance; /* views see no points beyond this distance; 0: no limit */
    int bake_rays;
} recipe;

extern const recipe recipe_tabletop;
extern const recipe recipe_courtyard;
extern const recipe recipe_terrain;
extern const recipe recipe_district;

#endif
