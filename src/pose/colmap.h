/* SPDX-License-Identifier: Apache-2.0 */
/* pose/colmap.h -- runs COLMAP's stages on the CPU: features, matching, mapping. */
#ifndef GBT_POSE_COLMAP_H
#define GBT_POSE_COLMAP_H

#include "pose/job.h"

/** How the installed COLMAP names its options. Version 4 renamed SiftExtraction.use_gpu to
    FeatureExtraction.use_gpu, and the same for matching; the other fields are options that older versions
    lack. */
typedef struct colmap_options {
    bool new_extraction, new_matching;
    bool camera_per_image, global_tolerance;
} colmap_options;

/** Find out what the installed COLMAP supports; GBT_ERR_IO when it is not installed. */
gbt_status colmap_find(const job *j, colmap_options *out, gbt_error *err);

/** Run all stages that are not finished. Afterwards DATA/colmap/models contains the models, possibly none. */
gbt_status colmap_stages(const job *j, const colmap_options *d, gbt_error *err);

#endif
