/* SPDX-License-Identifier: Apache-2.0 */
/* data/transforms.c -- transforms.json from bytes. */
#include "data/transforms.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>

#include "base/camera_model.h"
#include "base/file.h"
#include "base/image.h"
#include "base/vec.h"

enum { PATH_SIZE = RAW_NAME_LIMIT + 4096 };

/* Where a key is looked up: the frame first, then the top level. */
typedef struct scope {
    const source_file *file;
    const json_t *frame, *top;
    size_t frame_index;
} scope;

static gbt_status scope_fail(const scope *s, gbt_error *err, const char *text, const char *key)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: %s: %s", s->file->name, s->frame_index, key, text);
}

static const json_t *find(const scope *s, const char *key)
{
    const json_t *value = json_object_get(s->frame, key);
    return value != NULL ? value : json_object_get(s->top, key);
}

/* A number when the key is there; `*found` says whether it is. */
static gbt_status find_number(const scope *s, const char *key, double *out, bool *found, gbt_error *err)
{
    const json_t *value = find(s, key);
    *found = value != NULL;
    if (value == NULL)
        return GBT_OK;
    if (!json_is_number(value))
        return scope_fail(s, err, "not a number", key);
    *out = json_number_value(value);
    if (!(fabs(*out) <= RAW_COORDINATE_LIMIT))
        return scope_fail(s, err, "number is too large", key);
    return GBT_OK;
}

static gbt_status find_size(const scope *s, const char *key, int *out, bool *found, gbt_error *err)
{
    double value = 0;
    GBT_TRY(find_number(s, key, &value, found, err));
    if (!*found)
        return GBT_OK;
    if (!(value >= 1 && value <= RAW_IMAGE_LIMIT && value == floor(value)))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: frame %zu: %s: out of range (wanted a whole number in 1..%d, got %g)",
                         s->file->name, s->frame_index, key, RAW_IMAGE_LIMIT, value);
    *out = (int)value;
    return GBT_OK;
}

/* camera_angle_x or _y, radians, else x_fov or y_fov, degrees, to a focal length in pixels; 0 when neither is
   there. */
static gbt_status focal_from_angle(const scope *s, char axis, int size, double *focal, gbt_error *err)
{
    double angle = 0;
    bool found;
    char key[16];
    snprintf(key, sizeof key, "camera_angle_%c", axis);
    GBT_TRY(find_number(s, key, &angle, &found, err));
    if (!found) {
        snprintf(key, sizeof key, "%c_fov", axis);
        GBT_TRY(find_number(s, key, &angle, &found, err));
        angle *= 3.14159265358979 / 180;
    }
    *focal = 0;
    if (!found)
        return GBT_OK;
    if (!(angle > 0 && angle < 3.14159265358979))
        return base_fail(err, GBT_ERR_FORMAT,
                         "%s: frame %zu: %s: out of range (wanted 0..pi radians, got %g)", s->file->name,
                         s->frame_index, key, angle);
    *focal = 0.5 * size / tan(0.5 * angle);
    if (!(*focal > 0 && *focal <= RAW_COORDINATE_LIMIT))
        return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: %s: no lens has this angle (got %g)",
                         s->file->name, s->frame_index, key, angle);
    return GBT_OK;
}

/* What a file of this kind can say of a lens are the keys k1 to k4, p1 and p2: every model of them is taken,
   and so is FULL_OPENCV, whose other coefficients are then 0. */
static bool is_supported(gbt_camera_model model)
{
    const lens_kind kind = camera_model_of(model)->kind;
    return (kind == LENS_PERSPECTIVE || kind == LENS_FISHEYE || kind == LENS_EQUIRECTANGULAR) &&
           !camera_model_has_prism(model);
}

static gbt_status find_kind(const scope *s, lens_kind *kind, bool *is_opencv, gbt_error *err)
{
    gbt_camera_model model;
    *is_opencv = false;
    const json_t *value = find(s, "camera_model");
    if (value == NULL) {
        *kind = json_is_true(find(s, "is_fisheye"))        ? LENS_FISHEYE
                : json_is_true(find(s, "equirectangular")) ? LENS_EQUIRECTANGULAR
                                                           : LENS_PERSPECTIVE;
        return GBT_OK;
    }
    if (!json_is_string(value))
        return scope_fail(s, err, "not a string", "camera_model");
    const char *name = json_string_value(value);
    if (camera_model_find(name, strlen(name), &model) && is_supported(model)) {
        *kind = camera_model_of(model)->kind;
        *is_opencv = model == GBT_CAMERA_OPENCV;
        return GBT_OK;
    }
    return base_fail(err, GBT_ERR_FORMAT, "%s: frame %zu: camera_model is not supported: %.60s",
                     s->file->name, s->frame_index, name);
}

enum { K1, K2, K3, K4, P1, P2, LENS_COUNT };

/* k1 k2 k3 k4 p1 p2, from keys of their own or from distortion_params in this order; absent ones are 0. */
static gbt_status find_distortion(const scope *s, double lens[LENS_COUNT], bool *any, gbt_error *err)
{
    static const char *const keys[LENS_COUNT] = {"k1", "k2", "k3", "k4", "p1", "p2"};
    *any = false;
    memset(lens, 0, LENS_COUNT * sizeof *lens);
    const json_t *list = find(s, "distortion_params");
    if (list != NULL && (!json_is_array(list) || json_array_size(list) != LENS_COUNT))
        return scope_fail(s, err, "wanted 6 numbers: k1 k2 k3 k4 p1 p2", "distortion_params");
    for (size_t i = 0; i < LENS_COUNT; i++) {
        bool found;
        if (list != NULL && !json_is_number(json_array_get(list, i)))
            return scope_fail(s, err, "not a number", "distortion_params");
        if (list != NULL)
            lens[i] = json_number_value(json_array_get(list, i));
        GBT_TRY(find_number(s, keys[i], &lens[i], &found, err));
        *any = *any || found || list != NULL;
    }
    return GBT_OK;
}

/* The focal lengths: fl_x and fl_y, else the angles; a missing y follows x. */
static gbt_status find_focal(const scope *s, const gbt_camera *camera, double focal[2], raw_scene *out,
                             gbt_error *err)
{
    bool has_x, has_y;
    double from_angle[2];
    GBT_TRY(find_number(s, "fl_x", &focal[0], &has_x, err));
    GBT_TRY(find_number(s, "fl_y", &focal[1], &has_y, err));
    GBT_TRY(focal_from_angle(s, 'x', camera->width, &from_angle[0], err));
    GBT_TRY(focal_from_angle(s, 'y', camera->height, &from_angle[1], err));
    if (!has_x && !has_y && from_angle[0] == 0 && from_angle[1] == 0)
        return scope_fail(s, err, "neither fl_x nor camera_angle_x is there", "focal length");
    if (has_x && from_angle[0] > 0 && fabs(from_angle[0] - focal[0]) > 0.01 * fabs(focal[0]))
        out->angles_disagreeing++;
    if (!has_x)
        focal[0] = from_angle[0] > 0 ? from_angle[0] : has_y ? focal[1] : from_angle[1];
    if (!has_y)
        focal[1] = !has_x && from_angle[1] > 0 ? from_angle[1] : focal[0];
    return GBT_OK;
}

static gbt_status read_camera(const scope *s, const char *photo, gbt_camera *camera, raw_scene *out,
                              gbt_error *err)
{
    bool has_width, has_height, has_cx, has_cy, is_opencv, any;
    lens_kind kind = LENS_PERSPECTIVE;
    double focal[2] = {0}, lens[LENS_COUNT];
    GBT_TRY(find_size(s, "w", &camera->width, &has_width, err));
    GBT_TRY(find_size(s, "h", &camera->height, &has_height, err));
    if (!has_width || !has_height) {
        int width, height, channels;
        GBT_TRY(image_probe(photo, &width, &height, &channels, err));
        camera->width = has_width ? camera->width : width;
        camera->height = has_height ? camera->height : height;
    }
    GBT_TRY(find_kind(s, &kind, &is_opencv, err));
    double *p = camera->params;
    const raw_place place = {s->file->name, RAW_MARK_FRAME, s->frame_index};
    if (kind == LENS_EQUIRECTANGULAR) {
        camera->model = GBT_CAMERA_EQUIRECTANGULAR;
        p[0] = camera->width;
        p[1] = camera->height;
        return raw_check_camera(camera, place, err);
    }
    GBT_TRY(find_focal(s, camera, focal, out, err));
    double cx = 0.5 * camera->width, cy = 0.5 * camera->height;
    GBT_TRY(find_number(s, "cx", &cx, &has_cx, err));
    GBT_TRY(find_number(s, "cy", &cy, &has_cy, err));
    GBT_TRY(find_distortion(s, lens, &any, err));
    p[0] = focal[0];
    p[1] = focal[1];
    p[2] = cx;
    p[3] = cy;
    if (kind == LENS_FISHEYE) {
        if (lens[P1] != 0 || lens[P2] != 0)
            return scope_fail(s, err, "a fisheye with tangential distortion is not supported", "p1, p2");
        camera->model = GBT_CAMERA_OPENCV_FISHEYE;
        memcpy(p + 4, lens, 4 * sizeof *p);
    } else if (!any && !is_opencv) {
        camera->model = GBT_CAMERA_PINHOLE;
    } else {
        if (lens[K4] != 0)
            return scope_fail(s, err, "not supported for a lens that is not a fisheye", "k4");
        camera->model = lens[K3] != 0 ? GBT_CAMERA_FULL_OPENCV : GBT_CAMERA_OPENCV;
        p[4] = lens[K1];
        p[5] = lens[K2];
        p[6] = lens[P1];
        p[7] = lens[P2];
        if (lens[K3] != 0)
            p[8] = lens[K3];
    }
    return raw_check_camera(camera, place, err);
}

/* Columns to an orthonormal matrix, Gram-Schmidt; only called when they nearly are one. */
static void orthonormalize(double m[9])
{
    double column[3][3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            column[i][k] = m[3 * k + i];
    dvec_normalize(column[0]);
    const double along = dvec_dot(column[0], column[1]);
    for (int k = 0; k < 3; k++)
        column[1][k] -= along * column[0][k];
    dvec_normalize(column[1]);
    dvec_cross(column[0], column[1], column[2]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[3 * k + i] = column[i][k];
}

static gbt_status read_matrix(const scope *s, double m[4][4], gbt_error *err)
{
    static const char key[] = "transform_matrix";
    const json_t *rows = json_object_get(s->frame, key);
    if (rows == NULL)
        return scope_fail(s, err, "is missing", key);
    const size_t row_count = json_is_array(rows) ? json_array_size(rows) : 0;
    if (row_count != 3 && row_count != 4)
        return scope_fail(s, err, "wanted 3 or 4 rows of 4 numbers", key);
    for (size_t i = 0; i < 4; i++)
        for (size_t k = 0; k < 4; k++)
            m[i][k] = i == k;
    for (size_t i = 0; i < row_count; i++) {
        const json_t *row = json_array_get(rows, i);
        if (!json_is_array(row) || json_array_size(row) != 4)
            return scope_fail(s, err, "wanted 3 or 4 rows of 4 numbers", key);
        for (size_t k = 0; k < 4; k++) {
            const json_t *value = json_array_get(row, k);
            if (!json_is_number(value))
                return scope_fail(s, err, "holds something that is not a number", key);
            m[i][k] = json_number_value(value);
            if (!(fabs(m[i][k]) <= RAW_COORDINATE_LIMIT))
                return scope_fail(s, err, "holds a number that is too large", key);
        }
    }
    for (size_t k = 0; k < 4; k++)
        if (fabs(m[3][k] - (k == 3)) > 1e-3)
            return scope_fail(s, err, "last row is not 0 0 0 1 (is the matrix transposed?)", key);
    return GBT_OK;
}

static gbt_status read_pose(const scope *s, gbt_camera *camera, gbt_error *err)
{
    double m[4][4], rotation[9], worst = 0;
    GBT_TRY(read_matrix(s, m, err));
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            rotation[3 * i + k] = m[i][k];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            const double dot = m[0][i] * m[0][k] + m[1][i] * m[1][k] + m[2][i] * m[2][k];
            worst = fmax(worst, fabs(dot - (i == k)));
        }
    if (!(worst <= 1e-3))
        return base_fail(
            err, GBT_ERR_FORMAT,
            "%s: frame %zu: transform_matrix is not a rotation (wanted |R'R - I| <= 1e-3, got %g)",
            s->file->name, s->frame_index, worst);
    const double x[3] = {m[0][0], m[1][0], m[2][0]}, y[3] = {m[0][1], m[1][1], m[2][1]},
                 z[3] = {m[0][2], m[1][2], m[2][2]};
    double cross[3];
    dvec_cross(x, y, cross);
    if (dvec_dot(cross, z) < 0)
        return scope_fail(s, err, "is a reflection (wanted determinant +1, got -1)", "transform_matrix");
    orthonormalize(rotation);
    for (int i = 0; i < 3; i++) {
        camera->center[i] = m[i][3];
        /* Rows of world-to-camera are columns of camera-to-world; y and z change sign between OpenGL's axes
           and ours. */
        camera->rotation[0 + i] = rotation[3 * i];
        camera->rotation[3 + i] = -rotation[3 * i + 1];
        camera->rotation[6 + i] = -rotation[3 * i + 2];
    }
    return GBT_OK;
}

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
    *found = false;
    for (size_t i = 0; i < sizeof endings / sizeof endings[0] && !*found; i++) {
        GBT_TRY(file_join(path, PATH_SIZE - 8, folder, name, err));
        memcpy(path + strlen(path), endings[i], strlen(endings[i]) + 1); /* the 8 bytes left out above */
        *found = file_exists(path) && !file_is_folder(path);
    }
    return GBT_OK;
}

/* The frame's mask, or NULL when it names none. */
static gbt_status find_mask(const scope *s, const char *folder, char **out, gbt_error *err)
{
    *out = NULL;
    const json_t *value = json_object_get(s->frame, "mask_path");
    if (value == NULL || json_is_null(value))
        return GBT_OK;
    if (!json_is_string(value))
        return scope_fail(s, err, "wanted a string", "mask_path");
    const char *name = json_string_value(value);
    char path[PATH_SIZE];
    GBT_TRY(
        raw_check_name(name, strlen(name), (raw_place){s->file->name, RAW_MARK_FRAME, s->frame_index}, err));
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    if (!file_exists(path) || file_is_folder(path))
        return base_fail(err, GBT_ERR_IO, "%s: frame %zu: mask is missing: %.200s", s->file->name,
                         s->frame_index, path);
    *out = raw_copy_text(path, strlen(path), err);
    return *out != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static gbt_status read_frame(const scope *s, const char *folder, raw_scene *out, gbt_error *err)
{
    const json_t *value = json_object_get(s->frame, "file_path");
    if (!json_is_string(value))
        return scope_fail(s, err, "wanted a string", "file_path");
    const char *name = plain_name(value);
    GBT_TRY(
        raw_check_name(name, strlen(name), (raw_place){s->file->name, RAW_MARK_FRAME, s->frame_index}, err));
    char path[PATH_SIZE];
    bool found;
    gbt_camera camera = {0};
    GBT_TRY(read_pose(s, &camera, err));
    GBT_TRY(find_photo(folder, name, path, &found, err));
    if (!found) {
        raw_count_missing(out, name);
        return GBT_OK;
    }
    GBT_TRY(read_camera(s, path, &camera, out, err));
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
        const scope s = {.file = file, .frame = json_array_get(frames, i), .top = root, .frame_index = i};
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
