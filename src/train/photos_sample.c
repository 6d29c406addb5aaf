/* SPDX-License-Identifier: Apache-2.0 */
/* train/photos_sample.c -- the pixels of a photo that a training step uses, and their camera. */
#include "base/fail.h"
#include "base/memory.h"
#include "train/photos.h"

gbt_status photos_get_sample(photos *p, size_t view, const photo_sample *sample, image *out,
                             gbt_camera *camera, const unsigned char **valid, gbt_error *err)
{
    const gbt_camera full = photos_camera(p, view, 0);
    const photo_pick *pick = &sample->pick;
    *camera = full;
    if (pick->step > 1 && !gbt_camera_every(&full, pick->step, pick->first[0], pick->first[1], camera))
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %d x %d pixels (wanted at least %d each way)",
                         p->source->views[view].name, full.width, full.height, pick->step);
    GBT_TRY(photos_read_full(p, view, err));
    GBT_TRY(image_fit(out, camera->width, camera->height, 3, err));
    const float behind = p->source->views[view].alpha == GBT_ALPHA_WHITE;
    float change[3] = {0, 0, 0};
    for (int c = 0; c < 3 && sample->backdrop != NULL; c++)
        change[c] = sample->backdrop[c] - behind;
    photo_pick_pixels(p->full[view], full.width, pick,
                      sample->backdrop != NULL ? p->transparency[view] : NULL, change, out);
    *valid = NULL;
    if (p->full_valid[view] == NULL)
        return GBT_OK;
    GBT_TRY(mem_reserve((void **)&p->some_valid, &p->some_valid_capacity, 0,
                        (size_t)out->width * (size_t)out->height, 1, "valid pixels", err));
    photo_pick_marks(p->full_valid[view], full.width, pick, out->width, out->height, p->some_valid);
    *valid = p->some_valid;
    return GBT_OK;
}
