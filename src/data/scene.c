/* SPDX-License-Identifier: Apache-2.0 */
/* data/scene.c -- loads a scene from a path: finds the files, reads them, recentres and splits.

   path --> [which source?] --> reader --> raw_scene (double, world) --> [photos there?] --> [origin]
        --> scene (local) --> [split] */
#include "data/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/paged.h"
#include "base/vec.h"
#include "data/colmap_bin.h"
#include "data/colmap_place.h"
#include "data/colmap_txt.h"
#include "data/ply.h"
#include "data/scene_photos.h"
#include "data/split.h"
#include "data/transforms.h"
#include "data/unposed.h"

enum { PATH_SIZE = RAW_NAME_LIMIT + 4096, CHECK_NUMBERS = 1 << 16 };

static gbt_status load_file(const char *path, raw_scene *raw, source_file *out, unsigned char **owned,
                            gbt_error *err)
{
    *out = (source_file){.name = path};
    const gbt_status status = file_read(path, owned, &out->size, err);
    out->bytes = *owned;
    raw->file_bytes += out->size;
    return status;
}

/* COLMAP 4 also writes the poses of rigs. They are not needed: image poses already include them. */
static void log_rigs(const char *model, const char *ending)
{
    char name[32], path[PATH_SIZE];
    snprintf(name, sizeof name, "rigs.%s", ending);
    if (file_join(path, sizeof path, model, name, NULL) == GBT_OK && file_exists(path))
        log_info("%s: not needed: every image has its whole pose", path);
}

static gbt_status read_model(const char *model, const char *ending, raw_scene *raw, gbt_error *err)
{
    static const char *const names[3] = {"cameras", "images", "points3D"};
    char paths[3][PATH_SIZE];
    unsigned char *owned[3] = {0};
    source_file loaded[3] = {0};
    gbt_status status = GBT_OK;
    for (int i = 0; i < 3 && status == GBT_OK; i++) {
        char name[32];
        snprintf(name, sizeof name, "%s.%s", names[i], ending);
        status = file_join(paths[i], sizeof paths[i], model, name, err);
        if (status == GBT_OK && !file_exists(paths[i]))
            status = base_fail(err, GBT_ERR_IO, "%s: missing (wanted cameras, images and points3D together)",
                               paths[i]);
        if (status == GBT_OK)
            status = load_file(paths[i], raw, &loaded[i], &owned[i], err);
    }
    const colmap_files files = {.cameras = loaded[0], .images = loaded[1], .points = loaded[2]};
    if (status == GBT_OK)
        status = strcmp(ending, "bin") == 0 ? colmap_bin_read(&files, raw, err)
                                            : colmap_txt_read(&files, raw, err);
    if (status == GBT_OK && raw->view_count == 0)
        status = base_fail(err, GBT_ERR_FORMAT, "%s: no registered image in the model", paths[1]);
    if (status == GBT_OK)
        status = raw_sort_views(raw, paths[1], err);
    for (int i = 0; i < 3; i++)
        mem_free(owned[i]);
    if (status == GBT_OK && !raw->is_known)
        log_rigs(model, ending);
    return status;
}

/* Load the COLMAP model in `folder`, if there is one. */
static gbt_status load_colmap(const char *folder, colmap_layout layout, raw_scene *raw, const char **source,
                              bool *found, gbt_error *err)
{
    char model[PATH_SIZE];
    const char *ending;
    GBT_TRY(colmap_place_find(folder, layout, model, sizeof model, &ending, err));
    *found = model[0] != '\0';
    if (!*found)
        return GBT_OK;
    *source = strcmp(ending, "bin") == 0 ? "colmap-bin" : "colmap-txt";
    GBT_TRY(read_model(model, ending, raw, err));
    return scene_find_photos(folder, raw, err);
}

static gbt_status load_points(const char *path, raw_scene *raw, gbt_error *err)
{
    source_file file;
    unsigned char *owned;
    GBT_TRY(load_file(path, raw, &file, &owned, err));
    const gbt_status status = ply_read_points(&file, raw, err);
    mem_free(owned);
    return status;
}

/* Add the views of a transforms.json, and its points unless there are some already. */
static gbt_status add_transforms(const char *path, const char *folder, bool may_be_empty, raw_scene *raw,
                                 gbt_error *err)
{
    source_file file;
    unsigned char *owned;
    char *points_name = NULL;
    GBT_TRY(load_file(path, raw, &file, &owned, err));
    gbt_status status = transforms_read(&file, folder, may_be_empty, raw, &points_name, err);
    mem_free(owned);
    if (status == GBT_OK && points_name != NULL && raw->position == NULL) {
        char points_path[PATH_SIZE];
        status = file_join(points_path, sizeof points_path, folder, points_name, err);
        if (status == GBT_OK)
            status = load_points(points_path, raw, err);
    }
    mem_free(points_name);
    return status;
}

static gbt_status load_transforms(const char *path, const char *folder, raw_scene *raw, gbt_error *err)
{
    char masks[PATH_SIZE];
    bool masked = false;
    GBT_TRY(add_transforms(path, folder, false, raw, err));
    GBT_TRY(file_join(masks, sizeof masks, folder, "masks", err));
    for (size_t i = 0; i < raw->view_count; i++)
        masked = masked || raw->views[i].mask_path != NULL;
    if (!raw->is_known && !masked && file_is_folder(masks))
        log_warn("%s: not used: no frame of %s names a mask in it (mask_path)", masks, path);
    return raw_sort_views(raw, path, err);
}

/* By photo; for the same photo, training views come first. */
static int by_photo(const void *a, const void *b)
{
    const raw_view *x = a, *y = b;
    const int order = strcmp(x->path, y->path);
    return order != 0 ? order : x->is_test - y->is_test;
}

/* Drop held-out views whose photo is also trained on. */
static void drop_repeated(raw_scene *raw, size_t *dropped)
{
    size_t kept = 0;
    qsort(raw->views, raw->view_count, sizeof *raw->views, by_photo);
    for (size_t i = 0; i < raw->view_count; i++) {
        const raw_view *last = kept > 0 ? &raw->views[kept - 1] : NULL;
        if (last != NULL && !last->is_test && raw->views[i].is_test &&
            strcmp(last->path, raw->views[i].path) == 0)
            raw_view_free(&raw->views[i]);
        else
            raw->views[kept++] = raw->views[i];
    }
    *dropped = raw->view_count - kept;
    raw->view_count = kept;
}

/* Blender's synthetic scenes: `train` is transforms_train.json; held-out views are in a file beside it. */
static gbt_status load_blender(const char *train, const char *folder, raw_scene *raw, gbt_error *err)
{
    static const char *const held_out[] = {"transforms_test.json", "transforms_val.json"};
    GBT_TRY(add_transforms(train, folder, false, raw, err));
    for (size_t i = 0; i < sizeof held_out / sizeof held_out[0] && !raw->has_split; i++) {
        char path[PATH_SIZE];
        GBT_TRY(file_join(path, sizeof path, folder, held_out[i], err));
        if (!file_exists(path))
            continue;
        const size_t first = raw->view_count;
        size_t dropped;
        GBT_TRY(add_transforms(path, folder, true, raw, err));
        for (size_t v = first; v < raw->view_count; v++)
            raw->views[v].is_test = true;
        drop_repeated(raw, &dropped);
        if (!raw->is_known && dropped > 0)
            log_warn("%s: photos also listed for training, so not held out: %zu", path, dropped);
        raw->has_split = raw->view_count > first;
    }
    return raw_sort_views(raw, train, err);
}

static gbt_status load_file_source(const char *path, raw_scene *raw, const char **source, gbt_error *err)
{
    char folder[PATH_SIZE];
    if (file_ends_with(path, ".ply")) {
        *source = "ply";
        GBT_TRY(load_points(path, raw, err));
        if (raw->point_count == 0)
            return base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable point (%zu dropped)", path,
                             raw->points_dropped);
        return GBT_OK;
    }
    if (file_ends_with(path, ".json")) {
        *source = "transforms";
        const char *slash = strrchr(path, '/');
        if (slash != NULL && (size_t)(slash - path) >= sizeof folder)
            return base_fail(err, GBT_ERR_ARGUMENT, "%.200s...: path is too long", path);
        snprintf(folder, sizeof folder, "%.*s", slash == NULL ? 1 : (int)(slash - path) + (slash == path),
                 slash == NULL ? "." : path);
        return load_transforms(path, folder, raw, err);
    }
    GBT_TRY(unposed_check(path, err));
    return base_fail(err, GBT_ERR_FORMAT, "%s: not a data set (wanted a folder, a .ply or a transforms.json)",
                     path);
}

static gbt_status load_folder(const char *path, raw_scene *raw, const char **source, gbt_error *err)
{
    char place[PATH_SIZE];
    bool found;
    GBT_TRY(load_colmap(path, COLMAP_USUAL, raw, source, &found, err));
    if (found)
        return GBT_OK;
    GBT_TRY(file_join(place, sizeof place, path, "transforms.json", err));
    if (file_exists(place)) {
        *source = "transforms";
        return load_transforms(place, path, raw, err);
    }
    GBT_TRY(file_join(place, sizeof place, path, "transforms_train.json", err));
    if (file_exists(place)) {
        *source = "blender";
        return load_blender(place, path, raw, err);
    }
    GBT_TRY(load_colmap(path, COLMAP_NERFSTUDIO, raw, source, &found, err));
    if (found)
        return GBT_OK;
    GBT_TRY(colmap_place_check(path, err));
    GBT_TRY(unposed_check(path, err));
    return base_fail(err, GBT_ERR_FORMAT,
                     "%s: not a data set (wanted sparse/0/cameras.bin, transforms.json or "
                     "transforms_train.json in it)",
                     path);
}

gbt_status scene_need(const char *path, gbt_error *err)
{
    return file_exists(path) ? GBT_OK : base_fail(err, GBT_ERR_IO, "%s: no such file or folder", path);
}

static gbt_status load_raw(const char *path, raw_scene *raw, const char **source, gbt_error *err)
{
    file_kind kind;
    GBT_TRY(file_look(path, &kind, err));
    GBT_TRY(scene_need(path, err));
    return kind == FILE_OTHER ? load_file_source(path, raw, source, err)
                              : load_folder(path, raw, source, err);
}

static uint64_t ordered_bits(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits >> 63 ? ~bits : bits | UINT64_C(1) << 63;
}

/* The lower median of values[0], values[stride], ... by radix selection: always 8 passes, and no copy. */
static double median(const double *values, size_t stride, size_t count)
{
    size_t rank = (count - 1) / 2;
    uint64_t prefix = 0;
    for (int shift = 56; shift >= 0; shift -= 8) {
        size_t histogram[256] = {0};
        for (size_t i = 0; i < count; i++) {
            const uint64_t bits = ordered_bits(values[i * stride]);
            if (shift == 56 || bits >> (shift + 8) == prefix)
                histogram[bits >> shift & 255]++;
        }
        uint64_t digit = 0;
        while (rank >= histogram[digit])
            rank -= histogram[digit++];
        prefix = prefix << 8 | digit;
    }
    const uint64_t bits = prefix >> 63 ? prefix & ~(UINT64_C(1) << 63) : ~prefix;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The median of the camera centres. `first` is the camera of the first view; views are `view_bytes` apart. */
static gbt_status median_center(const gbt_camera *first, size_t view_bytes, size_t count, double out[3],
                                gbt_error *err)
{
    double *centers = mem_alloc(count, 3 * sizeof *centers, "camera centres", err);
    if (centers == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        memcpy(centers + 3 * i, ((const gbt_camera *)((const char *)first + i * view_bytes))->center,
               3 * sizeof *centers);
    for (size_t k = 0; k < 3; k++)
        out[k] = median(centers + k, 3, count);
    mem_free(centers);
    return GBT_OK;
}

static gbt_status find_origin(const raw_scene *raw, double origin[3], gbt_error *err)
{
    for (size_t k = 0; k < 3 && raw->point_count > 0; k++)
        origin[k] = median(raw->position + k, 3, raw->point_count);
    if (raw->point_count > 0 || raw->view_count == 0)
        return GBT_OK;
    return median_center(&raw->views[0].camera, sizeof *raw->views, raw->view_count, origin, err);
}

/* Keep every n-th sighting, so that at most SCENE_SEEN_MAX remain, and the depth of the nearest points. */
static gbt_status keep_sightings(const raw_scene *raw, const raw_view *view, scene_view *out, gbt_error *err)
{
    const size_t stride = view->seen_count / SCENE_SEEN_MAX + 1;
    GBT_TRY(raw_nearest_depth(raw, view, &out->nearest, err));
    out->seen = mem_alloc(view->seen_count / stride + 1, sizeof *out->seen, "tracks", err);
    if (out->seen == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < view->seen_count; i += stride)
        out->seen[out->seen_count++] = view->seen[i];
    return GBT_OK;
}

/* Move everything from `raw` to `out`, with coordinates relative to out->origin. */
static gbt_status place(raw_scene *raw, scene *out, gbt_error *err)
{
    out->points.position = mem_alloc(raw->point_count, 3 * sizeof *out->points.position, "points", err);
    out->views = mem_calloc(raw->view_count, sizeof *out->views, "views", err);
    if (out->points.position == NULL || out->views == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < 3 * raw->point_count; i++) {
        out->points.position[i] = (float)(raw->position[i] - out->origin[i % 3]);
        if (i % CHECK_NUMBERS == 0)
            paged_check();
    }
    out->points.count = raw->point_count;
    out->points.has_color = raw->has_color;
    out->points.color = raw->color;
    raw->color = NULL;
    if (out->points.color == NULL)
        out->points.color = mem_alloc(0, sizeof(float), "point colours", err); /* never NULL */
    if (out->points.color == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < raw->view_count; i++) {
        raw_view *view = &raw->views[i];
        out->views[i] = (scene_view){.name = view->name,
                                     .path = view->path,
                                     .mask_path = view->mask_path,
                                     .camera = view->camera,
                                     .is_test = view->is_test,
                                     .rank = view->rank};
        view->name = NULL;
        view->path = NULL;
        view->mask_path = NULL;
        for (int k = 0; k < 3; k++)
            out->views[i].camera.center[k] -= out->origin[k];
        out->view_count++;
        GBT_TRY(keep_sightings(raw, view, &out->views[i], err));
    }
    out->points_dropped = raw->points_dropped;
    out->photos_missing = raw->photos_missing;
    out->file_bytes = raw->file_bytes;
    memcpy(out->missing_names, raw->missing_names, sizeof out->missing_names);
    out->missing_lines = raw->missing_lines;
    out->missing_bytes = raw->missing_bytes;
    raw->missing_lines = NULL;
    out->has_split = raw->has_split;
    return GBT_OK;
}

static void warn_about(const char *path, const raw_scene *raw, const scene_split *split, const scene *s)
{
    if (s->listed_missing > 0)
        log_warn("%s: names of missing photos, ignored: %zu", split->list_path, s->listed_missing);
    if (raw->points_dropped > 0)
        log_warn("%s: points with unusable coordinates, dropped: %zu", path, raw->points_dropped);
    if (raw->tracks_missing > 0)
        log_warn("%s: track entries of images that are missing: %zu", path, raw->tracks_missing);
    if (raw->trailing_bytes > 0)
        log_warn("%s: bytes after the last record, ignored: %zu", path, raw->trailing_bytes);
    if (raw->photos_missing > 0)
        log_warn("%s: views left out because their photo is missing: %zu, %zu remain%s%s", path,
                 raw->photos_missing, raw->view_count, raw->missing_names[0] != '\0' ? ": " : "",
                 raw->missing_names);
    size_t masks = 0;
    for (size_t i = 0; i < s->view_count; i++)
        masks += s->views[i].mask_path != NULL;
    if ((raw->has_masks || masks > 0) && masks < s->view_count)
        log_warn("%s: photos without a mask, used completely: %zu of %zu%s", path, s->view_count - masks,
                 s->view_count, raw->has_masks ? " (wanted masks/NAME.png)" : "");
    if (raw->angles_disagreeing > 0)
        log_warn("%s: frames whose camera_angle_x contradicts fl_x, which is used: %zu", path,
                 raw->angles_disagreeing);
    if (raw->has_odd_transform)
        log_warn(
            "%s: applied_transform is not a rotation with a scale; poses and points are used as they are, "
            "as with any other",
            path);
    if (raw->view_count == 1)
        log_warn("%s: only one view", path);
}

static gbt_status load(const char *path, const scene_split *split, bool is_known, bool recentres, scene *out,
                       gbt_error *err)
{
    const scene_split usual = {.kind = SCENE_SPLIT_AUTO};
    if (split == NULL)
        split = &usual;
    memset(out, 0, sizeof *out);
    raw_scene raw = {.is_known = is_known};
    const char *source = "";
    gbt_status status = load_raw(path, &raw, &source, err);
    if (status == GBT_OK && recentres)
        status = find_origin(&raw, out->origin, err);
    if (status == GBT_OK)
        status = place(&raw, out, err);
    if (status == GBT_OK) {
        snprintf(out->source, sizeof out->source, "%s", source);
        out->folder = raw_copy_text(path, strlen(path), err);
        status = out->folder != NULL ? split_apply(split, out, err) : GBT_ERR_NO_MEMORY;
    }
    if (status != GBT_OK)
        scene_free(out);
    else if (!is_known)
        warn_about(path, &raw, split, out);
    raw_free(&raw);
    return status;
}

gbt_status scene_load(const char *path, const scene_split *split, scene *out, gbt_error *err)
{
    return load(path, split, false, true, out, err);
}

gbt_status scene_load_known(const char *path, const scene_split *split, scene *out, gbt_error *err)
{
    return load(path, split, true, true, out, err);
}

gbt_status scene_load_in_place(const char *path, const scene_split *split, scene *out, gbt_error *err)
{
    return load(path, split, false, false, out, err);
}

gbt_status scene_forget_points(scene *s, bool recentres, gbt_error *err)
{
    double middle[3] = {0, 0, 0};
    if (recentres && s->view_count > 0)
        GBT_TRY(median_center(&s->views[0].camera, sizeof *s->views, s->view_count, middle, err));
    s->points.count = 0;
    for (size_t k = 0; k < 3; k++)
        s->origin[k] += middle[k];
    for (size_t i = 0; i < s->view_count; i++) {
        s->views[i].seen_count = 0;
        s->views[i].nearest = 0;
        for (size_t k = 0; k < 3; k++)
            s->views[i].camera.center[k] -= middle[k];
    }
    return GBT_OK;
}

void scene_free(scene *s)
{
    for (size_t i = 0; i < s->view_count; i++)
        scene_view_free(&s->views[i]);
    mem_free(s->folder);
    mem_free(s->held_out_list);
    mem_free(s->missing_lines);
    mem_free(s->views);
    mem_free(s->points.position);
    mem_free(s->points.color);
    memset(s, 0, sizeof *s);
}

double scene_camera_extent(const scene *s)
{
    size_t count = 0;
    double mean[3] = {0}, farthest = 0;
    for (size_t i = 0; i < s->view_count; i++)
        if (!s->views[i].is_test) {
            count++;
            for (int k = 0; k < 3; k++)
                mean[k] += (s->views[i].camera.center[k] - mean[k]) / (double)count;
        }
    for (size_t i = 0; i < s->view_count; i++)
        if (!s->views[i].is_test) {
            const double *c = s->views[i].camera.center;
            const double from_mean[3] = {c[0] - mean[0], c[1] - mean[1], c[2] - mean[2]};
            farthest = fmax(farthest, dvec_length(from_mean));
        }
    return farthest > 0 ? 1.1 * farthest : 1e-3; /* not 0 for a single camera or position, or else the
                                                    learning rate would be 0 */
}
