/* SPDX-License-Identifier: Apache-2.0 */
/* pose/result.h -- copies the largest of COLMAP's models to DATA/sparse/0, and reports on it. */
#ifndef GBT_POSE_RESULT_H
#define GBT_POSE_RESULT_H

#include "pose/job.h"

/** Copy the model with the most photos to DATA/sparse/0, completely or not at all. GBT_ERR_FORMAT when there
    is no model, or a damaged one; in that case mapping is repeated by the next call. */
gbt_status result_take(const job *j, gbt_error *err);

/** Describe DATA/sparse/0 on `report`, and say which photos are missing and why; all of these are listed in
    DATA/colmap/not_registered.txt. */
gbt_status result_report(const job *j, FILE *report, gbt_error *err);

#endif
