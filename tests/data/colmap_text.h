/* SPDX-License-Identifier: Apache-2.0 */
/* tests/data/colmap_text.h -- a binary COLMAP model to its text form, number by number: 17 digits, so that
   they read back bit for bit. */
#ifndef GBT_TEST_DATA_COLMAP_TEXT_H
#define GBT_TEST_DATA_COLMAP_TEXT_H

#include "data_support.h"

#include "gbtrace/camera.h"

typedef struct colmap_bytes {
    unsigned char *bytes;
    size_t used;
    FILE *text;
} colmap_bytes;

static inline void colmap_take(colmap_bytes *f, void *out, size_t size)
{
    memcpy(out, f->bytes + f->used, size);
    f->used += size;
}

static inline uint64_t colmap_copy_uint(colmap_bytes *f, size_t size)
{
    uint64_t value = 0;
    colmap_take(f, &value, size);
    fprintf(f->text, "%llu ", (unsigned long long)value);
    return value;
}

static inline void colmap_copy_doubles(colmap_bytes *f, int count)
{
    for (int i = 0; i < count; i++) {
        double value;
        colmap_take(f, &value, sizeof value);
        fprintf(f->text, "%.17g ", value);
    }
}

static inline void colmap_copy_camera(colmap_bytes *f)
{
    uint32_t model;
    colmap_copy_uint(f, 4);
    colmap_take(f, &model, sizeof model);
    fprintf(f->text, "%s ", gbt_camera_model_name((gbt_camera_model)model));
    colmap_copy_uint(f, 8);
    colmap_copy_uint(f, 8);
    colmap_copy_doubles(f, gbt_camera_param_count((gbt_camera_model)model));
}

static inline void colmap_copy_image(colmap_bytes *f)
{
    uint64_t count;
    colmap_copy_uint(f, 4);
    colmap_copy_doubles(f, 7);
    colmap_copy_uint(f, 4);
    const char *name = (const char *)f->bytes + f->used;
    fprintf(f->text, "%s\n", name);
    f->used += strlen(name) + 1;
    colmap_take(f, &count, sizeof count);
    for (uint64_t i = 0; i < count; i++) {
        int64_t point;
        colmap_copy_doubles(f, 2);
        colmap_take(f, &point, sizeof point);
        fprintf(f->text, "%lld ", (long long)point);
    }
}

static inline void colmap_copy_point(colmap_bytes *f)
{
    uint64_t count;
    colmap_copy_uint(f, 8);
    colmap_copy_doubles(f, 3);
    for (int k = 0; k < 3; k++)
        colmap_copy_uint(f, 1);
    colmap_copy_doubles(f, 1);
    colmap_take(f, &count, sizeof count);
    for (uint64_t i = 0; i < 2 * count; i++)
        colmap_copy_uint(f, 4);
}

/** cameras.txt, images.txt and points3D.txt take the places of the .bin files in the folder. */
static inline void colmap_to_text(const char *folder)
{
    static const struct {
        const char *name;
        void (*copy)(colmap_bytes *f);
    } parts[] = {
        {"cameras", colmap_copy_camera}, {"images", colmap_copy_image}, {"points3D", colmap_copy_point}};
    for (int i = 0; i < 3; i++) {
        char path[16384];
        colmap_bytes f = {0};
        size_t size;
        uint64_t count;
        snprintf(path, sizeof path, "%s/%s.bin", folder, parts[i].name);
        assert_ok(file_read(path, &f.bytes, &size, &assert_ok_err_));
        unlink(path);
        snprintf(path, sizeof path, "%s/%s.txt", folder, parts[i].name);
        f.text = fopen(path, "w");
        assert_non_null(f.text);
        fprintf(f.text, "# one in a line\n");
        colmap_take(&f, &count, sizeof count);
        for (uint64_t k = 0; k < count; k++) {
            parts[i].copy(&f);
            fputc('\n', f.text);
        }
        assert_int_equal(f.used, size);
        fclose(f.text);
        mem_free(f.bytes);
    }
}

#endif
