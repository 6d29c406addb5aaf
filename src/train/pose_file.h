/* SPDX-License-Identifier: Apache-2.0 */
/* train/pose_file.h -- RUN/poses.json: where the photos of a run were taken, as training found it. */
#ifndef GBT_TRAIN_POSE_FILE_H
#define GBT_TRAIN_POSE_FILE_H

#include "data/scene.h"

#define POSE_FILE_NAME "poses.json"

/** Write the poses of all views, in world coordinates, by their names. */
gbt_status pose_file_write(const scene *s, bool held_out_aligned, const char *path, gbt_error *err);

/** Give the views of `s` the poses that the file has for their names; others keep theirs.
    `held_out_aligned` [out]: true, too, when the file does not say it.
    GBT_ERR_IO, or GBT_ERR_FORMAT for what is no such file. */
gbt_status pose_file_read(const char *path, scene *s, bool *held_out_aligned, gbt_error *err);

#endif
