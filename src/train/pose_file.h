/* SPDX-License-Identifier: Apache-2.0 */
/* train/pose_file.h -- RUN/poses.json: the camera poses of a run's photos as training refined them. */
#ifndef GBT_TRAIN_POSE_FILE_H
#define GBT_TRAIN_POSE_FILE_H

#include "data/scene.h"

#define POSE_FILE_NAME "poses.json"

/** Write the poses of all views, in world coordinates, keyed by name. */
gbt_status pose_file_write(const scene *s, bool held_out_aligned, const char *path, gbt_error *err);

/** Set the poses of the views of `s` that the file names; other views keep theirs. `held_out_aligned` [out]:
    true, too, when the file does not say it. GBT_ERR_IO, or GBT_ERR_FORMAT for what is no such file. */
gbt_status pose_file_read(const char *path, scene *s, bool *held_out_aligned, gbt_error *err);

#endif
