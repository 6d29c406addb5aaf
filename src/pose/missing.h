/* SPDX-License-Identifier: Apache-2.0 */
/* pose/missing.h -- why photos were not registered. */
#ifndef GBT_POSE_MISSING_H
#define GBT_POSE_MISSING_H

#include "pose/job.h"

/** Write a line for each photo that is not in `registered` [photo_count]: the first ones to `report` (NULL:
    none), all of them to DATA/colmap/not_registered.txt. */
gbt_status missing_report(const job *j, const bool *registered, FILE *report, gbt_error *err);

#endif
