/* SPDX-License-Identifier: Apache-2.0 */
/* pose/job.h -- one call of gbt_pose(): where its files are, and its photos. */
#ifndef GBT_POSE_JOB_H
#define GBT_POSE_JOB_H

#include <stdbool.h>
#include <stddef.h>

#include "base/image.h"
#include "gbtrace/pose.h"

enum { JOB_PATH_SIZE = 4096, JOB_GROUPS_MAX = 8 };

typedef struct job_photo {
    char *name; /* below the folder of photos; owned */
    int width, height;
    image_lens lens; /* {0} in a film */
    int group;       /* of photos that share a camera, by size and EXIF; from 0 */
} job_photo;

typedef struct job {
    gbt_pose_def def;
    char source[JOB_PATH_SIZE]; /* absolute: the folder of photos, or the film */
    bool is_film, in_place;     /* in place: the photos are DATA/images already */
    char data[JOB_PATH_SIZE], images[JOB_PATH_SIZE], work[JOB_PATH_SIZE], database[JOB_PATH_SIZE],
        models[JOB_PATH_SIZE]; /* DATA, DATA/images, DATA/colmap and in it */
    size_t photo_count, photo_capacity;
    job_photo *photos;         /* sorted by name */
    int groups;                /* more than JOB_GROUPS_MAX: every photo has a camera of its own */
    size_t left_out;           /* files that are no usable photos */
    size_t other_count;        /* photos in formats that are not read */
    char other[JOB_PATH_SIZE]; /* the name of the first of them */
} job;

/** The path of a file in DATA/colmap. */
gbt_status job_path(const job *j, const char *name, char out[JOB_PATH_SIZE], gbt_error *err);

/** Remove the files of a folder, and the folder if nothing else is in it. */
void job_remove_folder(const char *folder);

/** A stage is finished when an empty file says so. */
bool job_is_done(const job *j, const char *stage);
gbt_status job_set_done(const job *j, const char *stage, gbt_error *err);
void job_set_undone(const job *j, const char *stage);

#endif
