/* SPDX-License-Identifier: Apache-2.0 */
/* train/near_distance.h -- the near distance of rendering, of a scene and of single photos. */
#ifndef GBT_TRAIN_NEAR_DISTANCE_H
#define GBT_TRAIN_NEAR_DISTANCE_H

#include "data/scene.h"
#include "gbtrace/train.h"

/**
 * The near distance of a scene: `share` of the depth of the photos' nearest points. The space between a
 * camera and what its photo shows must be empty, so nothing nearer is rendered; otherwise the model could put
 * there a surface that only other photos see, from far away and from behind. One photo in twenty may be
 * nearer to the scene than that, or a single close-up would shorten the distance for all; near_of_view()
 * serves those photos.
 *
 * @param out [out] 0 when no photo has a depth of nearest points
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status near_of_scene(const scene *s, const size_t *views, size_t count, double share, float *out,
                         gbt_error *err);

/** The near distance for one photo of a model with near distance `t_near`: def->near times the depth of the
    photo's nearest points if that is less, otherwise t_near. Rules that do not use points give t_near. */
float near_of_view(float t_near, const gbt_train_def *def, const scene_view *view);

#endif
