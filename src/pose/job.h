/* SPDX-License-Identifier: Apache-2.0 */
/* pose/job.h -- the state of one call of gbt_pose(): paths and photos. */
#ifndef GBT_POSE_JOB_H
#define GBT_POSE_JOB_H

#include <stdbool.h>
#include <stddef.h>

#include "base/image.h"
#include "gbtrace/pose.h"

enum { JOB_PATH_SIZE = 4096, JOB_GROUPS_MAX = 8 };

typedef struct job_photo {
    char *name; /* relative to the folder of photos; owned */
    int width, height;
    image_lens lens; /* {0} for a film */
    int group;       /* photos of one group share a camera, judged by size and EXIF; from 0 */
} job_photo;

typedef struct job {
    gbt_pose_def def;
    char source[JOB_PATH_SIZE]; /* absolute: the folder of photos, or the film */
    bool is_film, in_place;     /* in_place: the photos are already in DATA/images */
    char data[JOB_PATH_SIZE], images[JOB_PATH_SIZE], work[JOB_PATH_SIZE], database[JOB_PATH_SIZE],
        models[JOB_PATH_SIZE]; /* DATA, DATA/images, DATA/colmap, and paths in DATA/colmap */
    size_t photo_count, photo_capacity;
    job_photo *photos;         /* sorted by name */
    int groups;                /* if more than JOB_GROUPS_MAX, every photo has a camera of its own */
    size_t left_out;           /* files that are not usable as photos */
    size_t other_count;        /* photos in unsupported formats */
    char other[JOB_PATH_SIZE]; /* the name of the first of them */
} job;

/** The path of a file in DATA/colmap. */
gbt_status job_path(const job *j, const char *name, char out[JOB_PATH_SIZE], gbt_error *err);

/** Remove the files in a folder, and the folder itself if nothing else is left in it. */
void job_remove_folder(const char *folder);

/** Whether a stage is finished, which an empty file records. */
bool job_is_done(const job *j, const char *stage);
gbt_status job_set_done(const job *j, const char *stage, gbt_error *err);
void job_set_undone(const job *j, const char *stage);

#endif
