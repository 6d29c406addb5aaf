/* SPDX-License-Identifier: Apache-2.0 */
/* pose/colmap.h -- COLMAP's stages on the CPU: features, matching, mapping. */
#ifndef GBT_POSE_COLMAP_H
#define GBT_POSE_COLMAP_H

#include "pose/job.h"

/** COLMAP 4 calls SiftExtraction.use_gpu FeatureExtraction.use_gpu, and likewise of matching. The others are
    options that older ones lack. */
typedef struct dialect {
    bool new_extraction, new_matching;
    bool camera_per_image, global_tolerance;
} dialect;

/** Which names the installed one has; GBT_ERR_IO when there is none. */
gbt_status colmap_find(const job *j, dialect *out, gbt_error *err);

/** Run what is not finished yet; DATA/colmap/models holds models afterwards, perhaps none. */
gbt_status colmap_stages(const job *j, const dialect *d, gbt_error *err);

#endif
