/* SPDX-License-Identifier: Apache-2.0 */
/* data/colmap_write.c -- writes binary COLMAP models. */
#include "data/colmap_write.h"

#include "base/file.h"
#include "base/vec.h"
#include "data/bytes.h"
#include "data/raw.h"

typedef struct model {
    const colmap_image *images;
    size_t image_count;
    const colmap_point *points;
    size_t point_count;
    uint32_t *camera_ids; /* [image_count], from 1; owned */
} model;

static bool same_intrinsics(const gbt_camera *a, const gbt_camera *b)
{
    if (a->model != b->model || a->width != b->width || a->height != b->height)
        return false;
    for (int k = 0; k < gbt_camera_param_count(a->model); k++)
        if (a->params[k] != b->params[k])
            return false;
    return true;
}

static gbt_status check_image(const model *m, size_t i, gbt_error *err)
{
    const colmap_image *im = &m->images[i];
    gbt_error why = {0};
    const raw_place place = {"COLMAP image", '@', i};
    if (gbt_camera_param_count(im->camera.model) == 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "COLMAP image %zu: unknown camera model %d", i,
                         (int)im->camera.model);
    if (raw_check_name("image name", im->name, strlen(im->name), place, &why) != GBT_OK ||
        raw_check_camera(&im->camera, place, &why) != GBT_OK)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s", why.text);
    for (size_t k = 0; k < im->observation_count; k++)
        if (im->observations[k].point != COLMAP_NO_POINT && im->observations[k].point >= m->point_count)
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "COLMAP image %zu: observation %zu has point %llu (wanted fewer than %zu)", i, k,
                             (unsigned long long)im->observations[k].point, m->point_count);
    return GBT_OK;
}

/* Check all indices, and give each image its camera id. */
static gbt_status prepare(model *m, gbt_error *err)
{
    if (m->image_count >= UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "COLMAP model: too many images (%zu)", m->image_count);
    m->camera_ids = mem_alloc(m->image_count, sizeof *m->camera_ids, "camera ids", err);
    if (m->camera_ids == NULL)
        return GBT_ERR_NO_MEMORY;
    uint32_t next_id = 1;
    for (size_t i = 0; i < m->image_count; i++) {
        GBT_TRY(check_image(m, i, err));
        size_t twin = 0;
        while (twin < i && !same_intrinsics(&m->images[twin].camera, &m->images[i].camera))
            twin++;
        m->camera_ids[i] = twin < i ? m->camera_ids[twin] : next_id++;
    }
    for (size_t i = 0; i < m->point_count; i++)
        for (size_t k = 0; k < m->points[i].track_count; k++) {
            const uint32_t *entry = m->points[i].track + 2 * k;
            if (entry[0] >= m->image_count || entry[1] >= m->images[entry[0]].observation_count)
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "COLMAP point %zu: track entry %zu is image %u, observation %u: not there",
                                 i, k, entry[0], entry[1]);
        }
    return GBT_OK;
}

/* Whether image `i` is the first with its camera. Camera ids are assigned in image order, so a new camera
   always has a larger id than all before; `seen` is the largest so far. */
static bool is_first_use(const model *m, size_t i, uint32_t *seen)
{
    const bool first = m->camera_ids[i] > *seen;
    if (first)
        *seen = m->camera_ids[i];
    return first;
}

static size_t camera_count(const model *m)
{
    uint32_t seen = 0;
    for (size_t i = 0; i < m->image_count; i++)
        is_first_use(m, i, &seen);
    return seen;
}

/* COLMAP's pose: unit quaternion w x y z with w >= 0, and translation -R c. */
static void pose_of(const gbt_camera *camera, double q[4], double t[3])
{
    const double *m = camera->rotation;
    dquat_of_matrix(m, q);
    if (q[0] < 0)
        for (int i = 0; i < 4; i++)
            q[i] = -q[i];
    dmat_apply(m, camera->center, t);
    for (int i = 0; i < 3; i++)
        t[i] = 0 - t[i];
}

static void put_cameras(sink *s, const model *m)
{
    uint32_t seen = 0;
    sink_put_uint(s, camera_count(m), 8);
    for (size_t i = 0; i < m->image_count; i++) {
        if (!is_first_use(m, i, &seen))
            continue;
        const gbt_camera *camera = &m->images[i].camera;
        sink_put_uint(s, m->camera_ids[i], 4);
        sink_put_uint(s, (uint64_t)camera->model, 4);
        sink_put_uint(s, (uint64_t)camera->width, 8);
        sink_put_uint(s, (uint64_t)camera->height, 8);
        for (int k = 0; k < gbt_camera_param_count(camera->model); k++)
            sink_put_f64(s, camera->params[k]);
    }
}

static void put_images(sink *s, const model *m)
{
    sink_put_uint(s, m->image_count, 8);
    for (size_t i = 0; i < m->image_count; i++) {
        const colmap_image *im = &m->images[i];
        double q[4], t[3];
        pose_of(&im->camera, q, t);
        sink_put_uint(s, i + 1, 4);
        for (int k = 0; k < 4; k++)
            sink_put_f64(s, q[k]);
        for (int k = 0; k < 3; k++)
            sink_put_f64(s, t[k]);
        sink_put_uint(s, m->camera_ids[i], 4);
        sink_put(s, im->name, strlen(im->name) + 1);
        sink_put_uint(s, im->observation_count, 8);
        for (size_t k = 0; k < im->observation_count; k++) {
            const colmap_observation *o = &im->observations[k];
            sink_put_f64(s, o->x);
            sink_put_f64(s, o->y);
            sink_put_uint(s, o->point == COLMAP_NO_POINT ? UINT64_MAX : o->point + 1, 8);
        }
    }
}

static void put_points(sink *s, const model *m)
{
    sink_put_uint(s, m->point_count, 8);
    for (size_t i = 0; i < m->point_count; i++) {
        const colmap_point *p = &m->points[i];
        sink_put_uint(s, i + 1, 8);
        for (int k = 0; k < 3; k++)
            sink_put_f64(s, p->position[k]);
        sink_put(s, p->color, 3);
        sink_put_f64(s, p->error);
        sink_put_uint(s, p->track_count, 8);
        for (size_t k = 0; k < p->track_count; k++) {
            sink_put_uint(s, (uint64_t)p->track[2 * k] + 1, 4);
            sink_put_uint(s, p->track[2 * k + 1], 4);
        }
    }
}

gbt_status colmap_write(const char *folder, const colmap_image *images, size_t image_count,
                        const colmap_point *points, size_t point_count, gbt_error *err)
{
    static const struct {
        const char *name;
        void (*put)(sink *s, const model *m);
    } files[] = {{"cameras.bin", put_cameras}, {"images.bin", put_images}, {"points3D.bin", put_points}};
    model m = {.images = images, .image_count = image_count, .points = points, .point_count = point_count};
    gbt_status status = prepare(&m, err);
    if (status == GBT_OK)
        status = file_make_folder(folder, err);
    for (size_t i = 0; i < sizeof files / sizeof files[0] && status == GBT_OK; i++) {
        char path[4096];
        sink s = {.err = err};
        files[i].put(&s, &m);
        status = s.status;
        if (status == GBT_OK)
            status = file_join(path, sizeof path, folder, files[i].name, err);
        if (status == GBT_OK)
            status = file_write_atomic(path, s.bytes, s.size, err);
        sink_free(&s);
    }
    mem_free(m.camera_ids);
    return status;
}
