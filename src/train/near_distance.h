/* SPDX-License-Identifier: Apache-2.0 */
/* train/near_distance.h -- from which distance on a camera sees things. */
#ifndef GBT_TRAIN_NEAR_DISTANCE_H
#define GBT_TRAIN_NEAR_DISTANCE_H

#include "data/scene.h"
#include "gbtrace/train.h"

/**
 * Nothing can be nearer to a camera than this: `share` of the depth of the nearest points of photos. Where a
 * photo was taken there is room up to what it shows, also when the model puts a wall in its way that only
 * others show, from afar, and from its other side. One photo in twenty may be nearer to things:
 * near_of_view() is for those, or a single close-up would take the room away from all.
 *
 * @param out [out] 0 where no photo knows its nearest points
 * @return GBT_OK or GBT_ERR_NO_MEMORY
 */
gbt_status near_of_scene(const scene *s, const size_t *views, size_t count, double share, float *out,
                         gbt_error *err);

/** The near distance for a photo, of a model whose own is `t_near`: less where the photo shows points that
   are nearer, def->near of the depth of its nearest ones. The model's own by rules that do not look at
   points. */
float near_of_view(float t_near, const gbt_train_def *def, const scene_view *view);

#endif
