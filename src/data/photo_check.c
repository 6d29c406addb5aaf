/* SPDX-License-Identifier: Apache-2.0 */
/* data/photo_check.c -- compares the headers of all photos and masks with their cameras. */
#include "data/photo_check.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

#include "base/fail.h"
#include "base/image_header.h"
#include "base/log.h"
#include "data/photo_size.h"

/* A photo below 1/16 of its camera's width is probably a thumbnail, not a copy reduced for training. */
enum { TINY_RATIO = 16 };

static void add_problem(photo_check *c, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add_problem(photo_check *c, const char *format, ...)
{
    if (c->problem_count < PHOTO_CHECK_SHOWN) {
        va_list words;
        va_start(words, format);
        vsnprintf(c->problem[c->problem_count], PHOTO_CHECK_TEXT, format, words);
        va_end(words);
    }
    c->problem_count++;
}

/* Record a photo or mask that training would reject, with the reason. */
static void refuse(photo_check *c, size_t *kind, const gbt_error *why)
{
    (*kind)++;
    add_problem(c, "%.350s", why->text);
    base_fail(&c->refused, why->status, "%s", why->text);
}

static bool read_header(photo_check *c, const char *path, image_header *out)
{
    gbt_error why = {0};
    if (image_header_read(path, out, &why) == GBT_OK && image_header_colors(path, out, &why) == GBT_OK)
        return true;
    refuse(c, &c->unreadable, &why);
    return false;
}

static void compare_with_camera(photo_check *c, const scene_view *view, const image_header *h)
{
    const gbt_camera *camera = &view->camera;
    if (!photo_same_aspect(h->width, h->height, camera->width, camera->height)) {
        gbt_error why = {0};
        base_fail(&why, GBT_ERR_FORMAT, "%.250s: %d x %d is not the shape of its camera, %d x %d%s",
                  view->path, h->width, h->height, camera->width, camera->height,
                  h->orientation > 4 ? " (it has an EXIF rotation, which is not applied)" : "");
        refuse(c, &c->other_shape, &why);
        return;
    }
    c->other_size += h->width != camera->width || h->height != camera->height;
    if (h->orientation != 1) {
        c->turned++;
        add_problem(c, "%.250s: has an EXIF rotation (%d), which is not applied", view->path, h->orientation);
    }
    if ((int64_t)TINY_RATIO * h->width < camera->width || (int64_t)TINY_RATIO * h->height < camera->height) {
        c->tiny++;
        add_problem(c, "%.250s: is only %d x %d pixels, for a camera of %d x %d", view->path, h->width,
                    h->height, camera->width, camera->height);
    }
}

static void compare_with_photo(photo_check *c, const char *mask_path, const image_header *mask,
                               const image_header *photo)
{
    gbt_error why = {0};
    if (photo_same_aspect(mask->width, mask->height, photo->width, photo->height))
        return;
    base_fail(&why, GBT_ERR_FORMAT, "%.250s: %d x %d is not the shape of its photo, %d x %d", mask_path,
              mask->width, mask->height, photo->width, photo->height);
    refuse(c, &c->other_shape, &why);
}

static void check_view(photo_check *c, scene_view *view)
{
    image_header h, mask;
    const bool has_photo = read_header(c, view->path, &h);
    if (has_photo) {
        const bool is_first = c->found++ == 0;
        c->with_alpha += h.has_alpha;
        view->photo_width = h.width;
        view->has_alpha = h.has_alpha;
        view->is_exr = h.kind == IMAGE_EXR;
        c->exr += view->is_exr;
        c->min_width = is_first || h.width < c->min_width ? h.width : c->min_width;
        c->min_height = is_first || h.height < c->min_height ? h.height : c->min_height;
        c->max_width = h.width > c->max_width ? h.width : c->max_width;
        c->max_height = h.height > c->max_height ? h.height : c->max_height;
        compare_with_camera(c, view, &h);
    }
    if (view->mask_path == NULL)
        return;
    c->with_mask++;
    if (read_header(c, view->mask_path, &mask) && has_photo)
        compare_with_photo(c, view->mask_path, &mask, &h);
}

void photo_check_all(scene *s, photo_check *out)
{
    *out = (photo_check){0};
    for (size_t i = 0; i < s->view_count; i++)
        if (s->views[i].path != NULL)
            check_view(out, &s->views[i]);
}

void photo_check_warn(const photo_check *check, const char *data)
{
    if (check->turned > 0)
        log_warn("%s: photos with an EXIF rotation, which is not applied, so that they are used as they are "
                 "stored: %zu",
                 data, check->turned);
    if (check->tiny > 0)
        log_warn("%s: photos with less than 1/%d of their camera's width or height: %zu", data,
                 (int)TINY_RATIO, check->tiny);
    if (check->exr > 0)
        log_warn("%s: EXR photos, used without tone mapping, values above 1 clipped: %zu", data, check->exr);
}
