/* SPDX-License-Identifier: Apache-2.0 */
/* bake/export_folder.c -- writes a 3DGS result folder in the form that tools for 3DGS read. */
#include "bake/export_folder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/log.h"
#include "base/memory.h"
#include "data/gaussian_file.h"
#include "data/json_out.h"
#include "data/ply.h"
#include "data/result_folder.h"

enum { PATH_SIZE = 4096 };

bool export_folder_is(const char *path)
{
    const size_t length = strlen(path);
    return length > 0 && path[length - 1] == '/';
}

/* ---- the settings of the run ---- */

/* A path for cfg_args. Tools evaluate its Namespace(...) as Python, so quotes, backslashes and control
   characters are replaced. */
static void put_path(const char *path, char *out, size_t size)
{
    char full[PATH_SIZE];
    const char *from = realpath(path, full) != NULL ? full : path;
    size_t used = 0;
    for (; *from != '\0' && used + 1 < size; from++)
        out[used++] = *from == '\'' || *from == '\\' || (unsigned char)*from < 0x20 ? '_' : *from;
    out[used] = '\0';
}

/* 3DGS's `resolution`: the factor by which photos are divided, or the width of the pictures; -1 (not
   specified) if widths differ. */
static int resolution_of(const loaded_run *r)
{
    if (result_resolution_divides(r->def.downscale))
        return (int)r->def.downscale;
    const int width = photos_camera(&r->photos, 0, 0).width;
    for (size_t i = 1; i < r->scene.view_count; i++)
        if (photos_camera(&r->photos, i, 0).width != width)
            return -1;
    return result_resolution_divides(width) ? -1 : width;
}

static gbt_status write_settings(const char *folder, const loaded_run *r, int sh_degree, gbt_error *err)
{
    char path[PATH_SIZE], source[PATH_SIZE], result[PATH_SIZE], text[3 * PATH_SIZE];
    float laid_on[3] = {0};
    const bool white = scene_background(&r->scene, laid_on) &&
                       laid_on[0] > 0; /* any other background is stored as Gaussians, or is black */
    put_path(r->scene.folder, source, sizeof source);
    put_path(folder, result, sizeof result);
    bool holds_out = false;
    for (size_t i = 0; i < r->scene.view_count; i++)
        holds_out = holds_out || r->scene.views[i].is_test;
    snprintf(text, sizeof text,
             "Namespace(sh_degree=%d, source_path='%s', model_path='%s', images='images', depths='', "
             "resolution=%d, white_background=%s, train_test_exp=False, data_device='cpu', eval=%s)",
             sh_degree, source, result, resolution_of(r), white ? "True" : "False",
             holds_out ? "True" : "False");
    GBT_TRY(file_join(path, sizeof path, folder, "cfg_args", err));
    return file_write_atomic(path, text, strlen(text), err);
}

/* Position and camera-to-world rotation of the pinhole camera that best approximates the lens. */
static json_t *camera_to_json(const loaded_run *r, size_t view, size_t id)
{
    const gbt_camera c = photos_camera(&r->photos, view, 0);
    char name[1024];
    snprintf(name, sizeof name, "%s", r->scene.views[view].name);
    char *dot = strrchr(name, '.');
    if (dot != NULL && dot != name && strchr(dot, '/') == NULL)
        *dot = '\0';
    double tan_half[2], at[3];
    gbt_camera_half_fov_tan(&c, tan_half);
    for (int k = 0; k < 3; k++)
        at[k] = c.center[k] + r->model.origin[k];
    const double *w = c.rotation;
    return json_pack("{s:i,s:o,s:i,s:i,s:[f,f,f],s:[[f,f,f],[f,f,f],[f,f,f]],s:f,s:f}", "id", (int)id,
                     "img_name", json_text(name), "width", c.width, "height", c.height, "position", at[0],
                     at[1], at[2], "rotation", w[0], w[3], w[6], w[1], w[4], w[7], w[2], w[5], w[8], "fy",
                     tan_half[1] > 0 ? c.height / (2 * tan_half[1]) : 0.0, "fx",
                     tan_half[0] > 0 ? c.width / (2 * tan_half[0]) : 0.0);
}

static gbt_status write_cameras(const char *folder, const loaded_run *r, gbt_error *err)
{
    char path[PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, folder, "cameras.json", err));
    json_t *list = json_array();
    for (int test = 1; test >= 0; test--)
        for (size_t i = 0; i < r->scene.view_count; i++)
            if (r->scene.views[i].is_test == (test == 1))
                json_array_append_new(list, camera_to_json(r, i, json_array_size(list)));
    const gbt_status status = json_save(list, path, err);
    json_decref(list);
    return status;
}

static gbt_status write_points(const char *folder, const loaded_run *r, gbt_error *err)
{
    char path[PATH_SIZE];
    const scene_points *p = &r->scene.points;
    GBT_TRY(file_join(path, sizeof path, folder, "input.ply", err));
    float *zeros = mem_calloc(p->count, sizeof *zeros, "normals", err);
    if (zeros == NULL)
        return GBT_ERR_NO_MEMORY;
    const ply_extra normals[] = {{"nx", zeros, 1}, {"ny", zeros, 1}, {"nz", zeros, 1}};
    ply_cloud cloud = {.vertex_count = p->count,
                       .position = p->position,
                       .color = p->color,
                       .extra_count = 3,
                       .extras = normals};
    memcpy(cloud.origin, r->model.origin, sizeof cloud.origin);
    const gbt_status status = ply_write(path, &cloud, err);
    mem_free(zeros);
    return status;
}

static gbt_status write_cloud(const char *folder, const loaded_run *r, const gaussian_cloud *cloud,
                              long long *bytes, gbt_error *err)
{
    char place[PATH_SIZE], path[PATH_SIZE], name[64];
    snprintf(name, sizeof name, "point_cloud/iteration_%llu", (unsigned long long)r->model.iterations);
    GBT_TRY(file_join(place, sizeof place, folder, name, err));
    GBT_TRY(file_make_folder(place, err));
    GBT_TRY(file_join(path, sizeof path, place, "point_cloud.ply", err));
    /* Without the mip comment: the 3DGS viewer expects the count in the third line. */
    gaussian_cloud plain = *cloud;
    plain.antialiased = false;
    GBT_TRY(gaussian_file_write(path, &plain, r->model.origin, err));
    struct stat info = {0};
    stat(path, &info);
    *bytes = (long long)info.st_size;
    return GBT_OK;
}

gbt_status export_folder_check(const char *folder, const loaded_run *r, gbt_error *err)
{
    char clouds[PATH_SIZE];
    unsigned long largest;
    GBT_TRY(file_join(clouds, sizeof clouds, folder, "point_cloud", err));
    if (file_largest_number(clouds, "iteration_", &largest) && largest > r->model.iterations)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "%s: holds iteration %lu, which readers take instead of %llu (wanted an empty folder)", folder,
            largest, (unsigned long long)r->model.iterations);
    return GBT_OK;
}

gbt_status export_folder_write(const char *folder, const loaded_run *r, const gaussian_cloud *cloud,
                               long long *bytes, gbt_error *err)
{
    GBT_TRY(write_cloud(folder, r, cloud, bytes, err));
    GBT_TRY(write_cameras(folder, r, err));
    GBT_TRY(write_points(folder, r, err));
    return write_settings(folder, r, cloud->sh_degree, err);
}

/* ---- pictures and scores ---- */

static gbt_status write_picture(const char *folder, const loaded_run *r, const char *kind, size_t index,
                                const image *picture, gbt_error *err)
{
    char place[PATH_SIZE], path[PATH_SIZE], name[96];
    snprintf(name, sizeof name, "test/ours_%llu/%s", (unsigned long long)r->model.iterations, kind);
    GBT_TRY(file_join(place, sizeof place, folder, name, err));
    GBT_TRY(file_make_folder(place, err));
    snprintf(name, sizeof name, "%05zu.png", index);
    GBT_TRY(file_join(path, sizeof path, place, name, err));
    return image_write(path, picture, err);
}

gbt_status export_folder_picture(const char *folder, const loaded_run *r, size_t index, const image *render,
                                 const image *photo, gbt_error *err)
{
    GBT_TRY(write_picture(folder, r, "renders", index, render, err));
    return write_picture(folder, r, "gt", index, photo, err);
}

/* One measure over the pictures; values that are not finite become null and do not count in the mean. */
typedef struct score_list {
    const char *name;
    json_t *values;
    double sum;
    size_t scored;
} score_list;

static void add_score(score_list *list, size_t index, double value)
{
    char picture[32];
    snprintf(picture, sizeof picture, "%05zu.png", index);
    json_object_set_new(list->values, picture, json_number(value));
    if (isfinite(value)) {
        list->sum += value;
        list->scored++;
    }
}

static gbt_status save_under(const char *folder, const char *name, const char *method, json_t *values,
                             gbt_error *err)
{
    char path[PATH_SIZE];
    GBT_TRY(file_join(path, sizeof path, folder, name, err));
    json_t *root = json_pack("{s:O}", method, values);
    const gbt_status status = json_save(root, path, err);
    json_decref(root);
    return status;
}

gbt_status export_folder_scores(const char *folder, const loaded_run *r, const image_scores *scores,
                                const lpips_scores *with_network, size_t count, gbt_error *err)
{
    if (r->def.exposure)
        log_warn("%s: results.json has scores of whole pictures, without the photos' colour matrices",
                 folder);
    char method[64];
    score_list lists[] = {{.name = "SSIM", .values = json_object()},
                          {.name = "PSNR", .values = json_object()},
                          {.name = "LPIPS", .values = json_object()}};
    json_t *means = json_object(), *values = json_object();
    for (size_t i = 0; i < count; i++) {
        add_score(&lists[0], i, scores[i].ssim);
        add_score(&lists[1], i, scores[i].psnr);
        if (with_network != NULL)
            add_score(&lists[2], i, with_network[i].lpips_01);
    }
    for (int i = 0; i < (with_network != NULL ? 3 : 2); i++) {
        json_object_set(values, lists[i].name, lists[i].values);
        json_object_set_new(means, lists[i].name, json_number(lists[i].sum / (double)lists[i].scored));
    }
    snprintf(method, sizeof method, "ours_%llu", (unsigned long long)r->model.iterations);
    gbt_status status = save_under(folder, "results.json", method, means, err);
    if (status == GBT_OK)
        status = save_under(folder, "per_view.json", method, values, err);
    for (int i = 0; i < 3; i++)
        json_decref(lists[i].values);
    json_decref(values);
    json_decref(means);
    return status;
}
