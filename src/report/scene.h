/* SPDX-License-Identifier: Apache-2.0 */
/* report/scene.h -- the place that a run is of: where its cameras stand, and what its model is made of. */
#ifndef GBT_REPORT_SCENE_H
#define GBT_REPORT_SCENE_H

#include "eval/scores.h"
#include "run/loaded_run.h"
#include "report/text.h"

/** The section "The scene": cameras from above and from the side, held-out ones marked, over points and
    anchors. `r` with its data set; nothing where that has no view. */
void report_scene(text *out, const loaded_run *r, const evaluation *e);

/** The section of one view as points, balls, anchors, Gaussians, render and photo, which it renders; nothing
    where no view is a pinhole's. */
void report_layers(text *out, loaded_run *r, const evaluation *e);

#endif
