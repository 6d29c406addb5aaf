/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_txt.c -- COLMAP's cameras.txt, images.txt and points3D.txt from bytes. */
#include "data/colmap_txt.h"

#include "base/camera_model.h"
#include "base/paged.h"
#include "data/number.h"

enum { CHECK_LINES = 1 << 14 };

/* Lines of a file, one at a time; `at` walks inside the current line. */
typedef struct text_lines {
    const source_file *file;
    size_t next, number;
    const char *at, *end;
} text_lines;

static text_lines lines_of(const source_file *file)
{
    return (text_lines){.file = file, .next = file_mark_bytes(file->bytes, file->size)};
}

static raw_place place_of(const text_lines *lines)
{
    return (raw_place){lines->file->name, ':', lines->number};
}

static bool next_line(text_lines *lines)
{
    if (lines->next >= lines->file->size)
        return false;
    const char *start = (const char *)lines->file->bytes + lines->next;
    const size_t left = lines->file->size - lines->next;
    const char *newline = memchr(start, '\n', left);
    lines->at = start;
    lines->end = newline != NULL ? newline : start + left;
    lines->next += (size_t)(lines->end - start) + 1;
    if (lines->number++ % CHECK_LINES == 0)
        paged_check();
    return true;
}

/* The next line that is neither blank nor a comment. */
static bool next_record(text_lines *lines)
{
    while (next_line(lines)) {
        const char *at = lines->at, *token;
        size_t length;
        if (number_next_token(&at, lines->end, &token, &length) && token[0] != '#')
            return true;
    }
    return false;
}

static gbt_status bad_number(const text_lines *lines, number_result result, const char *what,
                             const char *token, size_t length, gbt_error *err)
{
    const int shown = length < 60 ? (int)length : 60;
    return raw_fail(err, place_of(lines),
                    result == NUMBER_RANGE ? "%s is out of range: %.*s" : "%s is not a number: %.*s", what,
                    shown, token);
}

static gbt_status take_token(text_lines *lines, const char *what, const char **token, size_t *length,
                             gbt_error *err)
{
    if (number_next_token(&lines->at, lines->end, token, length))
        return GBT_OK;
    return raw_fail(err, place_of(lines), "line ends before %s", what);
}

static gbt_status take_double(text_lines *lines, const char *what, double *out, gbt_error *err)
{
    const char *token;
    size_t length;
    GBT_TRY(take_token(lines, what, &token, &length, err));
    const number_result result = number_parse_double(token, length, out);
    return result == NUMBER_OK ? GBT_OK : bad_number(lines, result, what, token, length, err);
}

static gbt_status take_uint(text_lines *lines, const char *what, uint64_t limit, uint64_t *out,
                            gbt_error *err)
{
    const char *token;
    size_t length;
    GBT_TRY(take_token(lines, what, &token, &length, err));
    number_result result = number_parse_u64(token, length, out);
    if (result == NUMBER_OK && *out > limit)
        result = NUMBER_RANGE;
    return result == NUMBER_OK ? GBT_OK : bad_number(lines, result, what, token, length, err);
}

static gbt_status check_camera_ends(text_lines *lines, gbt_error *err)
{
    const char *token;
    size_t length;
    if (!number_next_token(&lines->at, lines->end, &token, &length))
        return GBT_OK;
    return raw_fail(err, place_of(lines), "camera has too many fields, from %.*s",
                    length < 60 ? (int)length : 60, token);
}

static gbt_status take_model(text_lines *lines, gbt_camera_model *model, gbt_error *err)
{
    const char *token;
    size_t length;
    GBT_TRY(take_token(lines, "the camera model", &token, &length, err));
    if (camera_model_find(token, length, model) && (int)*model < GBT_CAMERA_MODEL_COUNT)
        return GBT_OK;
    return raw_fail(err, place_of(lines), "unknown camera model: %.*s", length < 60 ? (int)length : 60,
                    token);
}

static gbt_status read_cameras(const source_file *file, colmap_cameras *cameras, gbt_error *err)
{
    text_lines lines = lines_of(file);
    while (next_record(&lines)) {
        uint64_t id, width, height;
        gbt_camera camera = {0};
        GBT_TRY(take_uint(&lines, "the camera id", UINT32_MAX, &id, err));
        GBT_TRY(take_model(&lines, &camera.model, err));
        GBT_TRY(take_uint(&lines, "the image width", INT32_MAX, &width, err));
        GBT_TRY(take_uint(&lines, "the image height", INT32_MAX, &height, err));
        camera.width = (int)width;
        camera.height = (int)height;
        for (int k = 0; k < gbt_camera_param_count(camera.model); k++)
            GBT_TRY(take_double(&lines, "a camera parameter", &camera.params[k], err));
        GBT_TRY(check_camera_ends(&lines, err));
        GBT_TRY(colmap_cameras_add(cameras, (uint32_t)id, &camera, place_of(&lines), err));
    }
    return colmap_cameras_sort(cameras, file->name, err);
}

/* The second line of an image: (X, Y, POINT3D_ID) triples, possibly none. They are not kept, but checked,
   because a missing or extra line shows up here. */
static gbt_status check_observations(text_lines *lines, gbt_error *err)
{
    const char *token;
    size_t length, count = 0;
    for (; number_next_token(&lines->at, lines->end, &token, &length); count++) {
        double ignored;
        const number_result result = number_parse_double(token, length, &ignored);
        if (result != NUMBER_OK)
            return bad_number(lines, result, "an observation", token, length, err);
    }
    if (count % 3 != 0)
        return raw_fail(err, place_of(lines),
                        "observations are not triples (wanted a multiple of 3 fields, got %zu)", count);
    return GBT_OK;
}

static gbt_status read_images(const source_file *file, const colmap_cameras *cameras, raw_scene *out,
                              gbt_error *err)
{
    text_lines lines = lines_of(file);
    while (next_record(&lines)) {
        uint64_t id, camera_id;
        double quaternion[4], translation[3];
        GBT_TRY(take_uint(&lines, "the image id", UINT32_MAX, &id, err));
        for (int k = 0; k < 4; k++)
            GBT_TRY(take_double(&lines, "the quaternion", &quaternion[k], err));
        for (int k = 0; k < 3; k++)
            GBT_TRY(take_double(&lines, "the translation", &translation[k], err));
        GBT_TRY(take_uint(&lines, "the camera id", UINT32_MAX, &camera_id, err));
        /* The name is the rest of the line: it may hold spaces. */
        const char *name, *end = lines.end;
        size_t first_length;
        GBT_TRY(take_token(&lines, "the image name", &name, &first_length, err));
        while (end > name && (end[-1] == ' ' || end[-1] == '\t' || end[-1] == '\r'))
            end--;
        GBT_TRY(colmap_add_image(out, cameras, (uint32_t)id, quaternion, translation, (uint32_t)camera_id,
                                 name, (size_t)(end - name), place_of(&lines), err));
        if (next_line(&lines))
            GBT_TRY(check_observations(&lines, err));
    }
    return GBT_OK;
}

static gbt_status read_point(text_lines *lines, const colmap_image_id *images, raw_scene *out, gbt_error *err)
{
    uint64_t ignored;
    double position[3], error;
    float color[3];
    GBT_TRY(take_uint(lines, "the point id", UINT64_MAX, &ignored, err));
    for (int k = 0; k < 3; k++)
        GBT_TRY(take_double(lines, "the position", &position[k], err));
    for (int k = 0; k < 3; k++) {
        uint64_t level;
        GBT_TRY(take_uint(lines, "the colour", 255, &level, err));
        color[k] = (float)level / 255;
    }
    GBT_TRY(take_double(lines, "the error", &error, err));
    for (const char *token;;) {
        size_t length;
        const char *ahead = lines->at;
        if (!number_next_token(&ahead, lines->end, &token, &length))
            break;
        uint64_t image_id;
        GBT_TRY(take_uint(lines, "a track's image id", UINT32_MAX, &image_id, err));
        GBT_TRY(take_uint(lines, "a track's observation", UINT32_MAX, &ignored, err));
        GBT_TRY(colmap_add_sighting(out, images, (uint32_t)image_id, position, err));
    }
    raw_add_point(out, position, color);
    return GBT_OK;
}

static gbt_status read_points(const source_file *file, const colmap_image_id *images, raw_scene *out,
                              gbt_error *err)
{
    size_t count = 0;
    for (text_lines lines = lines_of(file); next_record(&lines);)
        count++;
    GBT_TRY(raw_reserve_points(out, count, err));
    out->has_color = true;
    for (text_lines lines = lines_of(file); next_record(&lines);)
        GBT_TRY(read_point(&lines, images, out, err));
    return GBT_OK;
}

gbt_status colmap_txt_read(const colmap_files *files, raw_scene *out, gbt_error *err)
{
    colmap_cameras cameras = {0};
    colmap_image_id *images = NULL;
    gbt_status status = read_cameras(&files->cameras, &cameras, err);
    if (status == GBT_OK)
        status = read_images(&files->images, &cameras, out, err);
    if (status == GBT_OK)
        status = colmap_images_sorted(out, files->images.name, &images, err);
    if (status == GBT_OK)
        status = read_points(&files->points, images, out, err);
    mem_free(images);
    colmap_cameras_free(&cameras);
    return status;
}
