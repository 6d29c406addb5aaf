/* SPDX-License-Identifier: Apache-2.0 */
/* train/held_out.h -- how well a scene in training shows the photos that it does not learn from. */
#ifndef GBT_TRAIN_HELD_OUT_H
#define GBT_TRAIN_HELD_OUT_H

#include "train/trainer.h"

/**
 * Mean PSNR over the held-out views at full training resolution, on 8-bit images; of their right halves with
 * --exposure (affine_split()); from poses that fit them with --refine-poses (align_held_out()), which are
 * forgotten.
 *
 * @return also GBT_ERR_INTERRUPTED at a signal (base/stop_signal.h)
 */
gbt_status held_out_psnr(trainer *t, double *psnr, gbt_error *err);

#endif
