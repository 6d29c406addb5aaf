/* SPDX-License-Identifier: Apache-2.0 */
/* tests/library/double_scene.h -- what a camera sees, in double from end to end: lens, colours or networks,
   footprint, ray, blending. */
#ifndef GBT_TESTS_LIBRARY_DOUBLE_SCENE_H
#define GBT_TESTS_LIBRARY_DOUBLE_SCENE_H

#include "test_support.h"

#include "reference/decode_ref.h"
#include "base/memory.h"
#include "base/vec.h"
#include "data/gaussian_cloud.h"
#include "trace/footprint.h"
#include "trace/reference.h"

enum { FIELDS = GAUSSIANS_FIELD_COUNT };

/* Plain Gaussians as their user has them, in double: one array, in the order mean, scale_log, quat, opacity,
   sh. */
enum { PLAIN_FLOATS = 3 + 3 + 4 + 1 + 3 * GAUSSIAN_SH_COUNT };

typedef struct double_scene {
    size_t count;  /* Gaussians */
    int functions; /* of the harmonics; 0: networks */
    double *plain; /* [count][PLAIN_FLOATS] */
    decode_ref *networks;
    const uint32_t *anchors; /* all of them */
    const float *anchor_pixel;
    trace_settings settings;
    double footprint;
} double_scene;

/* P_l^m with the phase (-1)^m. */
static inline double legendre(int l, int m, double x)
{
    double p = 1, before = 0;
    for (int i = 1; i <= m; i++)
        p *= -(2 * i - 1) * sqrt(1 - x * x);
    for (int n = m + 1; n <= l; n++) {
        const double next = ((2 * n - 1) * x * p - (n + m - 1) * before) / (n - m);
        before = p;
        p = next;
    }
    return p;
}

/* Real spherical harmonics from their definition. */
static inline double harmonic(int index, const double d[3])
{
    const int l = (int)sqrt(index), m = index - l * l - l, n = m < 0 ? -m : m;
    double ratio = 1;
    for (int i = l - n + 1; i <= l + n; i++)
        ratio /= i;
    const double angle = atan2(d[1], d[0]), norm = sqrt((2 * l + 1) / (4 * 3.14159265358979323846) * ratio);
    const double p = norm * legendre(l, n, d[2]);
    return m == 0 ? p : sqrt(2) * p * (m > 0 ? cos(n * angle) : sin(n * angle));
}

static inline void see_plain(const double_scene *s, size_t i, const double eye[3], double out[FIELDS])
{
    const double *g = s->plain + i * PLAIN_FLOATS, *q = g + 6, *sh = g + 11;
    double d[3] = {g[0] - eye[0], g[1] - eye[1], g[2] - eye[2]};
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    dvec_normalize(d);
    for (int k = 0; k < 3; k++) {
        out[k] = g[k];
        out[3 + k] = exp(g[3 + k]);
        out[11 + k] = 0.5;
        for (int f = 0; f < s->functions; f++)
            out[11 + k] += sh[3 * f + k] * harmonic(f, d);
        out[11 + k] = fmax(out[11 + k], 0);
    }
    for (int k = 0; k < 4; k++)
        out[6 + k] = q[k] / length;
    out[10] = g[10];
}

/* The Gaussians that the camera's rays meet: [FIELDS][count]. */
static inline reference_scene seen_from(const double_scene *s, const gbt_camera *camera, const double eye[3])
{
    reference_scene out = {s->count, mem_alloc(s->count, FIELDS * sizeof(double), "test", NULL)};
    double *slots = mem_alloc(s->count, FIELDS * sizeof *slots, "test", NULL);
    const footprint_view view = footprint_view_of(camera);
    if (s->functions == 0)
        decode_ref_forward(s->networks, eye, s->anchors, s->networks->count, slots);
    for (size_t i = 0; i < s->count; i++) {
        double *fields = slots + i * FIELDS;
        footprint_gaussian wide; /* the first fields, in their order */
        if (s->functions > 0)
            see_plain(s, i, eye, fields);
        if (s->footprint > 0) {
            memcpy(&wide, fields, sizeof wide);
            const double least =
                s->anchor_pixel != NULL ? (double)s->anchor_pixel[i / (size_t)s->networks->offset_count] : 0;
            footprint_widen(&view, s->footprint, least, &wide);
            memcpy(fields, &wide, sizeof wide);
        }
        for (size_t f = 0; f < FIELDS; f++)
            out.fields[f * s->count + i] = fields[f];
    }
    mem_free(slots);
    return out;
}

static inline void pixel_ray(const gbt_camera *camera, size_t i, double origin[3], double dir[3])
{
    const size_t width = (size_t)camera->width;
    assert_true(gbt_camera_ray(camera, (double)(i % width) + 0.5, (double)(i / width) + 0.5, origin, dir));
}

/* sum of weight . rgb over all pixels; `rgb` is optional, [height][width][3]. */
static inline double double_loss(const double_scene *s, const gbt_camera *camera, const float *weight,
                                 double *rgb)
{
    double eye[3] = {0, 0, 0}, origin[3], dir[3], loss = 0;
    const size_t pixels = (size_t)camera->width * (size_t)camera->height;
    for (size_t i = 0; i < pixels; i++) {
        pixel_ray(camera, i, origin, dir);
        for (int k = 0; k < 3; k++)
            eye[k] += origin[k] / (double)pixels;
    }
    reference_scene scene = seen_from(s, camera, eye);
    reference_hit *hits = NULL;
    size_t count, capacity = 0;
    for (size_t i = 0; i < pixels; i++) {
        double clear = 1, color[3] = {0, 0, 0};
        pixel_ray(camera, i, origin, dir);
        assert_ok(
            reference_scene_ray_hits(&scene, &s->settings, origin, dir, &hits, &count, &capacity, NULL));
        for (size_t h = 0; h < count && clear * (1 - hits[h].alpha) >= (double)s->settings.transmittance_min;
             h++) {
            for (size_t k = 0; k < 3; k++)
                color[k] += clear * hits[h].alpha * scene.fields[(11 + k) * s->count + hits[h].id];
            clear *= 1 - hits[h].alpha;
        }
        for (size_t k = 0; k < 3; k++) {
            color[k] += clear * (double)s->settings.background[k];
            loss += (double)weight[3 * i + k] * color[k];
            if (rgb != NULL)
                rgb[3 * i + k] = color[k];
        }
    }
    mem_free(hits);
    reference_scene_free(&scene);
    return loss;
}

#endif
