/* SPDX-License-Identifier: Apache-2.0 */
/* report/scene.h -- sections about the scene: where its cameras stand, and what its model is made of. */
#ifndef GBT_REPORT_SCENE_H
#define GBT_REPORT_SCENE_H

#include "eval/scores.h"
#include "run/loaded_run.h"
#include "report/text.h"

/** Add the section "The scene": maps of the cameras from above and from the side, held-out ones marked, over
    points and anchors. Needs `r` with its data set; adds nothing if that has no views. */
void report_scene(text *out, const loaded_run *r, const evaluation *e);

/** Add the section that shows one view as points, balls, anchors, Gaussians, render and photo. Renders the
    view; adds nothing if no view can be seen through a pinhole. */
void report_layers(text *out, loaded_run *r, const evaluation *e);

#endif
