/* SPDX-License-Identifier: Apache-2.0 */
/* stability/model.h -- write a 3DGS file in memory and read it back, for the cases of the study "stability".
 */
#ifndef GBT_STABILITY_MODEL_H
#define GBT_STABILITY_MODEL_H

#include "data/gaussian_cloud.h"
#include "stability/stability.h"

enum { MODEL_COLUMNS = 14 }; /* x y z, f_dc 0 to 2, opacity (logit), scale (log) 0 to 2, rot 0 to 3 */

/**
 * Write rows as a binary 3DGS .ply in memory, and read it back.
 *
 * @return the reader's status; GBT_ERR_FORMAT (nothing usable was left) does not fail the case
 */
gbt_status stability_read_model(stability *s, const float (*rows)[MODEL_COLUMNS], size_t count,
                                gaussian_cloud *out);

/** The number of values in a cloud that are not finite. */
size_t stability_bad_in_model(const gaussian_cloud *cloud);

#endif
