/* SPDX-License-Identifier: Apache-2.0 */
/* train/held_out.h -- PSNR of the held-out photos during training. */
#ifndef GBT_TRAIN_HELD_OUT_H
#define GBT_TRAIN_HELD_OUT_H

#include "train/trainer.h"

/**
 * Mean PSNR over the held-out views at full training resolution, on 8-bit images. With --exposure only their
 * right halves are scored (affine_split()); with --refine-poses they are rendered from aligned poses
 * (align_held_out()), which are discarded afterwards.
 *
 * @return also GBT_ERR_INTERRUPTED at a signal (base/stop_signal.h)
 */
gbt_status held_out_psnr(trainer *t, double *psnr, gbt_error *err);

#endif
