/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms.c -- transforms.json from bytes: its frames, their photos and masks, the split. */
#include "data/transforms.h"

#include "base/file.h"
#include "data/transforms_camera.h"

enum { PATH_SIZE = RAW_NAME_LIMIT + 4096 };

/* A leading ./ says nothing. */
static const char *plain_name(const json_t *text)
{
    const char *name = json_string_value(text);
    while (strncmp(name, "./", 2) == 0)
        name += 2;
    return name;
}

/* The photo of a frame: the name as it is, then with .png and .jpg. False when none is there. */
static gbt_status find_photo(const char *folder, const char *name, char path[PATH_SIZE], bool *found,
                             gbt_error *err)
{
    static const char *const endings[] = {"", ".png", ".jpg"};
    file_kind kind;
    *found = false;
    for (size_t i = 0; i < sizeof endings / sizeof endings[0] && !*found; i++) {
        GBT_TRY(file_join(path, PATH_SIZE - 8, folder, name, err));
        memcpy(path + strlen(path), endings[i], strlen(endings[i]) + 1); /* the 8 bytes left out above */
        GBT_TRY(file_look(path, &kind, err));
        *found = kind == FILE_OTHER;
    }
    return GBT_OK;
}

/* The frame's mask, or NULL when it names none. */
static gbt_status find_mask(const transforms_frame *s, const char *folder, char **out, gbt_error *err)
{
    *out = NULL;
    const json_t *value = json_object_get(s->frame, "mask_path");
    if (value == NULL || json_is_null(value))
        return GBT_OK;
    if (!json_is_string(value))
        return transforms_fail(s, err, "wanted a string", "mask_path");
    const char *name = json_string_value(value);
    char path[PATH_SIZE];
    file_kind kind;
    GBT_TRY(
        raw_check_name(name, strlen(name), (raw_place){s->file->name, RAW_MARK_FRAME, s->frame_index}, err));
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    GBT_TRY(file_look(path, &kind, err));
    if (kind != FILE_OTHER)
        return base_fail(err, GBT_ERR_IO, "%s: frame %zu: mask is missing: %.200s", s->file->name,
                         s->frame_index, path);
    *out = raw_copy_text(path, strlen(path), err);
    return *out != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static gbt_status read_frame(const transforms_frame *s, const char *folder, raw_scene *out, gbt_error *err)
{
    const json_t *value = json_object_get(s->frame, "file_path");
    if (!json_is_string(value))
        return transforms_fail(s, err, "wanted a string", "file_path");
    const char *name = plain_name(value);
    GBT_TRY(
        raw_check_name(name, strlen(name), (raw_place){s->file->name, RAW_MARK_FRAME, s->frame_index}, err));
    char path[PATH_SIZE];
    bool found;
    gbt_camera camera = {0};
    GBT_TRY(transforms_pose(s, &camera, err));
    GBT_TRY(find_photo(folder, name, path, &found, err));
    if (!found) {
        raw_count_missing(out, name);
        return GBT_OK;
    }
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

/* With a list train_filenames, every view that is not in it is held out. */
static gbt_status read_split(const source_file *file, const json_t *root, raw_scene *out, gbt_error *err)
{
    const json_t *list = json_object_get(root, "train_filenames");
    if (list == NULL)
        return GBT_OK;
    json_t *names = json_object();
    gbt_status status = json_is_array(list) ? GBT_OK
                                            : base_fail(err, GBT_ERR_FORMAT,
                                                        "%s: train_filenames: wanted a list", file->name);
    for (size_t i = 0; i < json_array_size(list) && status == GBT_OK; i++) {
        const json_t *name = json_array_get(list, i);
        if (!json_is_string(name))
            status = base_fail(err, GBT_ERR_FORMAT, "%s: train_filenames: entry %zu is not a string",
                               file->name, i);
        else if (json_object_set_new(names, plain_name(name), json_true()) != 0)
            status = base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for the names", file->name);
    }
    for (size_t i = 0; i < out->view_count && status == GBT_OK; i++)
        out->views[i].is_test = json_object_get(names, out->views[i].name) == NULL;
    out->has_split = true;
    json_decref(names);
    return status;
}

static gbt_status read_root(const source_file *file, const json_t *root, const char *folder, raw_scene *out,
                            char **points_name, gbt_error *err)
{
    const json_t *frames = json_object_get(root, "frames");
    if (frames == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: no frames (wanted a transforms.json)", file->name);
    if (!json_is_array(frames) || json_array_size(frames) == 0)
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
    GBT_TRY(read_split(file, root, out, err));
    const json_t *points = json_object_get(root, "ply_file_path");
    if (points == NULL || json_is_null(points))
        return GBT_OK;
    if (!json_is_string(points))
        return base_fail(err, GBT_ERR_FORMAT, "%s: ply_file_path: wanted a string", file->name);
    const char *name = json_string_value(points);
    GBT_TRY(raw_check_name(name, strlen(name), (raw_place){file->name, ':', 1}, err));
    *points_name = raw_copy_text(name, strlen(name), err);
    return *points_name != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

gbt_status transforms_read(const source_file *file, const char *folder, raw_scene *out, char **points_name,
                           gbt_error *err)
{
    *points_name = NULL;
    if (file->size == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s:1: file is empty (wanted JSON)", file->name);
    json_error_t fault;
    json_t *root = json_loadb((const char *)file->bytes, file->size, JSON_REJECT_DUPLICATES, &fault);
    if (root == NULL) {
        if (json_error_code(&fault) == json_error_out_of_memory)
            return base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory for the JSON", file->name);
        return base_fail(err, GBT_ERR_FORMAT, "%s:%d: not usable JSON: %s", file->name, fault.line,
                         fault.text);
    }
    gbt_status status;
    if (json_is_object(root))
        status = read_root(file, root, folder, out, points_name, err);
    else
        status = base_fail(err, GBT_ERR_FORMAT, "%s:1: wanted a JSON object", file->name);
    json_decref(root);
    return status;
}
