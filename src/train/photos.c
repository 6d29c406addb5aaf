/* SPDX-License-Identifier: Apache-2.0 */
/* train/photos.c -- training photos, stored as bytes. */
#include "train/photos.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/image_header.h"
#include "base/machine.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/parallel.h"
#include "data/photo_size.h"
#include "train/photo_pick.h"

enum { USUAL_WIDTH = 1600 /* as in 3DGS */ };
/* Peak bytes per pixel while a photo is decoded: floats and file samples, or floats at two sizes; more with
   alpha or a mask. The second number is for EXR files, whose samples are floats. */
static const double decoded_pixel_bytes[2] = {24, 40}, decoded_alpha_bytes[2] = {40, 56};

static double median(float *values, size_t count)
{
    qsort(values, count, sizeof *values, compare_floats);
    return (double)values[count / 2];
}

gbt_status photos_downscale_to(const scene *s, double width, double *downscale, gbt_error *err)
{
    *downscale = 1;
    if (s->view_count == 0)
        return GBT_OK;
    float *widths = mem_alloc(2 * s->view_count, sizeof *widths, "photo widths", err);
    if (widths == NULL)
        return GBT_ERR_NO_MEMORY;
    float *ratios = widths + s->view_count; /* camera width / photo width */
    for (size_t i = 0; i < s->view_count; i++) {
        const scene_view *view = &s->views[i];
        image_header h = {.width = view->photo_width};
        if (h.width == 0 && view->path != NULL && image_header_read(view->path, &h, NULL) != GBT_OK)
            h.width = 0;
        widths[i] = (float)(h.width > 0 && h.width < view->camera.width ? h.width : view->camera.width);
        ratios[i] = (float)view->camera.width / widths[i];
    }
    const double is = median(widths, s->view_count), ratio = median(ratios, s->view_count);
    mem_free(widths);
    *downscale = ratio * fmax(1, is / width);
    return GBT_OK;
}

gbt_status photos_usual_downscale(const scene *s, bool limits_width, double *downscale, gbt_error *err)
{
    return photos_downscale_to(s, limits_width ? USUAL_WIDTH : HUGE_VAL, downscale, err);
}

gbt_status photos_result_downscale(const scene *s, int width, int reduced, double *downscale, gbt_error *err)
{
    GBT_TRY(photos_downscale_to(s, width > 0 ? width : USUAL_WIDTH, downscale, err));
    *downscale = fmax(*downscale, reduced);
    return GBT_OK;
}

/* A fraction 1 / `part` of the free memory. It affects speed only, never results. */
static size_t free_share(size_t part)
{
    const machine m = machine_read("");
    const size_t least = m.memory_free_bytes > 0 && m.memory_free_bytes < m.memory_limit_bytes
                             ? m.memory_free_bytes
                             : m.memory_limit_bytes;
    return least / part;
}

static size_t kept_bytes(void)
{
    const size_t half = free_share(2);
    return half < PHOTOS_KEPT_BYTES ? half : PHOTOS_KEPT_BYTES;
}

double photos_decoded_bytes(const scene *s)
{
    double largest = 0;
    for (size_t i = 0; i < s->view_count; i++) {
        const scene_view *v = &s->views[i];
        const double ratio = v->photo_width > 0 ? (double)v->photo_width / v->camera.width : 1;
        const double *bytes =
            v->has_alpha || v->mask_path != NULL ? decoded_alpha_bytes : decoded_pixel_bytes;
        largest = fmax(largest,
                       bytes[v->is_exr] * ratio * ratio * (double)v->camera.width * (double)v->camera.height);
    }
    return largest;
}

size_t photos_at_once(const scene *s, size_t most)
{
    const double fitting = (double)(most > 0 ? most : free_share(4)) / fmax(photos_decoded_bytes(s), 1);
    return (size_t)fmin(fmax(fitting, 1), parallel_threads());
}

gbt_status photos_open(photos *p, const scene *source, double downscale, gbt_error *err)
{
    *p = (photos){.source = source,
                  .downscale = downscale > 0 ? downscale : 1,
                  .bytes_max = kept_bytes(),
                  .kept_until_next = SIZE_MAX};
    p->full = mem_calloc(source->view_count, sizeof *p->full, "photo cache", err);
    p->full_valid = mem_calloc(source->view_count, sizeof *p->full_valid, "photo cache", err);
    p->transparency = mem_calloc(source->view_count, sizeof *p->transparency, "photo cache", err);
    return p->full == NULL || p->full_valid == NULL || p->transparency == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
}

void photos_close(photos *p)
{
    unsigned char **const caches[] = {p->full, p->full_valid, p->transparency};
    for (int k = 0; k < 3; k++) {
        for (size_t i = 0; caches[k] != NULL && i < p->source->view_count; i++)
            mem_free(caches[k][i]);
        mem_free(caches[k]);
    }
    mem_free(p->some_valid);
    memset(p, 0, sizeof *p);
}

gbt_camera photo_camera_divided(const gbt_camera *stated, double divide)
{
    const int width = (int)fmax(1, floor(stated->width / divide + 0.5)),
              height = (int)fmax(1, floor(stated->height / divide + 0.5));
    return gbt_camera_resized(stated, width, height);
}

gbt_camera photos_camera(const photos *p, size_t view, int level)
{
    return photo_camera_divided(&p->source->views[view].camera, ldexp(p->downscale, level));
}

static gbt_status to_bytes(const image *im, unsigned char **out, gbt_error *err)
{
    const size_t count = (size_t)im->width * (size_t)im->height * (size_t)im->channels;
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
    photo_pick_pixels(bytes, out->width, &(photo_pick){.step = 1}, NULL, NULL, out);
}

static size_t pixel_count(const photos *p, size_t view)
{
    const gbt_camera camera = photos_camera(p, view, 0);
    return (size_t)camera.width * (size_t)camera.height;
}

/* Bytes of a photo with its mask and transparency; an upper bound before it was read. */
static size_t full_bytes(const photos *p, size_t view)
{
    const scene_view *v = &p->source->views[view];
    const int more = p->full[view] == NULL ? (v->mask_path != NULL) + v->has_alpha
                                           : (p->full_valid[view] != NULL) + (p->transparency[view] != NULL);
    return (size_t)(3 + more) * pixel_count(p, view);
}

static void drop_full(photos *p, size_t view)
{
    unsigned char **const caches[] = {p->full, p->full_valid, p->transparency};
    for (int i = 0; i < 3; i++) {
        mem_free(caches[i][view]);
        caches[i][view] = NULL;
    }
}

static void drop_kept_until_next(photos *p)
{
    if (p->kept_until_next == SIZE_MAX)
        return;
    drop_full(p, p->kept_until_next);
    p->kept_until_next = SIZE_MAX;
}

/* Read a photo into p->full, with its mask and transparency. */
static gbt_status read_into(photos *p, size_t view, gbt_error *err)
{
    const gbt_camera camera = photos_camera(p, view, 0);
    image photo, transparency;
    GBT_TRY(scene_read_photo_transparency(&p->source->views[view], camera.width, camera.height, &photo,
                                          &p->full_valid[view], &transparency, err));
    gbt_status status = to_bytes(&photo, &p->full[view], err);
    if (status == GBT_OK && transparency.pixels != NULL)
        status = to_bytes(&transparency, &p->transparency[view], err);
    image_free(&photo);
    image_free(&transparency);
    if (status != GBT_OK)
        drop_full(p, view);
    return status;
}

/* Views are used equally often and in random order, so no photo is more useful to keep than another: those
   read first stay. */
gbt_status photos_read_full(photos *p, size_t view, gbt_error *err)
{
    if (p->full[view] != NULL)
        return GBT_OK;
    const bool stays = p->bytes + full_bytes(p, view) <= p->bytes_max;
    if (!stays)
        drop_kept_until_next(p);
    GBT_TRY(read_into(p, view, err));
    if (stays)
        p->bytes += full_bytes(p, view);
    else
        p->kept_until_next = view;
    return GBT_OK;
}

typedef gbt_status read_one(photos *p, size_t view, gbt_error *err);

typedef struct load_job {
    photos *photos;
    const size_t *views;
    size_t count, at_once;
    read_one *one;
    gbt_status *status; /* one per photo */
    gbt_error *error;
} load_job;

static gbt_status load_one(photos *p, size_t view, gbt_error *err)
{
    return p->full[view] != NULL ? GBT_OK : read_into(p, view, err);
}

static gbt_status try_one(photos *p, size_t view, gbt_error *err)
{
    const gbt_camera camera = photos_camera(p, view, 0);
    image photo;
    unsigned char *valid;
    const gbt_status status =
        scene_read_photo_valid(&p->source->views[view], camera.width, camera.height, &photo, &valid, err);
    image_free(&photo);
    mem_free(valid);
    return status;
}

/* There are as many blocks as photos that may be decoded at the same time. */
static void read_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)begin;
    (void)end;
    const load_job *job = context;
    for (size_t i = block; i < job->count; i += job->at_once) {
        paged_check();
        job->status[i] = job->one(job->photos, job->views[i], &job->error[i]);
    }
}

/* Run `one` for all views; reports the first failure in the order of the views. */
static gbt_status run_all(photos *p, const size_t *views, size_t count, read_one *one, gbt_error *err)
{
    load_job job = {.photos = p,
                    .views = views,
                    .count = count,
                    .at_once = photos_at_once(p->source, p->decoded_max),
                    .one = one,
                    .status = mem_calloc(count, sizeof *job.status, "photos", err),
                    .error = mem_calloc(count, sizeof *job.error, "photos", err)};
    gbt_status status = job.status == NULL || job.error == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        parallel_blocks(job.at_once, 1, read_block, &job);
    for (size_t i = 0; status == GBT_OK && i < count; i++)
        if (job.status[i] != GBT_OK)
            status = base_fail(err, job.status[i], "%s", job.error[i].text);
    mem_free(job.status);
    mem_free(job.error);
    return status;
}

/* How many of `views`, from the first on, fit in memory in addition to the photos already kept. */
static size_t count_fitting(const photos *p, const size_t *views, size_t count)
{
    size_t fitting = 0;
    for (size_t bytes = p->bytes; fitting < count && bytes + full_bytes(p, views[fitting]) <= p->bytes_max;
         fitting++)
        bytes += full_bytes(p, views[fitting]);
    return fitting;
}

gbt_status photos_load(photos *p, const size_t *views, size_t count, gbt_error *err)
{
    count = count_fitting(p, views, count);
    GBT_TRY(run_all(p, views, count, load_one, err));
    for (size_t i = 0; i < count; i++)
        p->bytes += full_bytes(p, views[i]);
    return GBT_OK;
}

gbt_status photos_try(photos *p, const size_t *views, size_t count, gbt_error *err)
{
    return run_all(p, views, count, try_one, err);
}

static gbt_status get_full(photos *p, size_t view, image *out, gbt_error *err)
{
    const gbt_camera camera = photos_camera(p, view, 0);
    GBT_TRY(photos_read_full(p, view, err));
    GBT_TRY(image_fit(out, camera.width, camera.height, 3, err));
    from_bytes(p->full[view], out);
    return GBT_OK;
}

gbt_status photos_any_valid(photos *p, const size_t *views, size_t count, bool *any, gbt_error *err)
{
    *any = false;
    for (size_t i = 0; i < count && !*any; i++) {
        GBT_TRY(photos_read_full(p, views[i], err));
        const unsigned char *valid = p->full_valid[views[i]];
        *any = valid == NULL || memchr(valid, 1, pixel_count(p, views[i])) != NULL;
    }
    return GBT_OK;
}

/* A photo at a level above 0, with its mask in p->some_valid. */
static gbt_status get_smaller(photos *p, size_t view, int level, image *out, gbt_error *err)
{
    const gbt_camera camera = photos_camera(p, view, level);
    image full = {0};
    unsigned char *marks = NULL;
    gbt_status status = get_full(p, view, &full, err);
    image_free(out);
    if (status == GBT_OK)
        status = photo_resize(&full, camera.width, camera.height, out, err);
    if (status == GBT_OK && p->full_valid[view] != NULL)
        status = photo_resize_valid(p->full_valid[view], full.width, full.height, camera.width, camera.height,
                                    &marks, err);
    image_free(&full);
    if (marks != NULL) {
        mem_free(p->some_valid);
        p->some_valid = marks;
        p->some_valid_capacity = (size_t)camera.width * (size_t)camera.height;
    }
    return status;
}

gbt_status photos_get(photos *p, size_t view, int level, image *out, const unsigned char **valid,
                      gbt_error *err)
{
    GBT_TRY(level == 0 ? get_full(p, view, out, err) : get_smaller(p, view, level, out, err));
    if (valid != NULL)
        *valid = level > 0 && p->full_valid[view] != NULL ? p->some_valid : p->full_valid[view];
    return GBT_OK;
}
