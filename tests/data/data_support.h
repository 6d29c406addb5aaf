/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/data_support.h -- pictures, exact-size copies, and mutations of good files. */
#ifndef GBT_TEST_DATA_SUPPORT_H
#define GBT_TEST_DATA_SUPPORT_H

#include "folder.h"

#include "base/image.h"
#include "data/bytes.h"
#include "data/gaussian_cloud.h"
#include "data/raw.h"

/** A picture whose pixel (x, y) is (x, y, 0) / 255. */
static inline void write_picture(const char *path, int width, int height)
{
    make_folder_of(path);
    image im = {0};
    assert_ok(image_alloc(&im, width, height, 3, &assert_ok_err_));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float *pixel = im.pixels + 3 * (y * width + x);
            pixel[0] = (float)x / 255;
            pixel[1] = (float)y / 255;
            pixel[2] = 0;
        }
    assert_ok(image_write(path, &im, &assert_ok_err_));
    image_free(&im);
}

/** A malloc'ed copy of exactly `size` bytes, so that the sanitizer sees a read of one byte more. */
static inline unsigned char *exact_copy(const void *bytes, size_t size)
{
    unsigned char *copy = calloc(size > 0 ? size : 1, 1);
    if (size > 0)
        memcpy(copy, bytes, size);
    return copy;
}

/** What must hold for whatever a reader accepted. */
static inline void check_raw(const raw_scene *raw)
{
    for (size_t i = 0; i < raw->view_count; i++) {
        const gbt_camera *camera = &raw->views[i].camera;
        assert_non_null(raw->views[i].name);
        assert_true(raw->views[i].name[0] != '\0' && raw->views[i].name[0] != '/');
        assert_true(camera->width >= 1 && camera->height >= 1 && camera->params[0] > 0);
        for (int k = 0; k < 3; k++)
            assert_true(isfinite(camera->center[k]));
        for (int k = 0; k < 3; k++) {
            const double *row = camera->rotation + 3 * k;
            const double length = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
            assert_true(fabs(length - 1) < 1e-9);
        }
    }
    for (size_t i = 0; i < 3 * raw->point_count; i++) {
        assert_true(isfinite(raw->position[i]));
        assert_true(raw->color[i] >= 0 && raw->color[i] <= 1);
    }
}

/** What must hold for Gaussians that a reader accepted. */
static inline void check_cloud(const gaussian_cloud *cloud)
{
    assert_true(cloud->count > 0 && cloud->sh_degree >= 0 && cloud->sh_degree <= 3);
    for (size_t i = 0; i < cloud->count; i++) {
        const float *q = cloud->quat + 4 * i;
        assert_true(fabsf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1) < 1e-5f);
        assert_true(cloud->opacity[i] >= 0 && cloud->opacity[i] <= 1);
        for (size_t k = 0; k < 3; k++) {
            assert_true(isfinite(cloud->mean[3 * i + k]));
            assert_true(fabsf(cloud->scale_log[3 * i + k]) <= 30);
            assert_true(cloud->scale_log[3 * i + k] >= cloud->scale_log[3 * i + (k + 1) % 3] - 9.211f);
        }
        for (size_t k = 0; k < 48; k++)
            assert_true(isfinite(cloud->sh[48 * i + k]));
    }
}

/** A failure must say why in one line; a success must say nothing. */
static inline void check_message(gbt_status status, const gbt_error *err)
{
    assert_int_equal(err->status, status);
    assert_true((status != GBT_OK) == (err->text[0] != '\0'));
    assert_null(strchr(err->text, '\n'));
}

/** A reader of Gaussians, and how many variants it took: the context of try_gaussians(). */
typedef struct gaussian_attempts {
    gbt_status (*read)(const source_file *file, gaussian_cloud *out, gbt_error *err);
    size_t accepted;
} gaussian_attempts;

/** A try_bytes: what is taken is sound, what is refused says why. */
static inline void try_gaussians(const unsigned char *bytes, size_t size, void *context)
{
    gaussian_attempts *attempts = context;
    const source_file file = {"variant", bytes, size};
    gaussian_cloud cloud;
    gbt_error err = {0};
    const gbt_status status = attempts->read(&file, &cloud, &err);
    check_message(status, &err);
    if (status == GBT_OK) {
        attempts->accepted++;
        check_cloud(&cloud);
    }
    gaussian_cloud_free(&cloud);
}

/** Feed one variant of a seed to a reader; `bytes` has exactly `size` bytes. */
typedef void try_bytes(const unsigned char *bytes, size_t size, void *context);

/** Truncate at every offset, flip every byte in three ways, put extreme 4- and 8-byte values at every
    offset. */
static inline void mutate_all(const unsigned char *seed, size_t size, try_bytes *try_one, void *context)
{
    static const uint64_t extremes[] = {0,
                                        1,
                                        UINT64_MAX,
                                        INT32_MAX,
                                        (uint64_t)INT32_MAX + 1,
                                        UINT64_C(1) << 63,
                                        UINT64_C(1) << 61,
                                        UINT64_C(0x7FF8000000000000),
                                        UINT64_C(0x7FF0000000000000),
                                        UINT64_C(0x7FC00000),
                                        UINT64_C(0x7F800000)};
    for (size_t length = 0; length < size; length++) {
        unsigned char *copy = exact_copy(seed, length);
        try_one(copy, length, context);
        free(copy);
    }
    for (size_t at = 0; at < size; at++) {
        static const unsigned char flips[] = {0xff, 0x80, 0x01};
        for (size_t k = 0; k < sizeof flips; k++) {
            unsigned char *copy = exact_copy(seed, size);
            copy[at] ^= flips[k];
            try_one(copy, size, context);
            free(copy);
        }
        for (size_t width = 4; width <= 8; width += 4)
            for (size_t k = 0; k < sizeof extremes / sizeof extremes[0] && at + width <= size; k++) {
                unsigned char *copy = exact_copy(seed, size);
                memcpy(copy + at, &extremes[k], width);
                try_one(copy, size, context);
                free(copy);
            }
    }
}

#endif
