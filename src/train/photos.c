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
    return p->full == NULL || p->pixels == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
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
    drop_all(p->full, p->source->view_count);
    drop_all(p->pixels, p->source->view_count);
    mem_free(p->full);
    mem_free(p->pixels);
    memset(p, 0, sizeof *p);
}

gbt_camera photos_camera(const photos *p, size_t view, int level)
{
    const gbt_camera *stated = &p->source->views[view].camera;
    const double divide = p->downscale * exp2(level);
    const int width = (int)fmax(1, floor(stated->width / divide + 0.5)), height = (int)fmax(1, floor(stated->height / divide + 0.5));
    return gbt_camera_resized(stated, width, height);
}

static gbt_status fit_image(image *out, int width, int height, gbt_error *err)
{
    if (out->width == width && out->height == height && out->channels == 3)
        return GBT_OK;
    image_free(out);
    return image_alloc(out, width, height, 3, err);
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
        GBT_TRY(scene_read_photo(&p->source->views[view], camera.width, camera.height, &photo, err));
        const gbt_status status = to_bytes(&photo, &p->full[view], err);
        image_free(&photo);
        GBT_TRY(status);
    }
    GBT_TRY(fit_image(out, camera.width, camera.height, err));
    from_bytes(p->full[view], out);
    return GBT_OK;
}

gbt_status photos_get(photos *p, size_t view, int level, image *out, gbt_error *err)
{
    if (level != p->level) {
        drop_all(p->pixels, p->source->view_count);
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
            status = to_bytes(&small, &p->pixels[view], err);
        image_free(&full);
        image_free(&small);
        GBT_TRY(status);
    }
    GBT_TRY(fit_image(out, camera.width, camera.height, err));
    from_bytes(p->pixels[view], out);
    return GBT_OK;
}
