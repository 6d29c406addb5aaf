/* SPDX-License-Identifier: Apache-2.0 */
/* train/exposure_spread.c -- estimate the exposures of photos from the colours of the sparse points in
   them. */
#include "train/exposure_spread.h"

#include <math.h>
#include <stdlib.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "train/camera_sees.h"

enum { POINTS_ASKED = SCENE_SEEN_MAX, POINTS_MIN = 50 };
static const float darkest = 0.04f, brightest = 0.96f; /* outside this range noise or clipping dominates */

static bool is_exposed(const float rgb[3])
{
    for (int c = 0; c < 3; c++)
        if (rgb[c] > brightest)
            return false;
    return rgb[0] + rgb[1] + rgb[2] > 3 * darkest;
}

/* log2 of (brightness of the photo at the point / brightness of the point); false when the comparison is not
   meaningful. */
static bool compare_at(const photos *p, size_t view, const gbt_camera *camera, size_t point, float *ratio)
{
    const scene_points *points = &p->source->points;
    const float *known = points->color + 3 * point;
    double pixel[2];
    if (!is_exposed(known) || !camera_sees_at(camera, points->position + 3 * point, pixel))
        return false;
    const size_t at = (size_t)pixel[1] * (size_t)camera->width + (size_t)pixel[0];
    if (p->full_valid[view] != NULL && !p->full_valid[view][at])
        return false;
    const unsigned char *bytes = p->full[view] + 3 * at;
    const float shown[3] = {(float)bytes[0] / 255, (float)bytes[1] / 255, (float)bytes[2] / 255};
    if (!is_exposed(shown))
        return false;
    *ratio = log2f((shown[0] + shown[1] + shown[2]) / (known[0] + known[1] + known[2]));
    return true;
}

/* Exposure of a photo: the median over its points; false when too few points can be compared. */
static bool exposure_of(const photos *p, size_t view, bool by_tracks, float *room, double *stops)
{
    const gbt_camera camera = photos_camera(p, view, 0);
    const scene_view *shown = &p->source->views[view];
    const size_t points = p->source->points.count, stride = by_tracks ? 1 : points / POINTS_ASKED + 1,
                 count = by_tracks ? shown->seen_count : points;
    size_t used = 0;
    for (size_t i = 0; i < count; i += stride)
        used += compare_at(p, view, &camera, by_tracks ? shown->seen[i] : i, &room[used]);
    if (used < POINTS_MIN)
        return false;
    qsort(room, used, sizeof *room, compare_floats);
    *stops = (double)room[used / 2];
    return true;
}

static gbt_status spread_over(photos *p, const size_t *views, size_t count, bool by_tracks, float *room,
                              double *stops, gbt_error *err)
{
    double sum = 0, squares = 0, known = 0;
    for (size_t i = 0; i < count; i++) {
        double exposure;
        GBT_TRY(photos_read_full(p, views[i], err));
        if (!exposure_of(p, views[i], by_tracks, room, &exposure))
            continue;
        known++;
        sum += exposure;
        squares += exposure * exposure;
    }
    *stops = known < 2 ? 0 : sqrt(fmax(0, squares - sum * sum / known) / (known - 1));
    return GBT_OK;
}

gbt_status exposure_spread_find(photos *p, const size_t *views, size_t count, exposure_spread *out,
                                gbt_error *err)
{
    *out = (exposure_spread){0};
    if (!p->source->points.has_color)
        return GBT_OK;
    float *room = mem_alloc(POINTS_ASKED + 1, sizeof *room, "exposures", err);
    if (room == NULL)
        return GBT_ERR_NO_MEMORY;
    bool tracks = false;
    for (size_t i = 0; i < count; i++)
        tracks = tracks || p->source->views[views[i]].seen_count > 0;
    const gbt_status status = spread_over(p, views, count, tracks, room, &out->stops, err);
    out->large = out->stops > (tracks ? EXPOSURE_SPREAD_BY_TRACKS : EXPOSURE_SPREAD_WITHOUT);
    mem_free(room);
    return status;
}
