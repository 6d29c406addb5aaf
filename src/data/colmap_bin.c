/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_bin.c -- COLMAP's cameras.bin, images.bin and points3D.bin from bytes. */
#include "data/colmap_bin.h"

enum {
    CAMERA_BYTES = 24,       /* id, model, width, height */
    IMAGE_BYTES = 64,        /* id, quaternion, translation, camera id */
    IMAGE_LEAST_BYTES = 74,  /* with a name of one letter and its terminating zero, and the number of
                                observations */
    OBSERVATION_BYTES = 24,  /* x, y, point id */
    POINT_BYTES = 51,        /* id, position, colour, error, track length */
    TRACK_ENTRY_BYTES = 8,   /* image id, observation index */
    CAMERA_LEAST_BYTES = 40, /* the shortest models have two parameters */
};

static raw_place place_of(const cursor *c) { return (raw_place){c->file->name, '@', c->at}; }

/* Read the count at the start of a file, and check it against the bytes that follow before anything is
   allocated. */
static gbt_status take_count(cursor *c, size_t record_bytes, const char *what, uint64_t *count,
                             gbt_error *err)
{
    if (c->file->size == 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s@0: file is empty (wanted a count of %s)", c->file->name,
                         what);
    GBT_TRY(cursor_need(c, 8, "the count", err));
    const raw_place place = place_of(c);
    *count = cursor_u64(c);
    if (cursor_count_fits(c, *count, record_bytes))
        return GBT_OK;
    bool is_text = true;
    for (size_t i = 0; i < 8; i++) {
        const unsigned char byte = c->file->bytes[i];
        is_text = is_text && (byte == '\n' || byte == '\r' || byte == '\t' || (byte >= 0x20 && byte < 0x7f));
    }
    if (is_text)
        return raw_fail(err, place, "file looks like text (wanted COLMAP's binary form)");
    if (cursor_count_fits(c, __builtin_bswap64(*count), record_bytes))
        return raw_fail(err, place, "count of %s is in big-endian order (wanted little-endian)", what);
    return raw_fail(err, place, "%llu %s cannot be in the %zu bytes that follow", (unsigned long long)*count,
                    what, cursor_left(c));
}

static gbt_status read_cameras(const source_file *file, colmap_cameras *cameras, raw_scene *out,
                               gbt_error *err)
{
    cursor c = {.file = file};
    uint64_t count;
    GBT_TRY(take_count(&c, CAMERA_LEAST_BYTES, "cameras", &count, err));
    for (uint64_t i = 0; i < count; i++) {
        const raw_place place = place_of(&c);
        GBT_TRY(cursor_need(&c, CAMERA_BYTES, "a camera", err));
        const uint32_t id = cursor_u32(&c), model = cursor_u32(&c);
        const uint64_t width = cursor_u64(&c), height = cursor_u64(&c);
        if (model >= GBT_CAMERA_MODEL_COUNT)
            return raw_fail(err, place, "unknown camera model id %d (wanted 0..%d)", (int)model,
                            GBT_CAMERA_MODEL_COUNT - 1);
        if (width < 1 || width > RAW_IMAGE_LIMIT || height < 1 || height > RAW_IMAGE_LIMIT)
            return raw_fail(err, place,
                            "image width or height is out of range (wanted 1..%d, got %llu x %llu)",
                            RAW_IMAGE_LIMIT, (unsigned long long)width, (unsigned long long)height);
        gbt_camera camera = {.model = (gbt_camera_model)model, .width = (int)width, .height = (int)height};
        const int param_count = gbt_camera_param_count(camera.model);
        GBT_TRY(cursor_need(&c, (size_t)param_count * 8, "the camera's parameters", err));
        for (int k = 0; k < param_count; k++)
            camera.params[k] = cursor_f64(&c);
        GBT_TRY(colmap_cameras_add(cameras, id, &camera, place, err));
    }
    out->trailing_bytes += cursor_left(&c);
    return colmap_cameras_sort(cameras, file->name, err);
}

static gbt_status read_images(const source_file *file, const colmap_cameras *cameras, raw_scene *out,
                              gbt_error *err)
{
    cursor c = {.file = file};
    uint64_t count;
    GBT_TRY(take_count(&c, IMAGE_LEAST_BYTES, "images", &count, err));
    for (uint64_t i = 0; i < count; i++) {
        const raw_place place = place_of(&c);
        GBT_TRY(cursor_need(&c, IMAGE_BYTES, "an image", err));
        const uint32_t id = cursor_u32(&c);
        double quaternion[4], translation[3];
        for (int k = 0; k < 4; k++)
            quaternion[k] = cursor_f64(&c);
        for (int k = 0; k < 3; k++)
            translation[k] = cursor_f64(&c);
        const uint32_t camera_id = cursor_u32(&c);
        const char *name = (const char *)file->bytes + c.at;
        const char *zero = cursor_left(&c) > 0 ? memchr(name, 0, cursor_left(&c)) : NULL;
        if (zero == NULL)
            return raw_fail(err, place_of(&c), "image name does not end before the file does");
        const size_t name_length = (size_t)(zero - name);
        cursor_skip(&c, name_length + 1);
        GBT_TRY(colmap_add_image(out, cameras, id, quaternion, translation, camera_id, name, name_length,
                                 place, err));
        GBT_TRY(cursor_need(&c, 8, "the count of observations", err));
        const raw_place observations = place_of(&c);
        const uint64_t observation_count = cursor_u64(&c);
        if (!cursor_count_fits(&c, observation_count, OBSERVATION_BYTES))
            return raw_fail(err, observations, "%llu observations cannot be in the %zu bytes that follow",
                            (unsigned long long)observation_count, cursor_left(&c));
        cursor_skip(&c, observation_count * OBSERVATION_BYTES); /* training needs no 2D observations */
    }
    out->trailing_bytes += cursor_left(&c);
    return GBT_OK;
}

static gbt_status read_points(const source_file *file, const colmap_image_id *images, raw_scene *out,
                              gbt_error *err)
{
    cursor c = {.file = file};
    uint64_t count;
    GBT_TRY(take_count(&c, POINT_BYTES, "points", &count, err));
    GBT_TRY(raw_reserve_points(out, (size_t)count, err));
    out->has_color = true;
    for (uint64_t i = 0; i < count; i++) {
        GBT_TRY(cursor_need(&c, POINT_BYTES, "a point", err));
        cursor_skip(&c, 8); /* the id: nothing refers to it once the observations are skipped */
        double position[3];
        float color[3];
        for (int k = 0; k < 3; k++)
            position[k] = cursor_f64(&c);
        for (int k = 0; k < 3; k++)
            color[k] = (float)cursor_uint(&c, 1) / 255;
        cursor_skip(&c, 8); /* the reprojection error is not used, so a bad one is harmless */
        const raw_place track = place_of(&c);
        const uint64_t track_count = cursor_u64(&c);
        if (!cursor_count_fits(&c, track_count, TRACK_ENTRY_BYTES))
            return raw_fail(err, track, "a track of %llu entries cannot be in the %zu bytes that follow",
                            (unsigned long long)track_count, cursor_left(&c));
        for (uint64_t k = 0; k < track_count; k++) {
            GBT_TRY(colmap_add_sighting(out, images, cursor_u32(&c), position, err));
            cursor_skip(&c, 4);
        }
        raw_add_point(out, position, color);
    }
    out->trailing_bytes += cursor_left(&c);
    return GBT_OK;
}

gbt_status colmap_bin_read(const colmap_files *files, raw_scene *out, gbt_error *err)
{
    colmap_cameras cameras = {0};
    colmap_image_id *images = NULL;
    gbt_status status = read_cameras(&files->cameras, &cameras, out, err);
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
