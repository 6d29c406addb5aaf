/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo_check.h -- checks all photos and masks of a scene by their headers, without reading pixels. */
#ifndef GBT_DATA_PHOTO_CHECK_H
#define GBT_DATA_PHOTO_CHECK_H

#include "data/scene.h"

enum { PHOTO_CHECK_SHOWN = 5, PHOTO_CHECK_TEXT = 400 };

typedef struct photo_check {
    size_t found;       /* photos with a readable header */
    size_t unreadable;  /* photos or masks whose header cannot be read or is not supported: training would
                           reject them */
    size_t other_shape; /* readable, but a photo without its camera's aspect ratio or a mask without its
                           photo's: training would reject these, too */
    size_t other_size;  /* photos with the camera's aspect ratio, but another size */
    size_t tiny;        /* photos so much smaller than their camera says that they show hardly any detail */
    size_t turned;      /* photos with an EXIF rotation, which is not applied */
    size_t with_alpha, with_mask, exr;
    int min_width, min_height, max_width, max_height;  /* over the photos found */
    char problem[PHOTO_CHECK_SHOWN][PHOTO_CHECK_TEXT]; /* the first problems of all the kinds above, one line
                                                          each */
    size_t problem_count; /* number of problems, which may be more than are kept in `problem` */
    gbt_error refused; /* the first reason why training would reject a photo or mask; status GBT_OK: none */
} photo_check;

/** Check all views; sets their photo_width, has_alpha and is_exr. Cost: a few reads per photo. */
void photo_check_all(scene *s, photo_check *out);

/** Log a one-line warning each about rotated photos, tiny photos and EXR files, if there are any. */
void photo_check_warn(const photo_check *check, const char *data);

#endif
