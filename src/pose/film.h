/* SPDX-License-Identifier: Apache-2.0 */
/* pose/film.h -- photos from a film: measured at a small size, chosen, decoded at full size, by ffmpeg. */
#ifndef GBT_POSE_FILM_H
#define GBT_POSE_FILM_H

#include "pose/job.h"

/** Write DATA/images/frame_00001.jpg and so on, all or none. */
gbt_status film_to_photos(const job *j, gbt_error *err);

#endif
