/* SPDX-License-Identifier: Apache-2.0 */
/* report/maps.c -- maps of the scene: cameras from above and from the side, over points and anchors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"
#include "render/camera_group.h"
#include "render/ellipsoids.h"
#include "report/plot.h"
#include "report/image.h"
#include "report/scene.h"

/* Sizes in the chart's units; the picture behind it has DENSE pixels per unit. */
enum {
    MAP_WIDTH = 460,
    MAP_HEIGHT_MAX = 420,
    MAP_HEIGHT_MIN = 120,
    DENSE = 2,
    RULER = 24,
    CAMERAS_MAX = 400,
    DUST_MAX = 20000
};

/** One orthographic view of the scene. */
typedef struct map {
    const char *title, *name;
    double right[3], down[3], middle[3];
    double scale; /* units of the chart per scene unit */
    int height;
} map;

/** The range, along an axis, of all cameras and the central 94 % of the points. */
static gbt_status find_range(const loaded_run *r, const double axis[3], double range[2], gbt_error *err)
{
    const scene_points *p = &r->scene.points;
    float *along = mem_alloc(p->count, sizeof *along, "map", err);
    if (along == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < p->count; i++)
        along[i] = (float)(axis[0] * (double)p->position[3 * i] + axis[1] * (double)p->position[3 * i + 1] +
                           axis[2] * (double)p->position[3 * i + 2]);
    qsort(along, p->count, sizeof *along, compare_floats);
    range[0] = INFINITY;
    range[1] = -INFINITY;
    if (p->count > 0) {
        range[0] = (double)along[p->count * 3 / 100];
        range[1] = (double)along[p->count - 1 - p->count * 3 / 100];
    }
    mem_free(along);
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const double at = dvec_dot(r->scene.views[i].camera.center, axis);
        range[0] = fmin(range[0], at);
        range[1] = fmax(range[1], at);
    }
    const double margin = 0.06 * (range[1] - range[0]) + 1e-9;
    range[0] -= margin;
    range[1] += margin;
    return GBT_OK;
}

/** The horizontal direction in which the cameras' positions vary most. */
static void find_right(const loaded_run *r, const double up[3], double right[3])
{
    double e1[3], e2[3], mean[2] = {0}, xx = 0, xy = 0, yy = 0;
    const int least = fabs(up[0]) <= fabs(up[1]) && fabs(up[0]) <= fabs(up[2]) ? 0
                      : fabs(up[1]) <= fabs(up[2])                             ? 1
                                                                               : 2;
    for (int k = 0; k < 3; k++)
        e1[k] = (k == least) - up[least] * up[k];
    dvec_normalize(e1);
    dvec_cross(up, e1, e2);
    const double n = (double)r->scene.view_count;
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const double *center = r->scene.views[i].camera.center, x = dvec_dot(center, e1),
                     y = dvec_dot(center, e2);
        mean[0] += x / n;
        mean[1] += y / n;
    }
    for (size_t i = 0; i < r->scene.view_count; i++) {
        const double *center = r->scene.views[i].camera.center, x = dvec_dot(center, e1) - mean[0],
                     y = dvec_dot(center, e2) - mean[1];
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    const double angle = 0.5 * atan2(2 * xy, xx - yy);
    for (int k = 0; k < 3; k++)
        right[k] = cos(angle) * e1[k] + sin(angle) * e2[k];
}

static gbt_status make_maps(const loaded_run *r, map maps[2], gbt_error *err)
{
    gbt_camera *cameras = mem_alloc(r->scene.view_count, sizeof *cameras, "map", err);
    camera_group group;
    double range[3][2], right[3], away[3];
    if (cameras == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < r->scene.view_count; i++)
        cameras[i] = r->scene.views[i].camera;
    gbt_status status = camera_group_make(cameras, r->scene.view_count, r->scene.points.position,
                                          r->scene.points.count, &group, err);
    mem_free(cameras);
    if (status != GBT_OK)
        return status;
    find_right(r, group.up, right);
    dvec_cross(group.up, right, away);
    GBT_TRY(find_range(r, right, range[0], err));
    GBT_TRY(find_range(r, away, range[1], err));
    GBT_TRY(find_range(r, group.up, range[2], err));
    const double width = range[0][1] - range[0][0], depth = range[1][1] - range[1][0],
                 height = range[2][1] - range[2][0];
    const double scale = fmin(MAP_WIDTH / width, MAP_HEIGHT_MAX / fmax(depth, height));
    for (int i = 0; i < 2; i++) {
        map *m = &maps[i];
        *m = i == 0 ? (map){.title = "From above", .name = "above", .scale = scale}
                    : (map){.title = "From the side", .name = "side", .scale = scale};
        for (int k = 0; k < 3; k++) {
            m->right[k] = right[k];
            m->down[k] = i == 0 ? -away[k] : -group.up[k];
            m->middle[k] =
                0.5 * ((range[0][0] + range[0][1]) * right[k] + (range[1][0] + range[1][1]) * away[k] +
                       (range[2][0] + range[2][1]) * group.up[k]);
        }
        m->height = (int)fmax(ceil(scale * (i == 0 ? depth : height)), MAP_HEIGHT_MIN);
    }
    return GBT_OK;
}

/* ---- points and anchors as dust ---- */

/** Draw up to DUST_MAX positions, evenly sampled; color NULL: grey. */
static gbt_status draw_dust(const float *position, const float *color, size_t count, float pixels,
                            const gbt_camera *camera, image *picture, gbt_error *err)
{
    const size_t step = (count + DUST_MAX - 1) / DUST_MAX, kept = count > 0 ? (count + step - 1) / step : 0;
    float *block = mem_calloc(kept, 9 * sizeof *block, "map", err);
    if (block == NULL)
        return GBT_ERR_NO_MEMORY;
    float *center = block, *axes = center + 3 * kept, *shown = axes + 3 * kept;
    for (size_t i = 0; i < kept; i++)
        for (size_t k = 0; k < 3; k++) {
            center[3 * i + k] = position[3 * i * step + k];
            shown[3 * i + k] = color != NULL ? color[3 * i * step + k] : 0.55f;
        }
    const ellipsoids dust = {
        .count = kept, .center = center, .axes = axes, .color = shown, .least_pixels = pixels};
    const gbt_status status = ellipsoids_draw(&dust, camera, picture, err);
    mem_free(block);
    return status;
}

static void add_dust(text *out, const loaded_run *r, const map *m)
{
    gbt_camera camera = {
        .model = GBT_CAMERA_ORTHOGRAPHIC,
        .width = DENSE * MAP_WIDTH,
        .height = DENSE * m->height,
        .params = {DENSE * m->scale, DENSE * m->scale, 0.5 * DENSE * MAP_WIDTH, 0.5 * DENSE * m->height}};
    double forward[3];
    dvec_cross(m->right, m->down, forward);
    for (int k = 0; k < 3; k++) {
        camera.rotation[k] = m->right[k];
        camera.rotation[3 + k] = m->down[k];
        camera.rotation[6 + k] = forward[k];
        camera.center[k] = m->middle[k] - 4 * MAP_WIDTH / m->scale * forward[k];
    }
    image picture = {0};
    gbt_status status = image_alloc(&picture, camera.width, camera.height, 4, out->err);
    if (status == GBT_OK) {
        memset(picture.pixels, 0, 4 * (size_t)camera.width * (size_t)camera.height * sizeof *picture.pixels);
        status = draw_dust(r->model.anchors.position, NULL, r->model.anchors.count, 0.9f, &camera, &picture,
                           out->err);
    }
    if (status == GBT_OK && r->scene.points.has_color)
        status = draw_dust(r->scene.points.position, r->scene.points.color, r->scene.points.count, 1.3f,
                           &camera, &picture, out->err);
    if (status == GBT_OK) {
        text_format(out, "<image width=\"%d\" height=\"%d\" href=\"", (int)MAP_WIDTH, m->height);
        report_image_png(out, &picture);
        text_add(out, "\"/>");
    } else {
        out->status = status;
    }
    image_free(&picture);
}

/* ---- cameras ---- */

static void place(const map *m, const double at[3], double out[2])
{
    double way[3];
    for (int k = 0; k < 3; k++)
        way[k] = at[k] - m->middle[k];
    out[0] = 0.5 * MAP_WIDTH + m->scale * dvec_dot(way, m->right);
    out[1] = 0.5 * m->height + m->scale * dvec_dot(way, m->down);
}

/** A camera as a pyramid from its centre along the view, with the lens's field of view. */
static void add_camera(text *out, const map *m, const gbt_camera *c, bool is_held)
{
    static const double sides[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    const double length = 0.032 * MAP_WIDTH / m->scale;
    double tan_half[2], corner[4][2], apex[2];
    gbt_camera_half_fov_tan(c, tan_half);
    place(m, c->center, apex);
    for (int i = 0; i < 4; i++) {
        double at[3];
        for (int k = 0; k < 3; k++)
            at[k] = c->center[k] +
                    length * (c->rotation[6 + k] + sides[i][0] * fmin(tan_half[0], 1.5) * c->rotation[k] +
                              sides[i][1] * fmin(tan_half[1], 1.5) * c->rotation[3 + k]);
        place(m, at, corner[i]);
    }
    text_format(out, "<path class=\"camera%s\" d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fL%.1f %.1fZ",
                is_held ? " held" : "", corner[0][0], corner[0][1], corner[1][0], corner[1][1], corner[2][0],
                corner[2][1], corner[3][0], corner[3][1]);
    for (int i = 0; i < 4; i++)
        text_format(out, "M%.1f %.1fL%.1f %.1f", apex[0], apex[1], corner[i][0], corner[i][1]);
    text_add(out, "\">");
}

static void add_view(text *out, const map *m, const scene_view *view, const evaluation *e)
{
    size_t scored = 0;
    while (scored < e->view_count && strcmp(e->views[scored].name, view->name) != 0)
        scored++;
    const bool is_scored = view->is_test && scored < e->view_count;
    if (is_scored)
        text_format(out, "<a href=\"#view-%zu\">", scored);
    add_camera(out, m, &view->camera, view->is_test);
    text_add(out, "<title>");
    text_escaped(out, view->name);
    if (is_scored) {
        text_add(out, ", held out: ");
        text_number(out, e->views[scored].psnr, 2);
        text_add(out, " dB");
    }
    text_add(out, "</title></path>");
    text_add(out, is_scored ? "</a>" : "");
}

/** Every how many training cameras one is shown. */
static size_t step_of_cameras(const loaded_run *r)
{
    return (r->scene.view_count + CAMERAS_MAX - 1) / CAMERAS_MAX;
}

/** Training cameras first, then the held-out ones on top of them. */
static void add_cameras(text *out, const map *m, const loaded_run *r, const evaluation *e)
{
    const size_t step = step_of_cameras(r);
    size_t trained = 0; /* counts training views alone: every eighth view is held out, and a step over all
                           views could hit only those */
    for (int held = 0; held < 2; held++)
        for (size_t i = 0; i < r->scene.view_count; i++)
            if (r->scene.views[i].is_test == (held > 0) && (held > 0 || trained++ % step == 0))
                add_view(out, m, &r->scene.views[i], e);
}

/** A scale bar: a round length near a fifth of the map's width. */
static void add_ruler(text *out, const map *m)
{
    double ticks[CHART_MAX_TICKS];
    chart_ticks(0, MAP_WIDTH / m->scale, 5, ticks);
    const double length = ticks[1] * m->scale;
    text_format(out, "<path class=\"ruler\" d=\"M8 %dv6h%.1fv-6\"/><text x=\"%.1f\" y=\"%d\">%g</text>",
                m->height + 8, length, 16 + length, m->height + 16, ticks[1]);
}

void report_scene(text *out, const loaded_run *r, const evaluation *e)
{
    map maps[2];
    size_t held = 0;
    if (out->status != GBT_OK || r->scene.view_count == 0)
        return;
    for (size_t i = 0; i < r->scene.view_count; i++)
        held += r->scene.views[i].is_test;
    text_add(out, "<section id=\"scene\"><h2>The scene</h2>\n"
                  "<p class=\"lead\">Where the cameras stood, over what they saw. The ruler is in units of "
                  "the data set; a held-out camera leads to its picture.</p>\n"
                  "<div class=\"grid2 maps\">\n");
    out->status = make_maps(r, maps, out->err);
    for (int i = 0; i < 2 && out->status == GBT_OK; i++) {
        const map *m = &maps[i];
        text_format(out,
                    "<figure class=\"chart map card\"><figcaption><h3>%s</h3><p class=\"legend\"><span "
                    "class=\"key block train\">",
                    m->title);
        text_count(out, (double)(r->scene.view_count - held));
        text_add(out, " trained on");
        if (step_of_cameras(r) > 1)
            text_format(out, ", 1 in %zu shown", step_of_cameras(r));
        text_add(out, "</span><span class=\"key block held\">");
        text_count(out, (double)held);
        text_add(out, " held out</span><span class=\"key dots dust\">anchors, points in their "
                      "colours</span></p></figcaption>");
        text_format(out, "<svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"Cameras, %s\">",
                    (int)MAP_WIDTH, m->height + RULER, m->name);
        add_dust(out, r, m);
        add_cameras(out, m, r, e);
        add_ruler(out, m);
        text_add(out, "</svg></figure>\n");
    }
    text_add(out, "</div>\n</section>\n");
}
