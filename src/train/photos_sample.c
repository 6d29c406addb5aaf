/* SPDX-License-Identifier: Apache-2.0 */
/* train/photos_sample.c -- the pixels of a photo that a training step looks at, and their camera. */
#include <stdint.h>

#include "base/fail.h"
#include "base/memory.h"
#include "data/photo_size.h"
#include "train/photo_pick.h"
#include "train/photos.h"

/* The marks of picked pixels, if the photo has any. */
static gbt_status pick_valid(photos *p, size_t view, int full_width, const photo_pick *from,
                             const unsigned char **valid, gbt_error *err)
{
    *valid = NULL;
    if (p->full_valid[view] == NULL)
        return GBT_OK;
    GBT_TRY(mem_reserve((void **)&p->sample_valid, &p->sample_valid_capacity, 0,
                        (size_t)from->width * (size_t)from->height, 1, "valid pixels", err));
    photo_pick_marks(p->full_valid[view], full_width, from, p->sample_valid);
    *valid = p->sample_valid;
    return GBT_OK;
}

/* One of `parts` along a length: all are as long, the first and the last reach its ends. */
static int part_first(int length, int part_length, int part, int parts)
{
    return (int)((int64_t)(length - part_length) * part / (parts - 1));
}

/* The camera of picked pixels; false where the lens cannot be shifted. */
static bool pick_camera(const gbt_camera *full, const photo_sample *sample, photo_pick *from,
                        gbt_camera *camera)
{
    if (sample->level > 0) {
        *from = (photo_pick){.first = {sample->phase[0], sample->phase[1]}, .step = 1 << sample->level};
        if (!gbt_camera_every(full, from->step, from->first[0], from->first[1], camera))
            return false;
        from->width = camera->width;
        from->height = camera->height;
        return true;
    }
    const int parts = sample->parts, width = (full->width + parts - 1) / parts,
              height = (full->height + parts - 1) / parts;
    *from = (photo_pick){.first = {part_first(full->width, width, sample->part[0], parts),
                                   part_first(full->height, height, sample->part[1], parts)},
                         .step = 1,
                         .width = width,
                         .height = height};
    return gbt_camera_cropped(full, from->first[0], from->first[1], width, height, camera);
}

/* Pixels of p->full. */
static void pick_pixels(const photos *p, size_t view, int full_width, const photo_pick *from,
                        const float *backdrop, image *out)
{
    const float behind = p->source->views[view].alpha == GBT_ALPHA_WHITE;
    float change[3] = {0, 0, 0};
    for (int c = 0; c < 3 && backdrop != NULL; c++)
        change[c] = backdrop[c] - behind;
    photo_pick_pixels(p->full[view], full_width, from, backdrop != NULL ? p->transparency[view] : NULL,
                      change, out);
}

/* A whole photo at a level, on a colour of its own: made anew each time. */
static gbt_status get_laid_on(photos *p, size_t view, int level, const float *backdrop, image *out,
                              gbt_error *err)
{
    const gbt_camera full = photos_camera(p, view, 0), camera = photos_camera(p, view, level);
    GBT_TRY(photos_read_full(p, view, err));
    if (p->transparency[view] == NULL)
        return GBT_OK;
    image whole = {0};
    GBT_TRY(image_fit(&whole, full.width, full.height, 3, err));
    pick_pixels(p, view, full.width, &(photo_pick){.step = 1}, backdrop, &whole);
    image_free(out);
    if (level == 0) {
        *out = whole;
        return GBT_OK;
    }
    const gbt_status status = photo_resize(&whole, camera.width, camera.height, out, err);
    image_free(&whole);
    return status;
}

gbt_status photos_get_sample(photos *p, size_t view, const photo_sample *sample, image *out,
                             gbt_camera *camera, const unsigned char **valid, int *step, gbt_error *err)
{
    const gbt_camera full = photos_camera(p, view, 0);
    photo_pick from;
    if ((sample->level == 0 && sample->parts <= 1) || !pick_camera(&full, sample, &from, camera)) {
        *camera = photos_camera(p, view, sample->level);
        *step = 1;
        GBT_TRY(photos_get(p, view, sample->level, out, err));
        *valid = photos_valid(p, view);
        return sample->backdrop != NULL ? get_laid_on(p, view, sample->level, sample->backdrop, out, err)
                                        : GBT_OK;
    }
    *step = from.step;
    GBT_TRY(photos_read_full(p, view, err));
    GBT_TRY(image_fit(out, from.width, from.height, 3, err));
    pick_pixels(p, view, full.width, &from, sample->backdrop, out);
    return pick_valid(p, view, full.width, &from, valid, err);
}
