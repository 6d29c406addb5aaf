/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo_check.h -- what the headers of all photos and masks of a scene say, before any pixel is read. */
#ifndef GBT_DATA_PHOTO_CHECK_H
#define GBT_DATA_PHOTO_CHECK_H

#include "data/scene.h"

enum { PHOTO_CHECK_SHOWN = 5, PHOTO_CHECK_TEXT = 400 };

typedef struct photo_check {
    size_t found;       /* readable, by their headers */
    size_t unreadable;  /* photos or masks that training would refuse, by their headers */
    size_t other_shape; /* readable, but not the camera's shape, or a mask not the photo's: training would
                           refuse them too */
    size_t other_size;  /* of the camera's shape, but another size */
    size_t tiny;        /* so small beside the camera's size that hardly anything is on them */
    size_t turned;      /* with an EXIF rotation, which is not applied */
    size_t with_alpha, with_mask, exr;
    int min_width, min_height, max_width, max_height;  /* of those found */
    char problem[PHOTO_CHECK_SHOWN][PHOTO_CHECK_TEXT]; /* the first of all these, a line each */
    size_t problem_count;                              /* all of them; more than are shown, perhaps */
    gbt_error refused; /* the first reason for which training would refuse one; status GBT_OK: none */
} photo_check;

/** Sets photo_width, has_alpha and is_exr of the views. Cost: a few reads per photo. */
void photo_check_all(scene *s, photo_check *out);

/** A warning, each in one line, for photos that are turned, for tiny ones and for EXR files. */
void photo_check_warn(const photo_check *check, const char *data);

#endif
