/* SPDX-License-Identifier: Apache-2.0 */
/* train/align.h -- align the poses of held-out photos with a scene that was trained without them. */
#ifndef GBT_TRAIN_ALIGN_H
#define GBT_TRAIN_ALIGN_H

#include "train/trainer.h"

/**
 * Align the pose of every held-out photo with the scene, by minimising the loss over the six numbers of its
 * camera; the scene stays fixed. Coarse images come first.
 *
 * Needed with learned poses: training moved scene and training cameras away from the given poses, which are
 * as wrong for the held-out photos as they were for the others.
 *
 * @return GBT_OK; GBT_ERR_INTERRUPTED at a signal (base/stop_signal.h): the photo in hand then has an
 * intermediate pose
 */
gbt_status align_held_out(trainer *t, gbt_error *err);

#endif
