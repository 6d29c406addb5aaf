/* SPDX-License-Identifier: Apache-2.0 */
/* pose/photos.h -- the photos of a folder: which they are, which share a camera, and their links in DATA. */
#ifndef GBT_POSE_PHOTOS_H
#define GBT_POSE_PHOTOS_H

#include "pose/job.h"

/** All usable photos of `folder` and its sub-folders, sorted by name, with their sizes and lenses; warns of
   others. GBT_ERR_FORMAT without any. */
gbt_status photos_list(job *j, const char *folder, gbt_error *err);

/** Put photos of one size, camera model and focal length (EXIF) into one group; a film is one. */
void photos_group(job *j);

/** Hard links in DATA/images, or copies where the file system has none. */
gbt_status photos_link(const job *j, gbt_error *err);

void photos_free(job *j);

#endif
