/* SPDX-License-Identifier: Apache-2.0 */
/* train/photos.h -- the training photos, kept in memory as 8 bit as far as it allows. They are served at full
   size, reduced (levels of a pyramid), or as every n-th pixel for a training step. */
#ifndef GBT_TRAIN_PHOTOS_H
#define GBT_TRAIN_PHOTOS_H

#include "data/scene.h"
#include "train/photo_pick.h"

/** Upper limit of the bytes of photos kept in memory; the other limit is half of the free memory. */
#define PHOTOS_KEPT_BYTES ((size_t)1 << 32)

typedef struct photos {
    const scene *source; /* borrowed */
    double downscale;
    size_t bytes_max;       /* limit for photos kept in memory; the others are read whenever they are
                               needed */
    size_t bytes;           /* used by the photos that are kept */
    size_t kept_until_next; /* view whose photo is kept only until another one needs the room; SIZE_MAX:
                               none */
    size_t decoded_max;     /* bytes for photos that are decoded at the same time; 0: a quarter of the free
                               memory */
    unsigned char **full;   /* [view_count] NULL until asked for */
    unsigned char **full_valid; /* [view_count] mask of the same pixels: 0 where masked, or where a value was
                                   not finite; NULL for a photo without such pixels */
    unsigned char **transparency; /* [view_count] transparency of the same pixels, 255 is fully transparent;
                                     NULL for a photo that is opaque, or whose alpha channel is a mask */
    unsigned char *some_valid;    /* mask of the last photo that was served reduced or as every n-th pixel */
    size_t some_valid_capacity;
} photos;

/** Which pixels of a photo a training step uses. */
typedef struct photo_sample {
    photo_pick pick;
    const float *backdrop; /* [3]: colour behind transparent pixels; NULL: the one of scene_view.alpha */
} photo_sample;

/** Divisor of the cameras' sizes such that the median photo is at most `width` wide: first down to the size
    of the photos if these are smaller than the cameras say, then further if the median photo is still wider.
    GBT_OK or GBT_ERR_NO_MEMORY. Cost: opens every photo. */
gbt_status photos_downscale_to(const scene *s, double width, double *downscale, gbt_error *err);

/** The same with the default width: 1,600 pixels if `limits_width`, otherwise no limit. */
gbt_status photos_usual_downscale(const scene *s, bool limits_width, double *downscale, gbt_error *err);

/** The same for a 3DGS result folder that states no downscale (data/result_folder.h): to `width`, or if that
    is 0 to 1,600 pixels if the photos are wider; at least `reduced`. */
gbt_status photos_result_downscale(const scene *s, int width, int reduced, double *downscale, gbt_error *err);

/** Start from a scene without reading any photo. `downscale` 0 means 1. */
gbt_status photos_open(photos *p, const scene *source, double downscale, gbt_error *err);
void photos_close(photos *p);

/** Upper bound of the bytes that the largest photo of a scene takes while it is decoded and reduced. */
double photos_decoded_bytes(const scene *s);

/** Number of photos that are decoded at the same time: one per thread, but no more than fit in `most` bytes
    (0: a quarter of the free memory); at least 1. */
size_t photos_at_once(const scene *s, size_t most);

/** Read as many photos of `views` as may be kept, photos_at_once() at a time; the others are read when first
    needed. Reports the first failure in the order of `views`. */
gbt_status photos_load(photos *p, const size_t *views, size_t count, gbt_error *err);

/** Read a photo into p->full if it is not there. It is kept, or without room kept until another photo needs
    its place. */
gbt_status photos_read_full(photos *p, size_t view, gbt_error *err);

/** Read the photos of `views` in the same way but keep none: to find now the failures that would occur
    later. */
gbt_status photos_try(photos *p, const size_t *views, size_t count, gbt_error *err);

/** Camera of a photo reduced by `divide`: its size is round(stated / divide), at least 1. */
gbt_camera photo_camera_divided(const gbt_camera *stated, double divide);

/** Camera of a view at a level: divided by downscale 2^level. */
gbt_camera photos_camera(const photos *p, size_t view, int level);

/**
 * A photo as float at a level of the pyramid. Levels above 0 are area means, computed in each call.
 *
 * @param out   [out] resized as needed (start from {0})
 * @param valid [out] optional: mask, 0 where a pixel covers one that is masked or not finite; NULL: all
 * pixels are valid. Borrowed until the next call.
 */
gbt_status photos_get(photos *p, size_t view, int level, image *out, const unsigned char **valid,
                      gbt_error *err);

/**
 * Selected pixels of a photo, not averaged, and the camera whose pixels they are: its rays are those of the
 * full-size photo through the centres of these pixels.
 *
 * @param sample [in]  of a photo that has pick.step pixels each way, or more
 * @param camera [out] its size is the photo's / pick.step, rounded down, wherever the first pixel is
 * @param valid  [out] as in photos_get(); borrowed until the next call
 */
gbt_status photos_get_sample(photos *p, size_t view, const photo_sample *sample, image *out,
                             gbt_camera *camera, const unsigned char **valid, gbt_error *err);

/** Whether any pixel of these photos is valid: reads them at full size until one is found. */
gbt_status photos_any_valid(photos *p, const size_t *views, size_t count, bool *any, gbt_error *err);

#endif
