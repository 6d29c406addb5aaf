/* train/photos.h -- the training photos at the resolution in use: read once, when first asked for, kept as 8 bit. */
#ifndef GBT_TRAIN_PHOTOS_H
#define GBT_TRAIN_PHOTOS_H

#include "data/scene.h"

typedef struct photos {
    const scene *source; /* borrowed */
    double downscale;
    int level;
    unsigned char **full;   /* [view_count] at level 0, NULL until asked for */
    unsigned char **pixels; /* [view_count] at `level` > 0, made from `full` */
    unsigned char **full_valid, **valid; /* [view_count] marks of the same pixels; NULL for a photo whose values are all finite */
} photos;

gbt_status photos_open(photos *p, const scene *source, double downscale, gbt_error *err);
void photos_close(photos *p);

/** Camera of a view at a level: its size is round(stated / downscale / 2^level), at least 1. */
gbt_camera photos_camera(const photos *p, size_t view, int level);

/** A photo as float at a level; asking for another level drops what is kept. `out` is resized as needed (start from {0}). */
gbt_status photos_get(photos *p, size_t view, int level, image *out, gbt_error *err);

/** Which pixels of the photo that photos_get() gave last for this view mean something: 0 where a value was not finite; NULL: all. */
const unsigned char *photos_valid(const photos *p, size_t view);

#endif
