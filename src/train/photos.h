/* SPDX-License-Identifier: Apache-2.0 */
/* train/photos.h -- the training photos, kept as 8 bit as far as memory allows; whole, smaller, or every n-th
   pixel of them. */
#ifndef GBT_TRAIN_PHOTOS_H
#define GBT_TRAIN_PHOTOS_H

#include "data/scene.h"
#include "train/photo_pick.h"

/** Bytes of photos that a run keeps at most: half of the memory that is free, and this. */
#define PHOTOS_KEPT_BYTES ((size_t)1 << 32)

typedef struct photos {
    const scene *source; /* borrowed */
    double downscale;
    size_t bytes_max;       /* of photos that are kept; the others are read whenever they are asked for */
    size_t bytes;           /* of those that are */
    size_t kept_until_next; /* a view whose photo stays until the next that finds no room; SIZE_MAX: none */
    size_t decoded_max;   /* bytes that photos take while they are decoded at once; 0: a quarter of the memory
                             that is free */
    unsigned char **full; /* [view_count] NULL until asked for */
    unsigned char **full_valid; /* [view_count] marks of the same pixels: 0 where a value was not finite; NULL
                                   for a photo whose values are all finite */
    unsigned char **transparency; /* [view_count] how transparent each of them is, 255: wholly; NULL for a
                                     photo that is opaque, or whose alpha channel is a mask */
    unsigned char *some_valid;    /* of the last photo that was asked for smaller, or in every n-th pixel */
    size_t some_valid_capacity;
} photos;

/** Which pixels of a photo a training step looks at. */
typedef struct photo_sample {
    photo_pick pick;
    const float *backdrop; /* [3]: a colour behind what is transparent; NULL: that of scene_view.alpha */
} photo_sample;

/** By which the cameras of a scene are divided so that the median photo has this width: to the size of their
    photos if these are smaller than they, and further if it is wider. GBT_OK or GBT_ERR_NO_MEMORY. Cost:
   opens every photo. */
gbt_status photos_downscale_to(const scene *s, double width, double *downscale, gbt_error *err);

/** The same where nobody says a width: 1,600 pixels if `limits_width`, else as wide as it is. */
gbt_status photos_usual_downscale(const scene *s, bool limits_width, double *downscale, gbt_error *err);

/** The same of a 3DGS result folder that says no downscale (data/result_folder.h): to `width`, else, where it
    is 0, to 1,600 pixels if they are wider; but by no less than `reduced`. */
gbt_status photos_result_downscale(const scene *s, int width, int reduced, double *downscale, gbt_error *err);

/** `downscale` 0 is 1. */
gbt_status photos_open(photos *p, const scene *source, double downscale, gbt_error *err);
void photos_close(photos *p);

/** Bytes that the largest photo of a scene takes while it is decoded and made smaller, at most. */
double photos_decoded_bytes(const scene *s);

/** How many photos of a scene are decoded at once: as many as threads, if they take no more than `most` bytes
    (0: a quarter of the memory that is free); at least 1. */
size_t photos_at_once(const scene *s, size_t most);

/** Read the photos of `views` now, photos_at_once(), as many as may be kept; else each is read when first
    asked for. The first failure in their order is reported. */
gbt_status photos_load(photos *p, const size_t *views, size_t count, gbt_error *err);

/** Read a photo into p->full, if it is not there: it stays, or stays until the next that finds no room. */
gbt_status photos_read_full(photos *p, size_t view, gbt_error *err);

/** Read the photos of `views` and keep none, likewise: what fails now would fail when they are read later. */
gbt_status photos_try(photos *p, const size_t *views, size_t count, gbt_error *err);

/** Camera of a photo that is divided: its size is round(stated / divide), at least 1. */
gbt_camera photo_camera_divided(const gbt_camera *stated, double divide);

/** Camera of a view at a level: divided by downscale 2^level. */
gbt_camera photos_camera(const photos *p, size_t view, int level);

/**
 * A photo as float at a level: above 0 area means, made anew by each call.
 *
 * @param out   [out] resized as needed (start from {0})
 * @param valid [out] optional: which of its pixels mean something, 0: a value below was not finite; NULL: all
 *                    do. Borrowed until the next call.
 */
gbt_status photos_get(photos *p, size_t view, int level, image *out, const unsigned char **valid,
                      gbt_error *err);

/**
 * Pixels picked from a photo, not averaged, and the camera whose pixels they are: its rays are those of the
 * photo at full size through the middle of these pixels.
 *
 * @param sample [in]  of a photo that has pick.step pixels each way, or more
 * @param camera [out] its size is the photo's / pick.step, rounded down, wherever the first pixel is
 * @param valid  [out] as photos_get() has them; borrowed until the next call
 */
gbt_status photos_get_sample(photos *p, size_t view, const photo_sample *sample, image *out,
                             gbt_camera *camera, const unsigned char **valid, gbt_error *err);

/** Whether some pixel of these photos means something: reads them at full size until one is found. */
gbt_status photos_any_valid(photos *p, const size_t *views, size_t count, bool *any, gbt_error *err);

#endif
