/* SPDX-License-Identifier: Apache-2.0 */
/* data/scene_photos.c -- finds photos and masks by name, and determines how transparent parts are handled. */
#include "data/scene_photos.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/image.h"
#include "base/image_header.h"
#include "data/scene.h"

enum { PATH_SIZE = RAW_NAME_LIMIT + 4096 };

/* Set `out` to a copy of the path folder/name if that is a file; otherwise `out` is unchanged. */
static gbt_status take_file(const char *folder, const char *name, char **out, gbt_error *err)
{
    char path[PATH_SIZE];
    file_kind kind;
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    GBT_TRY(file_look(path, &kind, err));
    if (kind != FILE_OTHER)
        return GBT_OK;
    *out = raw_copy_text(path, strlen(path), err);
    return *out != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static gbt_status find_mask(const char *masks, raw_view *view, gbt_error *err)
{
    char name[RAW_NAME_LIMIT + 8];
    snprintf(name, sizeof name, "%s.png", view->name);
    GBT_TRY(take_file(masks, name, &view->mask_path, err));
    if (view->mask_path == NULL)
        GBT_TRY(take_file(masks, view->name, &view->mask_path, err));
    const char *dot = strrchr(view->name, '.');
    if (view->mask_path != NULL || dot == NULL || strchr(dot, '/') != NULL)
        return GBT_OK;
    snprintf(name, sizeof name, "%.*s.png", (int)(dot - view->name), view->name);
    return take_file(masks, name, &view->mask_path, err);
}

static gbt_status find_files(const char *folder, const char *images, const char *masks, raw_view *view,
                             gbt_error *err)
{
    GBT_TRY(take_file(images, view->name, &view->path, err));
    if (view->path == NULL)
        GBT_TRY(take_file(folder, view->name, &view->path, err));
    return masks == NULL || view->path == NULL ? GBT_OK : find_mask(masks, view, err);
}

gbt_status scene_find_photos(const char *folder, raw_scene *raw, gbt_error *err)
{
    char images[PATH_SIZE], masks[PATH_SIZE];
    file_kind kind;
    GBT_TRY(file_join(images, sizeof images, folder, "images", err));
    GBT_TRY(file_join(masks, sizeof masks, folder, "masks", err));
    GBT_TRY(file_look(masks, &kind, err));
    raw->has_masks = kind == FILE_FOLDER;
    size_t kept = 0;
    gbt_status status = GBT_OK;
    for (size_t i = 0; i < raw->view_count && status == GBT_OK; i++) {
        raw_view view = raw->views[i];
        status = find_files(folder, images, raw->has_masks ? masks : NULL, &view, err);
        if (status == GBT_OK && view.path == NULL)
            status = raw_count_missing(raw, view.name, err);
        raw->views[i] = raw->views[kept]; /* views without a photo move to the end, where raw_free() still
                                             finds them after a failure */
        raw->views[kept] = view;
        kept += view.path != NULL;
    }
    GBT_TRY(status);
    if (kept == 0)
        return base_fail(err, GBT_ERR_IO, "%s: all %zu photos are missing: %s", images, raw->view_count,
                         raw->missing_names);
    for (size_t i = kept; i < raw->view_count; i++)
        raw_view_free(&raw->views[i]);
    raw->view_count = kept;
    return GBT_OK;
}

/* ---- transparency ---- */

/* Data sets with cut-out photos normally have only such photos, so a few are enough to tell; reading hundreds
   of opaque ones would take long. */
enum { PHOTOS_READ_MAX = 4 };

void scene_set_alpha(scene *s, gbt_alpha alpha)
{
    if (alpha == GBT_ALPHA_AUTO)
        alpha = strcmp(s->source, "blender") == 0 ? GBT_ALPHA_WHITE : GBT_ALPHA_BLACK;
    for (size_t i = 0; i < s->view_count; i++)
        s->views[i].alpha = alpha;
}

static bool has_transparency(const char *path)
{
    image photo;
    if (image_read(path, &photo, NULL) != GBT_OK)
        return false;
    const bool found = image_is_transparent(&photo);
    image_free(&photo);
    return found;
}

bool scene_background(const scene *s, float color[3])
{
    size_t photos_read = 0;
    for (size_t i = 0, next = 0; i < s->view_count && photos_read < PHOTOS_READ_MAX; i++) {
        const scene_view *view = &s->views[i];
        image_header header;
        if (i < next || view->is_test || view->alpha == GBT_ALPHA_MASK ||
            image_header_read(view->path, &header, NULL) != GBT_OK || !header.has_alpha)
            continue;
        if (has_transparency(view->path)) {
            for (int c = 0; c < 3; c++)
                color[c] = view->alpha == GBT_ALPHA_WHITE;
            return true;
        }
        photos_read++;
        next = i + s->view_count / PHOTOS_READ_MAX;
    }
    return false;
}
