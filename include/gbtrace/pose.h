/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/pose.h -- camera poses of photos or of a film, estimated by the programs COLMAP and ffmpeg. */
#ifndef GBTRACE_POSE_H
#define GBTRACE_POSE_H

#include <stdint.h>
#include <stdio.h>

#include "gbtrace/api.h"
#include "gbtrace/choices.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_pose_def {
    int frames;                   /* number taken from a film, [10, 2000]; 0: three per second of film, at
                                     least 60 and at most 200. Default 0 */
    gbt_pose_camera camera_model; /* Default GBT_POSE_CAMERA_AUTO */
    gbt_pose_matcher matcher;     /* Default GBT_POSE_MATCHER_AUTO */
    uint32_t cookie_;             /* set by gbt_pose_def_default() */
} gbt_pose_def;

gbt_pose_def gbt_pose_def_default(void);

/**
 * Estimate the camera poses of photos, and write a data set that gbt_train() reads: DATA/images,
 * DATA/sparse/0.
 *
 * From a film, sharp frames are chosen first, spread over its duration and camera motion. DATA/colmap keeps
 * COLMAP's database, settings and logs: after SIGINT, SIGTERM or a kill the same call continues and skips
 * finished stages. DATA/sparse appears only when it is complete.
 *
 * @param source [in] a folder of PNG and JPEG photos (with its sub-folders except masks/; its images/ is used
 *                    when it has none itself), or a film that ffmpeg reads
 * @param data   [in] folder, created when missing; may be `source` when the photos are in its images/
 * @param report [in] open stream: which photos were registered, and which were not and why; NULL: none
 * @return GBT_OK; GBT_ERR_ARGUMENT (`data` holds something else, or was begun with other settings or photos);
 *         GBT_ERR_IO (no colmap or ffmpeg, or one that failed: its log is named); GBT_ERR_FORMAT (no photos,
 *         none could be registered, or COLMAP's model is damaged: the same call makes it anew);
 *         GBT_ERR_INTERRUPTED; GBT_ERR_NO_MEMORY
 *
 * Threads: one call at a time in a process; COLMAP uses as many threads as gbt_set_threads() says. SIGCHLD
 * must not be ignored: then the exit status of a program is unknown, which counts as a failure.
 */
gbt_status gbt_pose(const char *source, const gbt_pose_def *def, const char *data, FILE *report,
                    gbt_error *err);

GBT_API_END
#endif
