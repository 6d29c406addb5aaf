/* SPDX-License-Identifier: Apache-2.0 */
/* stability/scene.c -- read the scene files of the study "stability", and collect the results of the cases.
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "data/json_fields.h"
#include "stability/stability.h"

bool stability_ok(stability *s, gbt_status status)
{
    if (s->status == GBT_OK)
        s->status = status;
    return s->status == GBT_OK;
}

/* ---- reading ---- */

void stability_scene_fail(stability *s, const char *field, const char *what)
{
    stability_ok(s, base_fail(s->err, GBT_ERR_FORMAT, "%s: %s: %s", s->path, field, what));
}

static const json_t *find_number(stability *s, const char *name)
{
    const json_t *value = s->study->quick ? json_object_get(json_object_get(s->scene, "quick"), name) : NULL;
    if (value == NULL)
        value = json_object_get(json_object_get(s->scene, "numbers"), name);
    if (value == NULL)
        stability_scene_fail(s, name, "missing in \"numbers\"");
    return value;
}

double stability_number(stability *s, const char *name)
{
    const json_t *value = s->status == GBT_OK ? find_number(s, name) : NULL;
    if (value != NULL && !json_is_number(value))
        stability_scene_fail(s, name, "wanted a number");
    return json_number_value(value);
}

size_t stability_list(stability *s, const char *name, size_t most, double *out)
{
    const json_t *list = s->status == GBT_OK ? find_number(s, name) : NULL;
    const size_t count = json_array_size(list);
    if (list != NULL && (count < 1 || count > most))
        stability_scene_fail(s, name, "wanted a list of numbers, neither empty nor too long");
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        if (!json_is_number(json_array_get(list, i)))
            stability_scene_fail(s, name, "wanted a list of numbers");
        out[i] = json_number_value(json_array_get(list, i));
    }
    return s->status == GBT_OK ? count : 0;
}

static gbt_status read_gaussian(const json_fields *r, gaussians *out, size_t i)
{
    double mean[3], scale[3], color[3], opacity = 0, quat[4] = {1, 0, 0, 0};
    GBT_TRY(json_field_names(r, " mean scale quat opacity color "));
    GBT_TRY(json_field_vector(r, "mean", true, mean));
    GBT_TRY(json_field_vector(r, "scale", true, scale));
    GBT_TRY(json_field_vector(r, "color", true, color));
    GBT_TRY(json_field_needed(r, "opacity", "0 to 1"));
    GBT_TRY(json_field_number(r, "opacity", 0, true, 1, &opacity));
    const json_t *turn = json_object_get(r->object, "quat");
    if (turn != NULL && json_array_size(turn) != 4)
        return json_field_fail(r, "quat", "wanted 4 numbers");
    for (size_t k = 0; k < 4 && turn != NULL; k++)
        quat[k] = json_number_value(json_array_get(turn, k));
    out->mean_x[i] = (float)mean[0];
    out->mean_y[i] = (float)mean[1];
    out->mean_z[i] = (float)mean[2];
    out->scale_x[i] = (float)scale[0];
    out->scale_y[i] = (float)scale[1];
    out->scale_z[i] = (float)scale[2];
    out->quat_w[i] = (float)quat[0];
    out->quat_x[i] = (float)quat[1];
    out->quat_y[i] = (float)quat[2];
    out->quat_z[i] = (float)quat[3];
    out->red[i] = (float)color[0];
    out->green[i] = (float)color[1];
    out->blue[i] = (float)color[2];
    out->opacity[i] = (float)opacity;
    return GBT_OK;
}

void stability_gaussians(stability *s, gaussians *out)
{
    const json_t *list = json_object_get(s->scene, "gaussians");
    const size_t count = json_array_size(list);
    if (s->status != GBT_OK)
        return;
    if (count == 0)
        stability_scene_fail(s, "gaussians", "wanted a list of objects");
    stability_ok(s, gaussians_resize(out, count, s->err));
    for (size_t i = 0; i < count && s->status == GBT_OK; i++) {
        char prefix[48];
        snprintf(prefix, sizeof prefix, "gaussians[%zu].", i);
        const json_fields r = {s->path, prefix, json_array_get(list, i), s->err};
        stability_ok(s, read_gaussian(&r, out, i));
    }
    if (s->status == GBT_OK)
        gaussians_pad(out);
}

/* ---- reporting ---- */

static const json_t *find_check(const stability *s, const char *row)
{
    const json_t *list = json_object_get(s->scene, "checks");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const char *name = json_string_value(json_object_get(json_array_get(list, i), "row"));
        if (name != NULL && strcmp(name, row) == 0)
            return json_array_get(list, i);
    }
    return NULL;
}

void stability_check(stability *s, const char *row, double value, double raster, const char *note, ...)
{
    if (s->status != GBT_OK)
        return;
    const json_t *check = find_check(s, row), *most = json_object_get(check, "at_most"),
                 *least = json_object_get(check, "at_least");
    const char *quantity = json_string_value(json_object_get(check, "quantity"));
    stability_study *study = s->study;
    if (quantity == NULL || json_is_number(most) == json_is_number(least)) {
        stability_scene_fail(s, row,
                             "wanted a check with \"quantity\", and a number \"at_most\" or \"at_least\"");
        return;
    }
    if (study->row_count == STABILITY_ROWS_MAX) {
        stability_scene_fail(s, row, "too many rows");
        return;
    }
    stability_row *r = &study->rows[study->row_count++];
    *r = (stability_row){
        .part = (int)study->part_count - 1, .at_least = least != NULL, .value = value, .raster = raster};
    r->open = json_is_true(json_object_get(check, "open"));
    r->timed = json_is_true(json_object_get(check, "timed"));
    r->limit = json_number_value(r->at_least ? least : most);
    r->pass = r->at_least ? value >= r->limit : value <= r->limit;
    snprintf(r->id, sizeof r->id, "%s", row);
    snprintf(r->quantity, sizeof r->quantity, "%s", quantity);
    va_list list;
    va_start(list, note);
    vsnprintf(r->note, sizeof r->note, note, list);
    va_end(list);
}

stability_chart *stability_new_chart(stability *s, const char *title, const char *note, const char *x_unit,
                                     const char *y_unit)
{
    stability_study *study = s->study;
    if (study->chart_count < STABILITY_CHARTS_MAX)
        study->chart_count++;
    stability_chart *chart = &study->charts[study->chart_count - 1];
    memset(chart, 0, sizeof *chart);
    chart->title = title, chart->note = note, chart->x_unit = x_unit, chart->y_unit = y_unit;
    chart->series[0].name = "gbtrace", chart->series[1].name = "rasterizer (3DGS)";
    return chart;
}

void stability_point(stability_chart *chart, int series, double x, double y)
{
    stability_series *line = &chart->series[series];
    if (line->count < STABILITY_POINTS) {
        line->x[line->count] = x;
        line->y[line->count++] = y;
    }
}

void stability_picture(stability *s, const char *name, const image *picture)
{
    char path[4096], file[96];
    snprintf(file, sizeof file, "stability_%s.png", name);
    if (s->status == GBT_OK && stability_ok(s, file_join(path, sizeof path, s->folder, file, s->err)))
        stability_ok(s, image_write(path, picture, s->err));
}
