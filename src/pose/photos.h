/* SPDX-License-Identifier: Apache-2.0 */
/* pose/photos.h -- the photos of a folder: lists them, groups them by camera, links them into DATA. */
#ifndef GBT_POSE_PHOTOS_H
#define GBT_POSE_PHOTOS_H

#include "pose/job.h"

/** List all usable photos of `folder` and its sub-folders, sorted by name, with sizes and lenses; warn about
    others. GBT_ERR_FORMAT when there are none. */
gbt_status photos_list(job *j, const char *folder, gbt_error *err);

/** Put photos with the same size, camera and focal length (EXIF) into one group; all frames of a film are one
    group. */
void photos_group(job *j);

/** Make hard links to the photos in DATA/images, or copies where the file system cannot link. */
gbt_status photos_link(const job *j, gbt_error *err);

void photos_free(job *j);

#endif
