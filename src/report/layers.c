/* SPDX-License-Identifier: Apache-2.0 */
/* report/layers.c -- the section that shows one view in the stages of the method: points, balls, anchors,
   Gaussians, render, photo. */
#include <math.h>
#include <string.h>

#include "anchor/init.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/paged.h"
#include "render/ellipsoids.h"
#include "report/image.h"
#include "report/scene.h"
#include "report/views.h"

enum { SIDE_MAX = 640, CHECK_SOLIDS = 1 << 14 };

/* Background of the solids, the same in the light and the dark theme. */
static const float stage_color[3] = {0.086f, 0.094f, 0.11f};

/** Temporary arrays for ellipsoids_draw(). */
typedef struct solids {
    float *center, *axes, *quat, *color; /* one block, owned by `center` */
    size_t count;
} solids;

static gbt_status solids_alloc(solids *s, size_t count, gbt_error *err)
{
    s->count = count;
    s->center = mem_calloc(count, 13 * sizeof *s->center, "solids", err);
    if (s->center == NULL)
        return GBT_ERR_NO_MEMORY;
    s->axes = s->center + 3 * count;
    s->quat = s->axes + 3 * count;
    s->color = s->quat + 4 * count;
    for (size_t i = 0; i < count; i++) {
        s->quat[4 * i] = 1;
        if (i % CHECK_SOLIDS == 0)
            paged_check();
    }
    return GBT_OK;
}

static void set_sphere(solids *s, size_t i, const float center[3], float radius, const float color[3])
{
    if (i % CHECK_SOLIDS == 0)
        paged_check();
    for (size_t k = 0; k < 3; k++) {
        s->center[3 * i + k] = center[k];
        s->axes[3 * i + k] = radius;
        s->color[3 * i + k] = color[k];
    }
}

/* ---- the four stages drawn as solids ---- */

static gbt_status make_points(const loaded_run *r, solids *s, gbt_error *err)
{
    const scene_points *p = &r->scene.points;
    GBT_TRY(solids_alloc(s, p->count, err));
    for (size_t i = 0; i < p->count; i++)
        set_sphere(s, i, p->position + 3 * i, 0, p->color + 3 * i);
    return GBT_OK;
}

/** The balls of the sparse points with the run's settings; none if its anchors did not come from balls. */
static gbt_status make_balls(const loaded_run *r, solids *s, gbt_error *err)
{
    const scene_points *p = &r->scene.points;
    anchor_init_def how = anchor_init_def_default();
    anchors made = {0};
    balls b = {0};
    if (!(r->model.voxel_size > 0))
        return GBT_OK;
    how.kind = r->def.init;
    how.fraction = r->def.init_count;
    how.balls.voxel_size = r->model.voxel_size;
    how.balls.max_depth = r->def.max_depth;
    GBT_TRY(anchors_init(p->position, p->has_color ? p->color : NULL, p->count, &how, &made, &b, err));
    const float grey[3] = {0.6f, 0.6f, 0.6f};
    const gbt_status status = solids_alloc(s, b.count, err);
    for (size_t i = 0; i < b.count && status == GBT_OK; i++)
        set_sphere(s, i, b.center + 3 * i, b.radius[i], p->has_color ? b.color + 3 * i : grey);
    anchors_free(&made);
    balls_free(&b);
    return status;
}

/** All anchors. Those that were decoded for the view have the mean colour of their Gaussians, weighted by
    opacity; the others are grey. */
static gbt_status make_anchors(const loaded_run *r, solids *s, gbt_error *err)
{
    const anchors *a = &r->model.anchors;
    const frame *f = &r->frame;
    const gaussians *g = frame_drawn(f);
    const float grey[3] = {0.3f, 0.31f, 0.33f};
    GBT_TRY(solids_alloc(s, a->count, err));
    float *weight = mem_calloc(a->count, sizeof *weight, "solids", err);
    if (weight == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < f->tape.kept_count; i++) {
        const size_t anchor = frame_part(f, loaded_run_subject(r), i);
        const float color[3] = {g->red[i], g->green[i], g->blue[i]};
        weight[anchor] += g->opacity[i];
        for (size_t k = 0; k < 3; k++)
            s->color[3 * anchor + k] += g->opacity[i] * color[k];
    }
    for (size_t i = 0; i < a->count; i++) {
        float color[3];
        for (size_t k = 0; k < 3; k++)
            color[k] = weight[i] > 0.0f ? s->color[3 * i + k] / weight[i] : grey[k];
        set_sphere(s, i, a->position + 3 * i, 0, color);
    }
    mem_free(weight);
    return GBT_OK;
}

/** The Gaussians given to the tracer, drawn at one standard deviation; faint ones are left out. */
static gbt_status make_gaussians(const loaded_run *r, solids *s, gbt_error *err)
{
    static const float opacity_least = 0.1f;
    const gaussians *g = &r->frame.gaussians;
    GBT_TRY(solids_alloc(s, g->count, err));
    size_t kept = 0;
    for (size_t i = 0; i < g->count; i++) {
        if (g->opacity[i] < opacity_least)
            continue;
        const float center[3] = {g->mean_x[i], g->mean_y[i], g->mean_z[i]},
                    color[3] = {g->red[i], g->green[i], g->blue[i]};
        set_sphere(s, kept, center, 0, color);
        s->axes[3 * kept] = g->scale_x[i];
        s->axes[3 * kept + 1] = g->scale_y[i];
        s->axes[3 * kept + 2] = g->scale_z[i];
        s->quat[4 * kept] = g->quat_w[i], s->quat[4 * kept + 1] = g->quat_x[i],
                    s->quat[4 * kept + 2] = g->quat_y[i], s->quat[4 * kept + 3] = g->quat_z[i];
        kept++;
    }
    s->count = kept;
    return GBT_OK;
}

/* ---- the section ---- */

typedef struct layer {
    const char *name, *text;
    gbt_status (*make)(const loaded_run *r, solids *s, gbt_error *err);
    float least_pixels, most_pixels;
} layer;

static void open_figure(text *out, const char *name)
{
    text_format(out, "<figure class=\"card\"><img alt=\"%s\" src=\"", name);
}

static void close_figure(text *out, const char *name, double count, const char *what)
{
    text_format(out, "\"><figcaption><b>%s</b> ", name);
    if (isfinite(count))
        text_count(out, count);
    text_format(out, "%s%s</figcaption></figure>\n", isfinite(count) ? " " : "", what);
}

static void add_solids(text *out, const loaded_run *r, const gbt_camera *camera, const layer *l)
{
    solids s = {0};
    image picture = {0};
    if (out->status != GBT_OK)
        return;
    out->status = l->make(r, &s, out->err);
    if (out->status == GBT_OK && s.count > 0)
        out->status = image_alloc(&picture, camera->width, camera->height, 4, out->err);
    if (out->status == GBT_OK && s.count > 0) {
        const size_t pixels = (size_t)camera->width * (size_t)camera->height;
        const ellipsoids set = {.count = s.count,
                                .center = s.center,
                                .axes = s.axes,
                                .quat = s.quat,
                                .color = s.color,
                                .least_pixels = l->least_pixels,
                                .most_pixels = l->most_pixels};
        for (size_t i = 0; i < 4 * pixels; i++)
            picture.pixels[i] = i % 4 < 3 ? stage_color[i % 4] : 1.0f;
        out->status = ellipsoids_draw(&set, camera, &picture, out->err);
        open_figure(out, l->name);
        report_image_jpeg(out, &picture);
        close_figure(out, l->name, (double)s.count, l->text);
    }
    image_free(&picture);
    mem_free(s.center);
}

/** The scored view with the median PSNR, as a typical one; the first view if none was held out. */
static size_t choose_view(const loaded_run *r, const evaluation *e)
{
    gbt_error ignored = {0};
    size_t chosen = 0, scored = 0, shown[REPORT_MAX_VIEWS];
    size_t *order = mem_alloc(e->view_count, sizeof *order, "views", &ignored);
    if (order != NULL && e->view_count > 0) {
        report_choose_views(e, shown, order);
        for (size_t i = 0; i < e->view_count; i++)
            scored += !isnan(e->views[i].psnr);
        for (size_t i = 0; i < r->scene.view_count; i++)
            if (strcmp(r->scene.views[i].name, e->views[order[scored / 2]].name) == 0)
                chosen = i;
    }
    mem_free(order);
    return chosen;
}

/** A pinhole with the lens's field of view and a longer side of SIDE_MAX pixels, for drawing the solids.
   False for a lens that is too wide or too narrow for one. */
static bool find_pinhole(const gbt_camera *lens, gbt_camera *out)
{
    double tan_half[2];
    gbt_camera_half_fov_tan(lens, tan_half);
    if (!(tan_half[0] > 0.01 && tan_half[1] > 0.01 && tan_half[0] < 2 && tan_half[1] < 2))
        return false;
    const double scale = (double)SIDE_MAX / (lens->width > lens->height ? lens->width : lens->height);
    *out = *lens;
    out->model = GBT_CAMERA_PINHOLE;
    out->width = (int)fmax(round(scale * lens->width), 1);
    out->height = (int)fmax(round(scale * lens->height), 1);
    memset(out->params, 0, sizeof out->params);
    out->params[0] = 0.5 * out->width / tan_half[0];
    out->params[1] = 0.5 * out->height / tan_half[1];
    out->params[2] = 0.5 * out->width;
    out->params[3] = 0.5 * out->height;
    return true;
}

static void add_photo(text *out, const loaded_run *r, size_t view)
{
    const image *render = &r->frame.rgb;
    image photo = {0};
    gbt_error why = {0};
    const gbt_status status =
        scene_read_photo(&r->scene.views[view], render->width, render->height, &photo, &why);
    if (status == GBT_OK) {
        open_figure(out, "The photo");
        report_image_jpeg(out, &photo);
        close_figure(out, "The photo", (double)NAN, "");
    } else if (status == GBT_ERR_NO_MEMORY) {
        out->status = status;
    }
    image_free(&photo);
}

void report_layers(text *out, loaded_run *r, const evaluation *e)
{
    static const layer layers[] = {
        {"Points", "that the photos' matching gave", make_points, 1.6f, 0},
        {"Granular balls",
         "of these points, by their radii and mean colours; the huge ones of lone points are not drawn",
         make_balls, 1.6f, SIDE_MAX / 16},
        {"Anchors", "after training, each in the mean colour of its Gaussians; grey: not seen from here",
         make_anchors, 1.6f, 0},
        {"Gaussians", "that the anchors decode to for this view, at one standard deviation", make_gaussians,
         0.7f, 0},
    };
    const size_t view = r->scene.view_count > 0 ? choose_view(r, e) : 0;
    gbt_camera camera;
    if (out->status != GBT_OK || r->scene.view_count == 0 ||
        !find_pinhole(&r->scene.views[view].camera, &camera))
        return;
    out->status = loaded_run_render(r, view, out->err);
    text_add(out, "<section id=\"layers\"><h2>From points to a picture</h2>\n<p class=\"lead\">One view, ");
    text_escaped(out, r->scene.views[view].name);
    text_add(out, r->scene.views[view].is_test ? ", which training never saw.</p>\n" : ".</p>\n");
    text_add(out, "<div class=\"layers\">\n");
    for (size_t i = 0; i < sizeof layers / sizeof *layers; i++)
        add_solids(out, r, &camera, &layers[i]);
    if (out->status == GBT_OK) {
        open_figure(out, "The picture");
        report_image_jpeg(out, &r->frame.rgb);
        close_figure(out, "The picture", (double)NAN, "the Gaussians, blended along every ray");
        add_photo(out, r, view);
    }
    text_add(out, "</div>\n</section>\n");
}
