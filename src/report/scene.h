/* report/scene.h -- the place that a run is of: where its cameras stand, and what its model is made of. */
#ifndef GBT_REPORT_SCENE_H
#define GBT_REPORT_SCENE_H

#include "report/scores.h"
#include "render/loaded_run.h"
#include "report/text.h"

/**
 * Add the section: two maps, and one view as points, balls, anchors, Gaussians, render and photo. `r` with its data set; it renders that
 * view.
 */
void report_scene(text *out, loaded_run *r, const evaluation *e);

/** The two maps: cameras from above and from the side, held-out ones marked, over points and anchors. */
void report_maps(text *out, const loaded_run *r, const evaluation *e);

/** One view, from points to the picture. */
void report_layers(text *out, loaded_run *r, const evaluation *e);

#endif
