/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms.c -- reads transforms.json: its frames, their photos and masks, the split. */
#include "data/transforms.h"

#include <stdio.h>

#include "base/file.h"
#include "data/json_fields.h"
#include "data/transforms_camera.h"

enum { NAME_SIZE = RAW_NAME_LIMIT + 1, PATH_SIZE = RAW_NAME_LIMIT + 4096, ENDING_SIZE = 8 };

/* Skip leading "./". */
static const char *plain_name(const char *name)
{
    while (strncmp(name, "./", 2) == 0)
        name += 2 + strspn(name + 2, "/");
    return name;
}

/* The name with backslashes replaced by slashes, in case it was written on Windows. */
static const char *with_slashes(const char *name, char out[NAME_SIZE])
{
    snprintf(out, NAME_SIZE, "%s", name);
    for (char *c = out; *c != '\0'; c++)
        *c = *c == '\\' ? '/' : *c;
    return plain_name(out);
}

/* Find the file `name`, trying the given endings in order. */
static gbt_status find_file(const char *folder, const char *name, const char *const *endings,
                            char path[PATH_SIZE], bool *found, gbt_error *err)
{
    file_kind kind;
    *found = false;
    for (; *endings != NULL && !*found; endings++) {
        GBT_TRY(file_join(path, PATH_SIZE - ENDING_SIZE, folder, name, err));
        strcat(path, *endings); /* there is room: ENDING_SIZE bytes were kept free above */
        GBT_TRY(file_look(path, &kind, err));
        *found = kind == FILE_OTHER;
    }
    return GBT_OK;
}

/* Find the file `written`, or else the same name with slashes for backslashes (on Linux a backslash is an
   ordinary character, so the literal name is tried first). `name` is set to the spelling last tried, which is
   the one found, if any; `path` to the last path tried. */
static gbt_status find_named(raw_place place, const char *what, const char *folder, const char *written,
                             const char *const *endings, char name[NAME_SIZE], char path[PATH_SIZE],
                             bool *found, gbt_error *err)
{
    char other[NAME_SIZE];
    written = plain_name(written);
    GBT_TRY(raw_check_name(what, written, strlen(written), place, err));
    memcpy(name, written, strlen(written) + 1);
    GBT_TRY(find_file(folder, name, endings, path, found, err));
    if (*found || strchr(name, '\\') == NULL)
        return GBT_OK;
    const char *slashed = with_slashes(name, other);
    GBT_TRY(raw_check_name(what, slashed, strlen(slashed), place, err));
    memcpy(name, slashed, strlen(slashed) + 1);
    return find_file(folder, name, endings, path, found, err);
}

static const char *const as_it_is[] = {"", NULL}, *const photo_endings[] = {"", ".png", ".jpg", NULL};

/* Find the frame's mask; NULL when it names none. */
static gbt_status find_mask(const transforms_frame *s, const char *folder, char **out, gbt_error *err)
{
    *out = NULL;
    const json_t *value = transforms_value(s->frame, "mask_path");
    if (value == NULL)
        return GBT_OK;
    if (!json_is_string(value))
        return transforms_fail(s, err, "wanted a string", "mask_path");
    char name[NAME_SIZE], path[PATH_SIZE];
    bool found;
    GBT_TRY(find_named((raw_place){s->file->name, RAW_MARK_FRAME, s->frame_index}, "mask_path", folder,
                       json_string_value(value), as_it_is, name, path, &found, err));
    if (!found)
        return base_fail(err, GBT_ERR_IO, "%s: frame %zu: mask is missing: %.200s", s->file->name,
                         s->frame_index, path);
    *out = raw_copy_text(path, strlen(path), err);
    return *out != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static gbt_status read_frame(const transforms_frame *s, const char *folder, raw_scene *out, gbt_error *err)
{
    const json_t *value = transforms_value(s->frame, "file_path");
    if (!json_is_string(value))
        return transforms_fail(s, err, "wanted a string", "file_path");
    char name[NAME_SIZE], path[PATH_SIZE];
    bool found;
    gbt_camera camera = {0};
    GBT_TRY(transforms_pose(s, &camera, err));
    GBT_TRY(find_named((raw_place){s->file->name, RAW_MARK_FRAME, s->frame_index}, "image name", folder,
                       json_string_value(value), photo_endings, name, path, &found, err));
    if (!found)
        return raw_count_missing(out, name, err);
    GBT_TRY(transforms_camera(s, path, &camera, out, err));
    char *mask;
    GBT_TRY(find_mask(s, folder, &mask, err));
    raw_view *view = raw_next_view(out, err);
    if (view == NULL) {
        mem_free(mask);
        return GBT_ERR_NO_MEMORY;
    }
    *view = (raw_view){.name = raw_copy_text(name, strlen(name), err),
                       .path = raw_copy_text(path, strlen(path), err),
                       .mask_path = mask,
                       .camera = camera};
    out->view_count++;
    return view->name != NULL && view->path != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

/* If there is a list train_filenames, every view that is not in it is held out. */
static gbt_status read_split(const source_file *file, const json_t *root, raw_scene *out, gbt_error *err)
{
    const json_t *list = transforms_value(root, "train_filenames");
    if (list == NULL)
        return GBT_OK;
    json_t *names = json_object();
    gbt_status status = json_is_array(list) ? GBT_OK
                                            : base_fail(err, GBT_ERR_FORMAT,
                                                        "%s: train_filenames: wanted a list", file->name);
    for (size_t i = 0; i < json_array_size(list) && status == GBT_OK; i++) {
        const char *name = json_string_value(json_array_get(list, i));
        char slashed[NAME_SIZE];
        if (name == NULL)
            status = base_fail(err, GBT_ERR_FORMAT, "%s: train_filenames: entry %zu is not a string",
                               file->name, i);
        else if (json_object_set_new(names, plain_name(name), json_true()) != 0 ||
                 json_object_set_new(names, with_slashes(name, slashed), json_true()) != 0)
            status = base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for the names", file->name);
    }
    for (size_t i = 0; i < out->view_count && status == GBT_OK; i++)
        out->views[i].is_test = json_object_get(names, out->views[i].name) == NULL;
    out->has_split = true;
    json_decref(names);
    return status;
}

static gbt_status read_root(const source_file *file, const json_t *root, const char *folder,
                            bool may_be_empty, raw_scene *out, char **points_name, gbt_error *err)
{
    const json_t *frames = transforms_value(root, "frames");
    if (frames == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no frames (wanted a transforms.json)", file->name);
    if (!json_is_array(frames) || (json_array_size(frames) == 0 && !may_be_empty))
        return base_fail(err, GBT_ERR_FORMAT, "%s: frames is not a list with at least one entry", file->name);
    for (size_t i = 0; i < json_array_size(frames); i++) {
        const transforms_frame s = {
            .file = file, .frame = json_array_get(frames, i), .top = root, .frame_index = i};
        if (!json_is_object(s.frame))
            return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: wanted an object", file->name, i);
        GBT_TRY(read_frame(&s, folder, out, err));
    }
    if (out->view_count == 0) {
        const char *first = json_string_value(json_object_get(json_array_get(frames, 0), "file_path"));
        return base_fail(err, GBT_ERR_IO, "%s: none of the %zu photos exists, the first is %.200s",
                         file->name, out->photos_missing, first);
    }
    static const char applied[] = "applied_transform";
    const transforms_frame top = {.file = file, .frame = root, .top = root};
    if (transforms_value(root, applied) != NULL && !transforms_is_similarity(&top, applied))
        out->has_odd_transform = true;
    GBT_TRY(read_split(file, root, out, err));
    const json_t *points = transforms_value(root, "ply_file_path");
    if (points == NULL)
        return GBT_OK;
    if (!json_is_string(points))
        return base_fail(err, GBT_ERR_FORMAT, "%s: ply_file_path: wanted a string", file->name);
    char name[NAME_SIZE], path[PATH_SIZE];
    bool found;
    GBT_TRY(find_named((raw_place){file->name, RAW_MARK_FILE, 0}, "ply_file_path", folder,
                       json_string_value(points), as_it_is, name, path, &found, err));
    *points_name = raw_copy_text(name, strlen(name), err);
    return *points_name != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

gbt_status transforms_read(const source_file *file, const char *folder, bool may_be_empty, raw_scene *out,
                           char **points_name, gbt_error *err)
{
    *points_name = NULL;
    json_t *root;
    GBT_TRY(json_read_text((const char *)file->bytes, file->size, file->name, &root, err));
    const gbt_status status = read_root(file, root, folder, may_be_empty, out, points_name, err);
    json_decref(root);
    return status;
}
