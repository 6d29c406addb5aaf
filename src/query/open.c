/* SPDX-License-Identifier: Apache-2.0 */
/* query/open.c -- balls from runs, files and arrays. */
#include <math.h>
#include <string.h>

#include "anchor/activations.h"
#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "data/gaussian_file.h"
#include "data/scene.h"
#include "query/handle.h"
#include "query/rows.h"
#include "run/loaded_run.h"

/* How many std-devs away a response of this opacity falls to 1/255, where the tracer cuts it off; 0 if it
   never reaches that. */
static double reach_of(double opacity) { return opacity * 255 > 1 ? sqrt(2 * log(opacity * 255)) : 0; }

/* exp of a scale_log, which is limited from below as the decoder does it. */
static double scale_of(float scale_log) { return exp(fmax((double)scale_log, -(double)ACTIVATION_LIMIT)); }

static gbt_status make_room(gbt_balls *b, size_t count, bool radii, gbt_error *err)
{
    b->count = count;
    b->position = mem_alloc(count, 3 * sizeof *b->position, "balls", err);
    if (radii)
        b->radius = mem_alloc(count, sizeof *b->radius, "balls", err);
    return b->position == NULL || (radii && b->radius == NULL) ? GBT_ERR_NO_MEMORY : GBT_OK;
}

static void place(gbt_balls *b, const float *position, const double origin[3])
{
    for (size_t i = 0; i < 3 * b->count; i++)
        b->position[i] = (double)position[i] + origin[i % 3];
}

/* ---- sources ---- */

static gbt_status from_anchors(gbt_balls *b, const model *m, gbt_error *err)
{
    const anchors *a = &m->anchors;
    const size_t offsets = (size_t)a->offset_count;
    GBT_TRY(make_room(b, a->count, true, err));
    b->anchors = true;
    place(b, a->position, m->origin);
    for (size_t i = 0; i < a->count; i++) {
        const float *scale_log = a->scale_log + 6 * i;
        double farthest = 0, largest = 0;
        for (size_t c = 0; c < 3; c++) /* the networks make them smaller, never larger */
            largest = fmax(largest, scale_of(scale_log[3 + c]));
        for (size_t k = 0; k < offsets; k++) {
            double square = 0;
            for (size_t c = 0; c < 3; c++) {
                const double away = (double)a->offset[3 * (i * offsets + k) + c] * scale_of(scale_log[c]);
                square += away * away;
            }
            farthest = fmax(farthest, square);
        }
        b->radius[i] =
            (1 + 1e-6) * (sqrt(farthest) + reach_of(1) * largest); /* the decoder rounds to float */
    }
    return GBT_OK;
}

static gbt_status from_gaussians(gbt_balls *b, const gaussian_cloud *g, const double origin[3],
                                 gbt_error *err)
{
    GBT_TRY(make_room(b, g->count, true, err));
    place(b, g->mean, origin);
    for (size_t i = 0; i < g->count; i++) {
        const float *s = g->scale_log + 3 * i;
        b->radius[i] =
            reach_of((double)g->opacity[i]) * exp(fmax((double)s[0], fmax((double)s[1], (double)s[2])));
    }
    return GBT_OK;
}

static gbt_status from_run(gbt_balls *b, const char *path, gbt_error *err)
{
    loaded_run run = {0};
    gbt_status status = loaded_run_open_model(path, &run, err);
    if (status == GBT_OK)
        status = run.cloud.count > 0 ? from_gaussians(b, &run.cloud, run.model.origin, err)
                                     : from_anchors(b, &run.model, err);
    loaded_run_close(&run);
    return status;
}

static gbt_status from_rows(gbt_balls *b, const char *path, gbt_error *err)
{
    query_rows rows = {0};
    gbt_status status = query_rows_read(path, 3, 4, &rows, err);
    if (status == GBT_OK)
        status = make_room(b, rows.count, rows.width == 4, err);
    for (size_t i = 0; i < rows.count && status == GBT_OK; i++) {
        memcpy(b->position + 3 * i, rows.value + rows.width * i, 3 * sizeof *b->position);
        if (rows.width == 4)
            b->radius[i] = rows.value[4 * i + 3];
    }
    query_rows_free(&rows);
    return status;
}

static gbt_status from_data(gbt_balls *b, const char *path, gbt_error *err)
{
    scene s = {0};
    gbt_status status = scene_load(path, NULL, &s, err);
    if (status == GBT_OK)
        status = make_room(b, s.points.count, false, err);
    if (status == GBT_OK)
        place(b, s.points.position, s.origin);
    scene_free(&s);
    return status;
}

static bool holds_model(const char *folder)
{
    char path[4096];
    return file_join(path, sizeof path, folder, "model.gbt", NULL) == GBT_OK && file_exists(path);
}

static gbt_status read_balls(gbt_balls *b, const char *path, gbt_error *err)
{
    if (file_ends_with(path, ".txt") || file_ends_with(path, ".csv") || file_ends_with(path, ".xyz"))
        return from_rows(b, path, err);
    if (file_ends_with(path, ".ply") && !file_is_folder(path))
        return gaussian_file_has_gaussians(path) ? from_run(b, path, err) : from_rows(b, path, err);
    if (file_is_folder(path) && !holds_model(path) && !gaussian_file_readable(path))
        return from_data(b, path, err);
    return from_run(b, path, err);
}

/* ---- entries ---- */

static gbt_status finish(gbt_balls *b, const char *path, gbt_status status, gbt_balls **out, gbt_error *err)
{
    gbt_error why = {0};
    if (status == GBT_OK) {
        const number_array radius = {.real = b->radius};
        status = point_tree_build(number_doubles(b->position), radius, b->count, &b->tree, &why);
        if (status == GBT_ERR_ARGUMENT && path != NULL)
            status = base_fail(err, GBT_ERR_FORMAT, "%.250s: %s", path, why.text);
        else if (status != GBT_OK)
            status = base_fail(err, status, "%s", why.text);
    }
    if (status != GBT_OK) {
        gbt_balls_free(b);
        return status;
    }
    *out = b;
    return GBT_OK;
}

gbt_status gbt_balls_open(const char *path, gbt_balls **out, gbt_error *err)
{
    PLAIN_NUMBERS;
    *out = NULL;
    gbt_balls *b = mem_calloc(1, sizeof *b, "balls", err);
    if (b == NULL)
        return GBT_ERR_NO_MEMORY;
    return finish(b, path, read_balls(b, path, err), out, err);
}

gbt_status gbt_balls_from_arrays(const double *position, const double *radius, size_t count, gbt_balls **out,
                                 gbt_error *err)
{
    *out = NULL;
    if (position == NULL && count > 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "balls: position is NULL");
    gbt_balls *b = mem_calloc(1, sizeof *b, "balls", err);
    if (b == NULL)
        return GBT_ERR_NO_MEMORY;
    const gbt_status status = make_room(b, count, radius != NULL, err);
    if (status == GBT_OK && count > 0) {
        memcpy(b->position, position, 3 * count * sizeof *position);
        if (radius != NULL)
            memcpy(b->radius, radius, count * sizeof *radius);
    }
    return finish(b, NULL, status, out, err);
}

void gbt_balls_free(gbt_balls *b)
{
    if (b == NULL)
        return;
    point_tree_free(b->tree);
    mem_free(b->position);
    mem_free(b->radius);
    mem_free(b);
}

gbt_balls_view gbt_balls_get(const gbt_balls *b)
{
    return (gbt_balls_view){
        .count = b->count, .position = b->position, .radius = b->radius, .anchors = b->anchors};
}
