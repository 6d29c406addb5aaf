/* SPDX-License-Identifier: Apache-2.0 */
/* pose/film.h -- extracts photos from a film with ffmpeg: measure all frames at a small size, choose some,
   decode these at full size. */
#ifndef GBT_POSE_FILM_H
#define GBT_POSE_FILM_H

#include "pose/job.h"

/** Write DATA/images/frame_00001.jpg and so on; either all or none. */
gbt_status film_to_photos(const job *j, gbt_error *err);

#endif
