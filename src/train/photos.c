/* train/photos.c -- training photos, cached at the resolution in use. */
#include "train/photos.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "data/photo.h"

gbt_status photos_open(photos *p, const scene *source, double downscale, gbt_error *err)
{
    *p = (photos){.source = source, .downscale = downscale};
    p->full = mem_calloc(source->view_count, sizeof *p->full, "photo cache", err);
    p->pixels = mem_calloc(source->view_count, sizeof *p->pixels, "photo cache", err);
    p->full_valid = mem_calloc(source->view_count, sizeof *p->full_valid, "photo cache", err);
    p->valid = mem_calloc(source->view_count, sizeof *p->valid, "photo cache", err);
    return p->full == NULL || p->pixels == NULL || p->full_valid == NULL || p->valid == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
}

static void drop_all(unsigned char **pixels, size_t count)
{
    for (size_t i = 0; pixels != NULL && i < count; i++) {
        mem_free(pixels[i]);
        pixels[i] = NULL;
    }
}

void photos_close(photos *p)
{
    unsigned char **const caches[] = {p->full, p->pixels, p->full_valid, p->valid};
    for (int i = 0; i < 4; i++) {
        drop_all(caches[i], p->source->view_count);
        mem_free(caches[i]);
    }
    memset(p, 0, sizeof *p);
}

gbt_camera photos_camera(const photos *p, size_t view, int level)
{
    const gbt_camera *stated = &p->source->views[view].camera;
    const double divide = p->downscale * exp2(level);
    const int width = (int)fmax(1, floor(stated->width / divide + 0.5)), height = (int)fmax(1, floor(stated->height / divide + 0.5));
    return gbt_camera_resized(stated, width, height);
}

static gbt_status to_bytes(const image *im, unsigned char **out, gbt_error *err)
{
    const size_t count = (size_t)im->width * (size_t)im->height * 3;
    unsigned char *bytes = mem_alloc(count, 1, "photo", err);
    if (bytes == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        bytes[i] = (unsigned char)(fminf(fmaxf(im->pixels[i], 0.0f), 1.0f) * 255 + 0.5f);
    *out = bytes;
    return GBT_OK;
}

static void from_bytes(const unsigned char *bytes, image *out)
{
    for (size_t i = 0; i < (size_t)out->width * (size_t)out->height * 3; i++)
        out->pixels[i] = (float)bytes[i] * (1.0f / 255);
}

static gbt_status get_full(photos *p, size_t view, image *out, gbt_error *err)
{
    const gbt_camera camera = photos_camera(p, view, 0);
    if (p->full[view] == NULL) {
        image photo;
        GBT_TRY(scene_read_photo_valid(&p->source->views[view], camera.width, camera.height, &photo, &p->full_valid[view], err));
        const gbt_status status = to_bytes(&photo, &p->full[view], err);
        image_free(&photo);
        if (status != GBT_OK) {
            mem_free(p->full_valid[view]);
            p->full_valid[view] = NULL;
            return status;
        }
    }
    GBT_TRY(image_fit(out, camera.width, camera.height, 3, err));
    from_bytes(p->full[view], out);
    return GBT_OK;
}

/* The marks of a photo at p->level, if it has any. Made before its pixels, which say that both are there. */
static gbt_status resize_valid(photos *p, size_t view, const gbt_camera *camera, gbt_error *err)
{
    if (p->full_valid[view] == NULL || p->valid[view] != NULL)
        return GBT_OK;
    const gbt_camera full = photos_camera(p, view, 0);
    return photo_resize_valid(p->full_valid[view], full.width, full.height, camera->width, camera->height, &p->valid[view], err);
}

const unsigned char *photos_valid(const photos *p, size_t view)
{
    return p->level == 0 ? p->full_valid[view] : p->valid[view];
}

gbt_status photos_get(photos *p, size_t view, int level, image *out, gbt_error *err)
{
    if (level != p->level) {
        drop_all(p->pixels, p->source->view_count);
        drop_all(p->valid, p->source->view_count);
        p->level = level;
    }
    if (level == 0)
        return get_full(p, view, out, err);
    const gbt_camera camera = photos_camera(p, view, level);
    if (p->pixels[view] == NULL) {
        image full = {0}, small = {0};
        gbt_status status = get_full(p, view, &full, err);
        if (status == GBT_OK)
            status = photo_resize(&full, camera.width, camera.height, &small, err);
        if (status == GBT_OK)
            status = resize_valid(p, view, &camera, err);
        if (status == GBT_OK)
            status = to_bytes(&small, &p->pixels[view], err);
        image_free(&full);
        image_free(&small);
        GBT_TRY(status);
    }
    GBT_TRY(image_fit(out, camera.width, camera.height, 3, err));
    from_bytes(p->pixels[view], out);
    return GBT_OK;
}
