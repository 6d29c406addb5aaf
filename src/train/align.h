/* SPDX-License-Identifier: Apache-2.0 */
/* train/align.h -- held-out photos, fitted into a scene that they are not in. */
#ifndef GBT_TRAIN_ALIGN_H
#define GBT_TRAIN_ALIGN_H

#include "train/trainer.h"

/**
 * Where poses are learned, those of the held-out photos cannot be: their given poses are as wrong as the
 * others were, and the scene is not where these say. Each is brought, from its given pose, to where the
 * scene as it stands fits its photo best: six numbers of the camera, nothing of the scene. Small pictures
 * first.
 *
 * @return GBT_OK; GBT_ERR_INTERRUPTED at a signal (base/stop_signal.h): one photo is somewhere on its way
 */
gbt_status align_held_out(trainer *t, gbt_error *err);

#endif
