/* SPDX-License-Identifier: Apache-2.0 */
/* stability/practice.c -- write small data sets made of known Gaussians, and train on them. */
#include "stability/practice.h"

#include <ftw.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/file.h"
#include "base/memory.h"
#include "data/colmap_write.h"
#include "image/metrics.h"
#include "stability/draw.h"

static const double degree = 0.017453292519943295;

/* ---- the scene ---- */

/* Gaussian i of a Fibonacci sphere, coloured in smooth bands, so that every side has something to learn. */
static void put_gaussian(practice *p, size_t i, size_t count)
{
    const double z = 1 - (2 * (double)i + 1) / (double)count, turn = 2.399963229728653 * (double)i,
                 r = sqrt(1 - z * z);
    const double mean[3] = {r * cos(turn), z, r * sin(turn)}, size = 1.2 / sqrt((double)count),
                 scale[3] = {size, size, size};
    double color[3];
    for (int c = 0; c < 3; c++) {
        color[c] = 0.45 + 0.35 * sin(3 * mean[c] + 4 * mean[(c + 1) % 3]);
        p->color[i][c] = (unsigned char)(255 * color[c]);
        p->point[i][c] = mean[c];
    }
    draw_set(&p->truth, i, mean, scale, NULL, 0.95, color);
}

trace_settings practice_settings(void)
{
    trace_settings settings = trace_settings_default();
    settings.background[0] = 0.35f;
    settings.background[1] = 0.5f;
    settings.background[2] = 0.7f;
    return settings;
}

gbt_camera practice_camera(const practice *p, double azimuth_deg, double elevation_deg, double radius)
{
    static const double middle[3] = {0, 0, 0};
    const double a = azimuth_deg * degree, e = elevation_deg * degree;
    const double center[3] = {radius * cos(e) * sin(a), radius * sin(e), -radius * cos(e) * cos(a)};
    const double up[3] = {fabs(elevation_deg) > 89 ? 1 : 0, fabs(elevation_deg) > 89 ? 0 : 1, 0};
    gbt_camera camera = p->camera[0];
    gbt_camera_look_at(center, middle, up, &camera);
    return camera;
}

practice *practice_make(stability *s, size_t gaussian_count, size_t view_count, double radius, double arc_deg,
                        int width, int height)
{
    practice *p = mem_calloc(1, sizeof *p, "practice scene", s->err);
    if (p == NULL || gaussian_count > PRACTICE_POINTS_MAX || view_count > PRACTICE_VIEWS_MAX) {
        mem_free(p);
        stability_ok(s, GBT_ERR_NO_MEMORY);
        return NULL;
    }
    draw_alloc(s, &p->truth, gaussian_count);
    for (size_t i = 0; i < gaussian_count && s->status == GBT_OK; i++)
        put_gaussian(p, i, gaussian_count);
    p->point_count = gaussian_count;
    p->view_count = view_count;
    static const double here[3] = {0, 0, 0};
    p->camera[0] = draw_pinhole(width, height, 1.3 * width, here);
    for (size_t i = view_count; i-- > 0;) {
        const double steps = arc_deg >= 360 ? (double)view_count : fmax((double)view_count - 1, 1);
        p->camera[i] =
            practice_camera(p, arc_deg * ((double)i / steps - (arc_deg >= 360 ? 0 : 0.5)), 0, radius);
        p->gain[i] = 1;
    }
    return p;
}

void practice_free(practice *p)
{
    if (p != NULL)
        gaussians_free(&p->truth);
    mem_free(p);
}

/* ---- files ---- */

static void write_photo(stability *s, const practice *p, size_t i, drawing *d, ray_image *rays)
{
    const trace_settings settings = practice_settings();
    char path[PRACTICE_PATH_SIZE + 32];
    if (s->status != GBT_OK || !stability_ok(s, ray_image_from_camera(&p->camera[i], rays, s->err)))
        return;
    draw_traced(s, d, &p->truth, &settings, rays);
    if (s->status != GBT_OK)
        return;
    for (int k = 0; k < 3 * d->rgb.width * d->rgb.height; k++)
        d->rgb.pixels[k] = isnan(p->gain[i]) ? 0.5f : d->rgb.pixels[k] * p->gain[i];
    snprintf(path, sizeof path, "%s/images/%03zu.png", p->folder, i);
    stability_ok(s, image_write(path, &d->rgb, s->err));
}

static void write_model(stability *s, const practice *p)
{
    colmap_image images[PRACTICE_VIEWS_MAX] = {0};
    char names[PRACTICE_VIEWS_MAX][32], path[PRACTICE_PATH_SIZE + 32];
    colmap_point *points = mem_calloc(p->point_count + 1, sizeof *points, "points", s->err);
    if (points == NULL) {
        stability_ok(s, GBT_ERR_NO_MEMORY);
        return;
    }
    for (size_t i = 0; i < p->view_count; i++) {
        snprintf(names[i], sizeof names[i], "%03zu.png", i);
        images[i] = (colmap_image){.name = names[i], .camera = p->camera[i]};
    }
    for (size_t i = 0; i < p->point_count; i++) {
        points[i] = (colmap_point){.error = 1};
        memcpy(points[i].position, p->point[i], sizeof p->point[i]);
        memcpy(points[i].color, p->color[i], sizeof p->color[i]);
    }
    snprintf(path, sizeof path, "%s/sparse/0", p->folder);
    stability_ok(s, colmap_write(path, images, p->view_count, points, p->point_count, s->err));
    mem_free(points);
}

void practice_write(stability *s, practice *p, const char *name)
{
    if (s->status != GBT_OK || p == NULL)
        return;
    drawing d = {0};
    ray_image rays = {0};
    char images[PRACTICE_PATH_SIZE + 32];
    snprintf(p->folder, sizeof p->folder, "%.900s/practice_%.60s", s->folder, name);
    snprintf(images, sizeof images, "%s/images", p->folder);
    stability_ok(s, file_make_folder(images, s->err));
    for (size_t i = 0; i < p->view_count && s->status == GBT_OK; i++)
        write_photo(s, p, i, &d, &rays);
    if (s->status == GBT_OK)
        write_model(s, p);
    drawing_free(&d);
    ray_image_free(&rays);
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *walk)
{
    (void)info;
    (void)kind;
    (void)walk;
    return remove(path);
}

void practice_remove(practice *p)
{
    if (p != NULL && p->folder[0] != '\0')
        nftw(p->folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

/* ---- runs ---- */

gbt_status practice_open(stability *s, const practice *p, const gbt_train_def *def, trainer *t,
                         gbt_error *why)
{
    memset(t, 0, sizeof *t);
    return s->status != GBT_OK ? s->status : trainer_open(t, p->folder, def, why);
}

gbt_status practice_steps(trainer *t, gbt_error *why)
{
    step_report report;
    gbt_status status = GBT_OK;
    while (status == GBT_OK && t->step < t->def.iterations)
        status = trainer_step(t, &report, why);
    return status;
}

static size_t practice_count_bad(const trainer *t)
{
    const anchors *a = &t->anchors;
    size_t bad = 0;
    for (int f = 0; f < ANCHOR_FIELDS; f++)
        bad += draw_count_bad(a->field[f], a->count * anchors_width(a, f));
    return bad + draw_count_bad(t->decoder.params, t->decoder.param_count) +
           draw_count_bad(t->moment1.networks, t->decoder.param_count) +
           draw_count_bad(t->moment2.networks, t->decoder.param_count);
}

static void mean_of_photos(trainer *t, float mean[3], gbt_status *status, gbt_error *why)
{
    double sum[3] = {0}, pixels = 0;
    for (size_t i = 0; i < t->train_count && *status == GBT_OK; i++) {
        *status = photos_get(&t->photos, t->train_views[i], 0, &t->views[0].photo, NULL, why);
        const size_t count =
            *status == GBT_OK ? (size_t)t->views[0].photo.width * (size_t)t->views[0].photo.height : 0;
        for (size_t k = 0; k < 3 * count; k++)
            sum[k % 3] += (double)t->views[0].photo.pixels[k];
        pixels += (double)count;
    }
    for (int c = 0; c < 3; c++)
        mean[c] = (float)(sum[c] / fmax(pixels, 1));
}

static gbt_status look_at(trainer *t, practice_result *out, gbt_error *why)
{
    gbt_status status = GBT_OK;
    float mean[3];
    mean_of_photos(t, mean, &status, why);
    for (size_t i = 0; i < t->train_count && status == GBT_OK; i++) {
        const gbt_camera camera = photos_camera(&t->photos, t->train_views[i], 0);
        status = frame_render(&t->views[0].frame, frame_neural(&t->anchors, &t->decoder), &camera,
                              &t->settings, false, why);
        if (status == GBT_OK)
            status = photos_get(&t->photos, t->train_views[i], 0, &t->views[0].photo, NULL, why);
        if (status != GBT_OK)
            break;
        image *rgb = &t->views[0].frame.rgb;
        const size_t values = 3 * (size_t)rgb->width * (size_t)rgb->height;
        out->bad += draw_count_bad(rgb->pixels, values);
        image_quantize(rgb);
        out->psnr += metric_psnr(rgb, &t->views[0].photo) / (double)t->train_count;
        for (size_t k = 0; k < values; k++)
            rgb->pixels[k] = mean[k % 3];
        image_quantize(rgb);
        out->constant += metric_psnr(rgb, &t->views[0].photo) / (double)t->train_count;
    }
    return status;
}

gbt_status practice_run(stability *s, const practice *p, const gbt_train_def *def, practice_result *out,
                        gbt_error *why)
{
    memset(out, 0, sizeof *out);
    trainer *t = mem_calloc(1, sizeof *t, "trainer", why);
    if (t == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = practice_open(s, p, def, t, why);
    if (status == GBT_OK)
        status = practice_steps(t, why);
    if (status == GBT_OK)
        status = look_at(t, out, why);
    out->bad += practice_count_bad(t);
    out->skipped = t->skipped_steps;
    trainer_free(t);
    mem_free(t);
    return status;
}
