/* SPDX-License-Identifier: Apache-2.0 */
/* pose/result.h -- the largest of COLMAP's models as DATA/sparse/0, and what is to be said of it. */
#ifndef GBT_POSE_RESULT_H
#define GBT_POSE_RESULT_H

#include "pose/job.h"

/** Copy the model with the most photos to DATA/sparse/0, whole or not at all. GBT_ERR_FORMAT when there is
    none, and when one is damaged: then mapping is not done. */
gbt_status result_take(const job *j, gbt_error *err);

/** What DATA/sparse/0 holds, and which photos it lacks and why: on `report`, and all of them in
    DATA/colmap/not_registered.txt. */
gbt_status result_report(const job *j, FILE *report, gbt_error *err);

#endif
