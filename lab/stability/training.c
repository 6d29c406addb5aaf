/* SPDX-License-Identifier: Apache-2.0 */
/* stability/training.c -- cases of the study "stability" about training: views far from the photos (A12), and
   poor sparse points or photos (A13). */
#include <math.h>
#include <string.h>

#include "anchor/decode_layout.h"
#include "base/compare.h"
#include "base/memory.h"
#include "base/vec.h"
#include "image/metrics.h"
#include "stability/draw.h"
#include "stability/practice.h"
#include "train/held_out.h"

static gbt_train_def practice_def(stability *s)
{
    gbt_train_def def = gbt_train_def_default();
    def.iterations = (uint64_t)stability_number(s, "steps");
    def.eval_split = "none";
    def.seed = 1;
    return def;
}

/* For runs that must succeed: a failure ends the case. */
static bool must(stability *s, gbt_status status, const gbt_error *why)
{
    if (status != GBT_OK && s->status == GBT_OK && s->err != NULL)
        *s->err = *why;
    return stability_ok(s, status);
}

/* ---- A12: views far from the photos ---- */

typedef struct far_views {
    practice *p;
    trainer t;
    drawing truth, baked;
    ray_image rays;
    gaussians fixed; /* the Gaussians that the networks decode for the nearest photo */
    size_t bad;
    double out_of_range;
} far_views;

/* By which factor the distances given to the networks exceed the range [min / 2, 2 max]: the largest such
   factor, or 0 if none does. */
static double beyond_range(const far_views *f)
{
    const decoder *d = &f->t.decoder;
    const frame *drawn = &f->t.views[0].frame;
    double worst = 0;
    for (size_t i = 0; i < drawn->visible_count; i++) {
        float view[VIEW_COUNT];
        decode_views(&f->t.anchors, d, drawn->eye, drawn->visible + i, 1, view);
        const double seen = (double)view[VIEW_COUNT - 1];
        worst = fmax(worst, fmax(0.5 * (double)d->distance_min / seen, seen / (2 * (double)d->distance_max)));
    }
    return worst <= 1 + 1e-6 ? 0 : worst;
}

/* The share of anchors whose viewing direction is outside the cone of directions from which the photos saw
   them. */
static double share_outside(const far_views *f, const double center[3])
{
    size_t outside = 0;
    const anchors *a = &f->t.anchors;
    for (size_t i = 0; i < a->count; i++) {
        double mean[3] = {0, 0, 0}, from[PRACTICE_VIEWS_MAX][3], here[3], widest = 1;
        for (size_t v = 0; v < f->p->view_count; v++) {
            for (size_t k = 0; k < 3; k++)
                from[v][k] =
                    f->p->camera[v].center[k] - f->t.scene.origin[k] - (double)a->position[3 * i + k];
            dvec_normalize(from[v]);
            for (int k = 0; k < 3; k++)
                mean[k] += from[v][k];
        }
        dvec_normalize(mean);
        for (size_t v = 0; v < f->p->view_count; v++)
            widest = fmin(widest, from[v][0] * mean[0] + from[v][1] * mean[1] + from[v][2] * mean[2]);
        for (size_t k = 0; k < 3; k++)
            here[k] = center[k] - (double)a->position[3 * i + k];
        dvec_normalize(here);
        outside += here[0] * mean[0] + here[1] * mean[1] + here[2] * mean[2] < widest - 1e-9;
    }
    return (double)outside / fmax((double)a->count, 1);
}

static bool render_model(stability *s, far_views *f, const gbt_camera *camera)
{
    gbt_camera local = *camera;
    for (int k = 0; k < 3; k++)
        local.center[k] -= f->t.scene.origin[k];
    return s->status == GBT_OK &&
           stability_ok(s, frame_render(&f->t.views[0].frame, frame_neural(&f->t.anchors, &f->t.decoder),
                                        &local, &f->t.settings, false, s->err));
}

/* PSNR, against the truth, of the model minus that of the Gaussians decoded for the nearest photo. */
static double loss_to_baked(stability *s, far_views *f, double azimuth, double elevation, double radius,
                            double own_radius, double *outside)
{
    const gbt_camera near = practice_camera(f->p, azimuth, 0, own_radius),
                     far = practice_camera(f->p, azimuth, elevation, radius);
    if (!render_model(s, f, &near))
        return NAN;
    if (!stability_ok(s, gaussians_copy(&f->t.views[0].frame.gaussians, &f->fixed, s->err)) ||
        !render_model(s, f, &far))
        return NAN;
    f->bad += draw_count_bad(f->t.views[0].frame.rgb.pixels, 3 * (size_t)far.width * (size_t)far.height) +
              draw_count_bad_fields(&f->t.views[0].frame.gaussians);
    f->out_of_range = fmax(f->out_of_range, beyond_range(f));
    gbt_camera local = far;
    for (int k = 0; k < 3; k++)
        local.center[k] -= f->t.scene.origin[k];
    *outside = share_outside(f, local.center);
    if (stability_ok(s, ray_image_from_camera(&local, &f->rays, s->err)))
        draw_traced(s, &f->baked, &f->fixed, &f->t.settings, &f->rays);
    const trace_settings settings = practice_settings();
    if (s->status == GBT_OK && stability_ok(s, ray_image_from_camera(&far, &f->rays, s->err)))
        draw_traced(s, &f->truth, &f->p->truth, &settings, &f->rays);
    return s->status == GBT_OK ? metric_psnr(&f->baked.rgb, &f->truth.rgb) -
                                     metric_psnr(&f->t.views[0].frame.rgb, &f->truth.rgb)
                               : (double)NAN;
}

static void look_from_everywhere(stability *s, far_views *f)
{
    double radii[16], elevations[8], lost[2] = {-INFINITY, -INFINITY}, elsewhere = -INFINITY, outside = 0,
                                     outside_most = 0;
    const size_t radius_count = stability_list(s, "radii", 16, radii),
                 elevation_count = stability_list(s, "elevations", 8, elevations);
    const double own = stability_number(s, "radius"), near = stability_number(s, "judged_near"),
                 far = stability_number(s, "judged_far");
    for (size_t i = 0; i < radius_count; i++)
        for (size_t k = 0; k < elevation_count && s->status == GBT_OK; k++) {
            const double loss = loss_to_baked(s, f, 40, elevations[k], radii[i], own, &outside);
            const bool is_near = fabs(radii[i] - near) < 1e-9, is_far = fabs(radii[i] - far) < 1e-9,
                       level = fabs(elevations[k]) < 1e-9;
            if ((is_near || is_far) && level)
                lost[is_far] = loss;
            else if (is_near || is_far)
                elsewhere = larger_or_nan(elsewhere, loss);
            outside_most = larger_or_nan(outside_most, outside);
        }
    /* A camera exactly on an anchor: direction and distance are undefined. */
    gbt_camera on = practice_camera(f->p, 0, 0, own);
    for (size_t k = 0; k < 3 && s->status == GBT_OK; k++)
        on.center[k] = (double)f->t.anchors.position[k] + f->t.scene.origin[k];
    if (render_model(s, f, &on))
        f->bad += draw_count_bad(f->t.views[0].frame.rgb.pixels, 3 * (size_t)on.width * (size_t)on.height) +
                  draw_count_bad_fields(&f->t.views[0].frame.gaussians);
    stability_check(s, "A12a", (double)f->bad, NAN,
                    "%zu places, one of them on an anchor, %.3g units from the origin.",
                    radius_count * elevation_count + 1, own);
    stability_check(s, "A12b", f->out_of_range, NAN, "As a factor beyond the range; 0: none.");
    stability_check(s, "A12c", lost[0], NAN,
                    "Level with the photos. From 45 and 90 degrees above, where no photo was taken: up to "
                    "%.1f dB, both near and far.",
                    elsewhere);
    stability_check(
        s, "A12d", lost[1], NAN,
        "Up to %.0f %% of the anchors are seen from outside the cone of directions that the photos cover.",
        100 * outside_most);
}

gbt_status stability_a12(stability *s)
{
    far_views *f = mem_calloc(1, sizeof *f, "views", s->err);
    if (f == NULL)
        return GBT_ERR_NO_MEMORY;
    const double radius = stability_number(s, "radius"), spread = stability_number(s, "radius_spread");
    const int size = (int)stability_number(s, "size");
    f->p = practice_make(s, (size_t)stability_number(s, "anchors"), (size_t)stability_number(s, "views"),
                         radius, 360, size, size);
    for (size_t i = 0; f->p != NULL && i < f->p->view_count; i++)
        f->p->camera[i] = practice_camera(f->p, 360.0 * (double)i / (double)f->p->view_count, 0,
                                          radius + spread * sin(2.4 * (double)i));
    practice_write(s, f->p, "a12");
    gbt_train_def def = practice_def(s);
    def.distance = GBT_DISTANCE_INPUT_ON;
    gbt_error why = {0};
    if (s->status == GBT_OK && must(s, practice_open(s, f->p, &def, &f->t, &why), &why) &&
        must(s, practice_steps(&f->t, &why), &why))
        look_from_everywhere(s, f);
    practice_remove(f->p);
    practice_free(f->p);
    trainer_free(&f->t);
    drawing_free(&f->truth);
    drawing_free(&f->baked);
    ray_image_free(&f->rays);
    gaussians_free(&f->fixed);
    mem_free(f);
    return s->status;
}

/* ---- A13: poor sparse points and photos ---- */

static void first_points(practice *p, size_t count) { p->point_count = count; }

static void p0_none(practice *p) { first_points(p, 0); }
static void p1_one(practice *p) { first_points(p, 1); }
static void p2_two(practice *p) { first_points(p, 2); }

static void p3_collinear(practice *p)
{
    first_points(p, 100);
    for (size_t i = 0; i < 100; i++) {
        p->point[i][0] = 0.02 * (double)i - 1;
        p->point[i][1] = 0.5 * p->point[i][0];
        p->point[i][2] = -0.25 * p->point[i][0];
    }
}

static void p4_coplanar(practice *p)
{
    first_points(p, 100);
    for (size_t i = 0; i < 100; i++)
        p->point[i][1] = 0;
}

static void p5_identical(practice *p)
{
    for (size_t i = 0; i < p->point_count; i++) {
        p->point[i][0] = 0.25;
        p->point[i][1] = 0.5;
        p->point[i][2] = -0.75;
    }
}

static void p6_one_nan(practice *p) { p->point[p->point_count - 1][1] = NAN; }

static void p6_all_nan(practice *p)
{
    for (size_t i = 0; i < p->point_count; i++)
        p->point[i][i % 3] = NAN;
}

static void p7_outliers(practice *p)
{
    for (size_t i = 0; i < 5; i++)
        for (size_t k = 0; k < 3; k++)
            p->point[i][k] *= 1e5;
}

static void p8_behind(practice *p) /* the cameras stand at z < 0 and look towards +z */
{
    for (size_t i = 0; i < p->point_count; i++)
        p->point[i][2] -= 40;
}

static void p9_one_photo(practice *p) { p->view_count = 1; }

static void p10_grey(practice *p)
{
    for (size_t i = 0; i < p->view_count; i++)
        p->gain[i] = NAN;
}

static void p12_one_black(practice *p) { p->gain[2] = 0; }
static void p13_same_pose(practice *p) { p->camera[3] = p->camera[2]; }

static void p14_sizes(practice *p)
{
    for (size_t i = 0; i < p->view_count; i += 2)
        p->camera[i] = gbt_camera_resized(&p->camera[i], 40 + 8 * (int)i, 30 + 6 * (int)i);
}

static void p15_no_color(practice *p) { memset(p->color, 0, sizeof p->color); }

typedef struct poor_case {
    const char *row;
    void (*spoil)(practice *p);
    bool may_refuse, absolute; /* absolute: judge the PSNR itself, not its gain over a uniform colour */
} poor_case;

static const poor_case poor_cases[] = {
    {"A13P0", p0_none, true, false},         {"A13P1", p1_one, false, false},
    {"A13P2", p2_two, false, false},         {"A13P3", p3_collinear, false, false},
    {"A13P4", p4_coplanar, false, false},    {"A13P5", p5_identical, false, false},
    {"A13P6", p6_one_nan, false, false},     {"A13P6n", p6_all_nan, true, false},
    {"A13P7", p7_outliers, false, false},    {"A13P8", p8_behind, true, false},
    {"A13P9", p9_one_photo, false, false},   {"A13P10", p10_grey, false, true},
    {"A13P12", p12_one_black, false, false}, {"A13P13", p13_same_pose, false, false},
    {"A13P14", p14_sizes, false, false},     {"A13P15", p15_no_color, false, false},
};

static practice *poor_scene(stability *s, size_t views)
{
    const double arc_deg = 120;
    return practice_make(s, (size_t)stability_number(s, "points"), views, stability_number(s, "radius"),
                         arc_deg, (int)stability_number(s, "width"), (int)stability_number(s, "height"));
}

static void try_poor(stability *s, const poor_case *c, size_t *bad)
{
    practice *p = poor_scene(s, (size_t)stability_number(s, "views"));
    if (p != NULL)
        c->spoil(p);
    practice_write(s, p, c->row);
    const gbt_train_def def = practice_def(s);
    practice_result r = {0};
    gbt_error why = {0};
    const gbt_status status = s->status == GBT_OK ? practice_run(s, p, &def, &r, &why) : GBT_OK;
    *bad += r.bad;
    if (status != GBT_OK)
        stability_check(s, c->row, c->may_refuse && why.text[0] != '\0' ? 0 : NAN, NAN, "Refused: %.250s",
                        why.text);
    else
        stability_check(s, c->row, c->absolute ? r.psnr : r.psnr - r.constant, NAN,
                        "%.1f dB; one colour: %.1f dB.", r.psnr, r.constant);
    practice_remove(p);
    practice_free(p);
}

static double held_out(stability *s, const practice *p, bool exposure)
{
    gbt_train_def def = practice_def(s);
    def.eval_split = "every=4";
    def.exposure = exposure;
    def.find_exposure = false;
    def.iterations = (uint64_t)stability_number(s, "exposure_steps");
    double psnr = NAN;
    gbt_error why = {0};
    trainer *t = mem_calloc(1, sizeof *t, "trainer", s->err);
    if (t == NULL)
        stability_ok(s, GBT_ERR_NO_MEMORY);
    else if (s->status == GBT_OK && must(s, practice_open(s, p, &def, t, &why), &why) &&
             must(s, practice_steps(t, &why), &why))
        must(s, held_out_psnr(t, &psnr, &why), &why);
    if (t != NULL)
        trainer_free(t);
    mem_free(t);
    return psnr;
}

static void exposures_differ(stability *s)
{
    static const float factors[3] = {0.5f, 1, 2};
    practice *p = poor_scene(s, 12);
    for (size_t i = 0; p != NULL && i < p->view_count; i++)
        p->gain[i] = 0.5f * factors[i % 3]; /* half as bright, so that twice that does not clip */
    practice_write(s, p, "a13p11");
    const double without = held_out(s, p, false), with = held_out(s, p, true);
    stability_check(s, "A13P11", with - without, NAN,
                    "Held-out photos: %.1f dB without --exposure, %.1f dB with it (right halves, a matrix "
                    "fitted to the left).",
                    without, with);
    practice_remove(p);
    practice_free(p);
}

gbt_status stability_a13(stability *s)
{
    size_t bad = 0;
    for (size_t i = 0; i < sizeof poor_cases / sizeof *poor_cases && s->status == GBT_OK; i++)
        try_poor(s, &poor_cases[i], &bad);
    if (s->status == GBT_OK)
        exposures_differ(s);
    stability_check(s, "A13", (double)bad, NAN, "Parameters and pictures of all of these runs.");
    return s->status;
}
