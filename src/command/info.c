/* SPDX-License-Identifier: Apache-2.0 */
/* command/info.c -- describe the contents of a data set or a model, for a person or as JSON. */
#include "gbtrace/info.h"

#include <stdlib.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/plain_numbers.h"
#include "cells/draw.h"
#include "command/expect.h"
#include "data/gaussian_file.h"
#include "data/json_out.h"
#include "data/photo_check.h"
#include "data/scene.h"
#include "io/model_file.h"
#include "train/def.h"
#include "train/photos.h"

/* ---- data sets ---- */

/**
 * The box without the outermost 5 % of the points on each side of each axis, in world coordinates: outliers
 * should not determine the size of a scene.
 */
static gbt_status find_box(const float *position, size_t count, const double origin[3], double low[3],
                           double high[3], gbt_error *err)
{
    float *axis = mem_alloc(count, sizeof *axis, "points", err);
    if (axis == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t k = 0; k < 3 && count > 0; k++) {
        for (size_t i = 0; i < count; i++)
            axis[i] = position[3 * i + k];
        qsort(axis, count, sizeof *axis, compare_floats);
        low[k] = (double)axis[count / 20] + origin[k];
        high[k] = (double)axis[count - 1 - count / 20] + origin[k];
    }
    mem_free(axis);
    return GBT_OK;
}

typedef struct dataset_facts {
    const scene *s;
    photo_check photos;
    size_t views_by_model[GBT_CAMERA_MODEL_COUNT], rolling_views, test_views;
    double low[3], high[3], extent;
    expectation expect;
} dataset_facts;

/* The split that is used by default. */
static const char *split_name(const scene *s) { return s->has_split ? "own" : "every=8"; }

static json_t *dataset_to_json(const char *path, const dataset_facts *f)
{
    const scene *s = f->s;
    json_t *cameras = json_object();
    for (int m = 0; m < GBT_CAMERA_MODEL_COUNT; m++)
        if (f->views_by_model[m] > 0)
            json_object_set_new(cameras, gbt_camera_model_name((gbt_camera_model)m),
                                json_integer((json_int_t)f->views_by_model[m]));
    json_t *box = s->points.count == 0 ? json_null()
                                       : json_pack("[[f,f,f],[f,f,f]]", f->low[0], f->low[1], f->low[2],
                                                   f->high[0], f->high[1], f->high[2]);
    json_t *problems = json_array();
    for (size_t i = 0; i < f->photos.problem_count && i < PHOTO_CHECK_SHOWN; i++)
        json_array_append_new(problems, json_text(f->photos.problem[i]));
    return json_pack(
        "{s:i,s:s,s:o,s:s,s:I,s:o,s:I,s:{s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:I,s:[i,i],s:[i,i],s:o},s:"
        "I,s:I,s:s,s:I,s:b,s:I,s:[f,f,"
        "f],s:o,s:f,s:o}",
        "schema", 1, "kind", "dataset", "path", json_text(path), "source", s->source, "views",
        (json_int_t)s->view_count, "cameras", cameras, "rolling", (json_int_t)f->rolling_views, "photos",
        "found", (json_int_t)f->photos.found, "missing", (json_int_t)s->photos_missing, "unreadable",
        (json_int_t)f->photos.unreadable, "other_shape", (json_int_t)f->photos.other_shape, "other_size",
        (json_int_t)f->photos.other_size, "tiny", (json_int_t)f->photos.tiny, "turned",
        (json_int_t)f->photos.turned, "with_alpha", (json_int_t)f->photos.with_alpha, "with_mask",
        (json_int_t)f->photos.with_mask, "min_size", f->photos.min_width, f->photos.min_height, "max_size",
        f->photos.max_width, f->photos.max_height, "problems", problems, "train_views",
        (json_int_t)(s->view_count - f->test_views), "test_views", (json_int_t)f->test_views, "split",
        split_name(s), "points", (json_int_t)s->points.count, "points_have_color", (int)s->points.has_color,
        "points_dropped", (json_int_t)s->points_dropped, "origin", s->origin[0], s->origin[1], s->origin[2],
        "point_box", box, "camera_extent", f->extent, "expect", expect_to_json(&f->expect));
}

static void print_dataset(const char *path, const dataset_facts *f, FILE *out)
{
    const scene *s = f->s;
    const photo_check *p = &f->photos;
    fprintf(out, "%s: data set (%s)\n", path, s->source);
    fprintf(out, "  views     %zu: %zu to train, %zu held out (%s)\n", s->view_count,
            s->view_count - f->test_views, f->test_views, s->has_split ? "by the data set" : "every 8th");
    if (s->view_count > 0) {
        fprintf(out, "  cameras   ");
        const char *separator = "";
        for (int m = 0; m < GBT_CAMERA_MODEL_COUNT; m++)
            if (f->views_by_model[m] > 0) {
                fprintf(out, "%s%s in %zu views", separator, gbt_camera_model_name((gbt_camera_model)m),
                        f->views_by_model[m]);
                separator = ", ";
            }
        if (f->rolling_views > 0)
            fprintf(out, ", %zu with a rolling shutter", f->rolling_views);
        fprintf(out, "\n  photos    %zu found, %zu unreadable", p->found, p->unreadable);
        if (s->photos_missing > 0)
            fprintf(out, ", %zu missing", s->photos_missing);
        if (p->found > 0 && p->min_width == p->max_width && p->min_height == p->max_height)
            fprintf(out, ", %d x %d pixels", p->max_width, p->max_height);
        else if (p->found > 0)
            fprintf(out, ", %d x %d to %d x %d pixels", p->min_width, p->min_height, p->max_width,
                    p->max_height);
        if (p->other_shape > 0)
            fprintf(out, ", %zu not of their camera's shape", p->other_shape);
        if (p->other_size > 0)
            fprintf(out, ", %zu not of their camera's size", p->other_size);
        for (size_t i = 0; i < p->problem_count && i < PHOTO_CHECK_SHOWN; i++)
            fprintf(out, "\n            %s", p->problem[i]);
        if (p->problem_count > PHOTO_CHECK_SHOWN)
            fprintf(out, "\n            and %zu more", p->problem_count - PHOTO_CHECK_SHOWN);
        if (p->with_alpha + p->with_mask > 0)
            fprintf(out,
                    "\n  masks     photos with a mask: %zu, with an alpha channel: %zu (what is transparent "
                    "lies on %s; see the setting alpha)",
                    p->with_mask, p->with_alpha, strcmp(s->source, "blender") == 0 ? "white" : "black");
        fprintf(out, "\n  extent    %g (of the training cameras)\n", f->extent);
    }
    fprintf(out, "  points    %zu%s", s->points.count,
            s->points.count > 0 && !s->points.has_color ? ", without colour" : "");
    if (s->points_dropped > 0)
        fprintf(out, ", %zu unusable ones dropped", s->points_dropped);
    if (s->points.count > 0)
        fprintf(out, ", 90 %% within %g x %g x %g", f->high[0] - f->low[0], f->high[1] - f->low[1],
                f->high[2] - f->low[2]);
    fprintf(out, "\n  origin    %.9g %.9g %.9g\n", s->origin[0], s->origin[1], s->origin[2]);
    if (s->view_count > 0)
        expect_print(&f->expect, out);
}

static gbt_status info_of_dataset(const char *path, bool json, FILE *out, gbt_error *err)
{
    scene s;
    GBT_TRY(scene_load(path, NULL, &s, err));
    dataset_facts facts = {.s = &s, .extent = s.view_count > 0 ? scene_camera_extent(&s) : 0};
    photo_check_all(&s, &facts.photos);
    for (size_t i = 0; i < s.view_count; i++) {
        facts.views_by_model[s.views[i].camera.model]++;
        facts.rolling_views += !camera_is_still(&s.views[i].camera);
        facts.test_views += s.views[i].is_test;
    }
    double downscale;
    gbt_status status = photos_usual_downscale(&s, true, &downscale, err);
    if (status == GBT_OK)
        facts.expect =
            expect_training(&s, downscale, parallel_threads(), cpu_best_isa(), TRAIN_BUDGET_SECONDS);
    if (status == GBT_OK)
        status = find_box(s.points.position, s.points.count, s.origin, facts.low, facts.high, err);
    if (status == GBT_OK && json) {
        json_t *value = dataset_to_json(path, &facts);
        status = json_print(value, out, err);
        json_decref(value);
    } else if (status == GBT_OK)
        print_dataset(path, &facts, out);
    scene_free(&s);
    return status;
}

/* ---- plain Gaussians ---- */

static gbt_status info_of_gaussians(const char *path, bool json, FILE *out, gbt_error *err)
{
    gaussian_cloud cloud;
    double low[3], high[3];
    GBT_TRY(gaussian_file_read(path, &cloud, err));
    gbt_status status = find_box(cloud.mean, cloud.count, cloud.origin, low, high, err);
    const int functions = (cloud.sh_degree + 1) * (cloud.sh_degree + 1);
    const size_t memory =
        cell_memory_whole(cloud.count, (uint64_t)cloud.count * 4 * (14 + 3 * (uint64_t)functions));
    if (status == GBT_OK && json) {
        json_t *value =
            json_pack("{s:i,s:s,s:o,s:I,s:i,s:I,s:I,s:[[f,f,f],[f,f,f]]}", "schema", 1, "kind", "gaussians",
                      "path", json_text(path), "gaussians", (json_int_t)cloud.count, "sh_degree",
                      cloud.sh_degree, "dropped", (json_int_t)cloud.dropped, "memory_bytes",
                      (json_int_t)memory, "box", low[0], low[1], low[2], high[0], high[1], high[2]);
        status = json_print(value, out, err);
        json_decref(value);
    } else if (status == GBT_OK) {
        fprintf(out, "%s: plain Gaussians\n  gaussians %zu, colours of degree %d", path, cloud.count,
                cloud.sh_degree);
        if (cloud.dropped > 0)
            fprintf(out, ", %zu unusable rows dropped", cloud.dropped);
        fprintf(out, "\n  memory    %.0f MB to draw all of it at once", (double)memory / 0x1p20);
        fprintf(out, "\n  box       90 %% within %g x %g x %g around %g %g %g\n", high[0] - low[0],
                high[1] - low[1], high[2] - low[2], 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]),
                0.5 * (low[2] + high[2]));
    }
    gaussian_cloud_free(&cloud);
    return status;
}

/* ---- models ---- */

static gbt_status info_of_model(const char *path, bool json, FILE *out, gbt_error *err)
{
    unsigned char *bytes;
    size_t byte_count;
    container c;
    model m;
    GBT_TRY(file_read(path, &bytes, &byte_count, err));
    gbt_status status = container_parse(bytes, byte_count, path, &c, err);
    if (status == GBT_OK) {
        status = model_from_container(&c, &m, err);
        container_free(&c);
    }
    mem_free(bytes);
    if (status != GBT_OK)
        return status;
    const anchors *a = &m.anchors;
    if (json) {
        json_t *value = json_pack(
            "{s:i,s:s,s:o,s:I,s:i,s:b,s:I,s:I,s:I,s:o,s:o,s:f,s:f,s:f,s:[f,f,f],s:[f,f,f]}", "schema", 1,
            "kind", "model", "path", json_text(path), "anchors", (json_int_t)a->count, "offsets",
            a->offset_count, "has_distance", (int)m.decoder.has_distance, "decoder_parameters",
            (json_int_t)m.decoder.param_count, "iterations", (json_int_t)m.iterations, "bytes",
            (json_int_t)byte_count, "data", json_text(m.data_folder), "config", json_text(m.config),
            "voxel_size", (double)m.voxel_size, "camera_extent", (double)m.extent, "t_near", (double)m.t_near,
            "background", (double)m.background[0], (double)m.background[1], (double)m.background[2], "origin",
            m.origin[0], m.origin[1], m.origin[2]);
        status = json_print(value, out, err);
        json_decref(value);
    } else {
        fprintf(out, "%s: model\n", path);
        fprintf(out, "  anchors   %zu, with %d Gaussians each at most\n", a->count, a->offset_count);
        fprintf(out, "  decoder   %zu parameters, %s distance input\n", m.decoder.param_count,
                m.decoder.has_distance ? "with" : "without");
        fprintf(out, "  trained   %llu iterations on %s\n", (unsigned long long)m.iterations,
                m.data_folder[0] != '\0' ? m.data_folder : "unnamed data");
        fprintf(out, "  size      %zu bytes\n", byte_count);
        fprintf(out, "  scene     voxel size %g, extent %g, near %g, origin %.9g %.9g %.9g\n",
                (double)m.voxel_size, (double)m.extent, (double)m.t_near, m.origin[0], m.origin[1],
                m.origin[2]);
        for (const char *line = m.config; *line != '\0';) {
            const size_t length = strcspn(line, "\n");
            fprintf(out, "  config    %.*s\n", (int)length, line);
            line += length + (line[length] == '\n');
        }
    }
    model_free(&m);
    return status;
}

gbt_status gbt_info(const char *path, bool json, FILE *out, gbt_error *err)
{
    PLAIN_NUMBERS;
    char inside[4096];
    if (file_is_folder(path)) {
        GBT_TRY(file_join(inside, sizeof inside, path, "model.gbt", err));
        if (file_exists(inside))
            return info_of_model(inside, json, out, err);
    }
    if (gaussian_file_has_gaussians(path))
        return info_of_gaussians(path, json, out, err);
    return file_ends_with(path, ".gbt") ? info_of_model(path, json, out, err)
                                        : info_of_dataset(path, json, out, err);
}
