/* eval/camera_file.c -- a camera file: one picture to take, in JSON. */
#include "eval/camera_file.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "trace/ray_file.h"

enum { SIZE_MAX_PIXELS = 65500, SAMPLES_MAX = 65536 };
#define PI 3.14159265358979323846

static const double value_max = 1e15; /* so that no sum or product of a few values leaves the range of float */

/* One object of the file; `prefix` is where it stands. */
typedef struct reader {
    const char *path, *prefix;
    const json_t *object;
    gbt_error *err;
} reader;

static gbt_status field_fail(const reader *r, const char *field, const char *what)
{
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: %s", r->path, r->prefix, field, what);
}

static bool has(const reader *r, const char *field)
{
    return json_object_get(r->object, field) != NULL;
}

/* `names` are separated and enclosed by spaces. */
static gbt_status check_names(const reader *r, const char *names)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)r->object, key, value)
    {
        char padded[64];
        const int length = snprintf(padded, sizeof padded, " %s ", key);
        if (length >= (int)sizeof padded || length < 3 || strchr(key, ' ') != NULL || strstr(names, padded) == NULL)
            return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%.60s: unknown field (wanted one of%.*s)", r->path, r->prefix, key, (int)strlen(names) - 1, names);
    }
    return GBT_OK;
}

/* Three numbers; when they are missing `out` keeps what it has, unless they are `needed`. */
static gbt_status take_vector(const reader *r, const char *field, bool needed, double out[3])
{
    const json_t *array = json_object_get(r->object, field);
    if (array == NULL)
        return needed ? field_fail(r, field, "missing (wanted 3 numbers)") : GBT_OK;
    if (!json_is_array(array) || json_array_size(array) != 3)
        return field_fail(r, field, "wanted 3 numbers");
    for (size_t i = 0; i < 3; i++) {
        const json_t *value = json_array_get(array, i);
        if (!json_is_number(value) || !(fabs(json_number_value(value)) <= value_max))
            return field_fail(r, field, "wanted 3 numbers, within 1e15");
        out[i] = json_number_value(value);
    }
    return GBT_OK;
}

/* A number in (low, high], or [low, high] when `closed`; a missing one keeps `out`. */
static gbt_status take_number(const reader *r, const char *field, double low, bool closed, double high, double *out)
{
    const json_t *value = json_object_get(r->object, field);
    if (value == NULL)
        return GBT_OK;
    const double number = json_number_value(value);
    if (!json_is_number(value) || !(closed ? number >= low : number > low) || !(number <= high))
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted a number in %c%g, %g]", r->path, r->prefix, field, closed ? '[' : '(', low, high);
    *out = number;
    return GBT_OK;
}

static gbt_status take_whole(const reader *r, const char *field, int low, int high, int *out)
{
    const json_t *value = json_object_get(r->object, field);
    if (value == NULL)
        return GBT_OK;
    const json_int_t number = json_integer_value(value);
    if (!json_is_integer(value) || number < low || number > high)
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted a whole number in [%d, %d]", r->path, r->prefix, field, low, high);
    *out = (int)number;
    return GBT_OK;
}

/* One of the texts of `choices`; a missing one is the first. */
static gbt_status take_choice(const reader *r, const char *field, const char *const *choices, int count, int *out)
{
    const json_t *value = json_object_get(r->object, field);
    char list[160] = "";
    *out = 0;
    for (int i = 0; i < count; i++) {
        if (json_is_string(value) && strcmp(json_string_value(value), choices[i]) == 0)
            *out = i;
        const size_t length = strlen(list);
        snprintf(list + length, sizeof list - length, "%s%s", i > 0 ? ", " : "", choices[i]);
    }
    if (value == NULL || (json_is_string(value) && strcmp(json_string_value(value), choices[*out]) == 0))
        return GBT_OK;
    return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: wanted one of %s", r->path, r->prefix, field, list);
}

static gbt_status needs(const reader *r, const char *field, const char *why)
{
    return has(r, field) ? GBT_OK : base_fail(r->err, GBT_ERR_FORMAT, "%s: %s%s: missing (%s)", r->path, r->prefix, field, why);
}

typedef enum file_model { FILE_PINHOLE, FILE_ORTHOGRAPHIC, FILE_EQUIRECTANGULAR, FILE_FISHEYE, FILE_MODEL_COUNT } file_model;

static gbt_status take_lens(const reader *r, gbt_camera *camera)
{
    static const char *const names[FILE_MODEL_COUNT] = {"pinhole", "orthographic", "equirectangular", "fisheye"};
    int model;
    double fov_deg = 0, view_width = 0;
    GBT_TRY(take_choice(r, "model", names, FILE_MODEL_COUNT, &model));
    GBT_TRY(needs(r, "width", "pixels"));
    GBT_TRY(needs(r, "height", "pixels"));
    GBT_TRY(take_whole(r, "width", 1, SIZE_MAX_PIXELS, &camera->width));
    GBT_TRY(take_whole(r, "height", 1, SIZE_MAX_PIXELS, &camera->height));
    const bool has_fov = model == FILE_PINHOLE || model == FILE_FISHEYE;
    if (has_fov)
        GBT_TRY(needs(r, "fov_x_deg", "degrees from the left edge of the picture to the right"));
    else if (has(r, "fov_x_deg"))
        return field_fail(r, "fov_x_deg", "this model has none (wanted it with pinhole or fisheye)");
    if (model == FILE_ORTHOGRAPHIC)
        GBT_TRY(needs(r, "view_width", "units of the data set from the left edge of the picture to the right"));
    else if (has(r, "view_width"))
        return field_fail(r, "view_width", "this model has none (wanted it with orthographic)");
    GBT_TRY(take_number(r, "fov_x_deg", 0, false, model == FILE_FISHEYE ? 360 : 179.9, &fov_deg));
    GBT_TRY(take_number(r, "view_width", 0, false, value_max, &view_width));
    const double half_width = 0.5 * camera->width, half_height = 0.5 * camera->height, half_fov = fov_deg * PI / 360;
    const double scale = model == FILE_PINHOLE ? half_width / tan(half_fov) : model == FILE_FISHEYE ? half_width / half_fov : camera->width / view_width;
    static const gbt_camera_model models[FILE_MODEL_COUNT] = {GBT_CAMERA_PINHOLE, GBT_CAMERA_ORTHOGRAPHIC, GBT_CAMERA_EQUIRECTANGULAR, GBT_CAMERA_FISHEYE};
    camera->model = models[model];
    if (model == FILE_EQUIRECTANGULAR)
        camera->params[0] = camera->width, camera->params[1] = camera->height;
    else
        camera->params[0] = camera->params[1] = scale, camera->params[2] = half_width, camera->params[3] = half_height;
    return GBT_OK;
}

/* origin, target and up as they stand in the file; those that are missing stay. */
typedef struct stand {
    double origin[3], target[3], up[3];
} stand;

static gbt_status take_pose(const reader *r, bool needed, const double origin[3], stand *at, gbt_camera *camera)
{
    GBT_TRY(take_vector(r, "origin", needed, at->origin));
    GBT_TRY(take_vector(r, "target", needed, at->target));
    GBT_TRY(take_vector(r, "up", needed, at->up));
    double local[3], target[3];
    for (int i = 0; i < 3; i++)
        local[i] = at->origin[i] - origin[i], target[i] = at->target[i] - origin[i];
    if (camera_look_at(local, target, at->up, camera))
        return GBT_OK;
    const bool same = memcmp(at->origin, at->target, sizeof at->origin) == 0;
    return same ? field_fail(r, "target", "is the origin (wanted another point)") : field_fail(r, "up", "is 0, or along the view");
}

static gbt_status take_shutter(const reader *r, const double origin[3], const stand *start, ray_shot *shot)
{
    static const char *const directions[] = {"rows", "columns"};
    int direction;
    GBT_TRY(take_choice(r, "shutter", directions, 2, &direction));
    const json_t *end = json_object_get(r->object, "end");
    shot->end = shot->camera;
    if (end == NULL)
        return has(r, "shutter") ? field_fail(r, "end", "missing (a shutter wants the pose at the end of its way)") : GBT_OK;
    if (!json_is_object(end))
        return field_fail(r, "end", "wanted an object with origin, target or up");
    const reader inner = {r->path, "end.", end, r->err};
    stand at = *start;
    GBT_TRY(check_names(&inner, " origin target up "));
    shot->shutter = direction == 0 ? RAY_SHUTTER_ROWS : RAY_SHUTTER_COLUMNS;
    return take_pose(&inner, false, origin, &at, &shot->end);
}

static gbt_status take_aperture(const reader *r, ray_shot *shot)
{
    static const char *const dependent[] = {"focus", "samples", "seed"};
    int seed = 0;
    for (int i = 0; i < 3 && !has(r, "aperture"); i++)
        if (has(r, dependent[i]))
            return field_fail(r, "aperture", "missing (there is a focus, samples or seed)");
    GBT_TRY(take_number(r, "aperture", 0, true, value_max, &shot->aperture_radius));
    if (shot->aperture_radius > 0)
        GBT_TRY(needs(r, "focus", "distance that is sharp, units of the data set"));
    GBT_TRY(take_number(r, "focus", 0, false, value_max, &shot->focus_distance));
    GBT_TRY(take_whole(r, "samples", 1, SAMPLES_MAX, &shot->samples));
    GBT_TRY(take_whole(r, "seed", 0, INT32_MAX, &seed));
    shot->seed = (uint64_t)seed;
    return GBT_OK;
}

/* The file of rays stands beside the camera file, unless its name is absolute. */
static gbt_status take_rays(const reader *r, const double origin[3], camera_file *out)
{
    char folder[4096], path[4096];
    const char *name = json_string_value(json_object_get(r->object, "rays")), *slash = strrchr(r->path, '/');
    if (name == NULL || name[0] == '\0')
        return field_fail(r, "rays", "wanted the name of an EXR file");
    GBT_TRY(check_names(r, " rays "));
    const int folder_length = slash == NULL || name[0] == '/' ? 0 : (int)(slash - r->path) + 1;
    snprintf(folder, sizeof folder, "%.*s", folder_length, r->path);
    if (snprintf(path, sizeof path, "%s%s", folder, name) >= (int)sizeof path)
        return field_fail(r, "rays", "name is too long");
    out->shot.given = &out->rays;
    return ray_image_read(path, origin, &out->rays, r->err);
}

static gbt_status take_all(const reader *r, const double origin[3], camera_file *out)
{
    if (!json_is_object(r->object))
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: wanted a JSON object", r->path);
    gbt_camera camera = {0};
    out->shot = ray_shot_of(&camera);
    if (has(r, "rays"))
        return take_rays(r, origin, out);
    GBT_TRY(check_names(r, " origin target up model width height fov_x_deg view_width aperture focus samples seed end shutter rays near_clip far_clip "));
    stand start = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    GBT_TRY(take_lens(r, &camera));
    GBT_TRY(take_pose(r, true, origin, &start, &camera));
    out->shot = ray_shot_of(&camera);
    GBT_TRY(take_aperture(r, &out->shot));
    GBT_TRY(take_shutter(r, origin, &start, &out->shot));
    gbt_error why = {0};
    if (ray_shot_check(&out->shot, &why) != GBT_OK)
        return base_fail(r->err, GBT_ERR_FORMAT, "%s: %s", r->path, why.text);
    return GBT_OK;
}

gbt_status camera_file_read(const char *path, const double origin[3], camera_file *out, gbt_error *err)
{
    unsigned char *bytes;
    size_t count;
    json_error_t where;
    memset(out, 0, sizeof *out);
    GBT_TRY(file_read(path, &bytes, &count, err));
    json_t *root = json_loadb((const char *)bytes, count, JSON_REJECT_DUPLICATES, &where);
    mem_free(bytes);
    if (root == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s:%d: not JSON: %s", path, where.line, where.text);
    const reader r = {path, "", root, err};
    const gbt_status status = take_all(&r, origin, out);
    json_decref(root);
    return status;
}

void camera_file_free(camera_file *file)
{
    ray_image_free(&file->rays);
    memset(file, 0, sizeof *file);
}
