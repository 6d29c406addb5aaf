/* SPDX-License-Identifier: Apache-2.0 */
/* reference/raster_ref.c -- splatting in double precision, without optimization. The equations are in the
   header. */
#include "reference/raster_ref.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"

enum { MEAN = 0, SCALE = 3, QUAT = 6, OPACITY = 10, COLOR = 11, TILE = 16, PIXEL_GRAIN = 64 };

typedef struct lens {
    double focal[2], principal[2], low[2], high[2]; /* principal: from the first pixel's centre */
    double center[3];
} lens;

typedef struct flat {
    double t[3], point[2], kept[2], j[2][3], jw[2][3], sigma[3][3], conic[3]; /* conic: xx, xy, yy of C^-1 */
    int box[4]; /* first and end column, first and end row */
    size_t id;
} flat;

static double field(const raster_reference *scene, int f, size_t i)
{
    return scene->fields[(size_t)f * scene->count + i];
}

static gbt_status read_lens(const gbt_camera *camera, lens *out, gbt_error *err)
{
    const bool one = camera->model == GBT_CAMERA_SIMPLE_PINHOLE;
    if (!one && camera->model != GBT_CAMERA_PINHOLE)
        return base_fail(err, GBT_ERR_ARGUMENT, "raster: camera model %d (wanted a pinhole)",
                         (int)camera->model);
    const int side[2] = {camera->width, camera->height};
    for (int k = 0; k < 2; k++) {
        out->focal[k] = camera->params[one ? 0 : k];
        const double principal = camera->params[one ? 1 + k : 2 + k];
        out->principal[k] = principal - 0.5;
        out->low[k] = (-0.15 * side[k] - principal) / out->focal[k];
        out->high[k] = (1.15 * side[k] - principal) / out->focal[k];
    }
    for (int k = 0; k < 3; k++)
        out->center[k] =
            rounded_to_float(camera->center[k]); /* rounded, since rays of the tracer start there too */
    return GBT_OK;
}

static bool usable(const raster_reference *scene, size_t i)
{
    for (int f = 0; f < GAUSSIANS_FIELD_COUNT; f++)
        if (!isfinite(field(scene, f, i)))
            return false;
    return field(scene, SCALE, i) > 0 && field(scene, SCALE + 1, i) > 0 && field(scene, SCALE + 2, i) > 0;
}

static void rotation_of(const raster_reference *scene, size_t i, double q[4], double r[9])
{
    for (int k = 0; k < 4; k++)
        q[k] = field(scene, QUAT + k, i);
    dquat_to_matrix(q, r);
}

static bool flatten(const raster_reference *scene, const gbt_camera *camera, const lens *l,
                    const raster_settings *s, size_t i, flat *f)
{
    double q[4], r[9], offset[3];
    if (!usable(scene, i) || field(scene, OPACITY, i) < (double)s->alpha_min)
        return false;
    rotation_of(scene, i, q, r);
    for (int k = 0; k < 3; k++)
        offset[k] = field(scene, MEAN + k, i) - l->center[k];
    dmat_apply(camera->rotation, offset, f->t);
    if (!(f->t[2] > (double)s->near))
        return false;
    memset(f->j, 0, sizeof f->j);
    for (int a = 0; a < 2; a++) {
        const double ratio = f->t[a] / f->t[2];
        f->kept[a] = fmax(l->low[a], fmin(l->high[a], ratio));
        f->j[a][a] = l->focal[a] / f->t[2];
        f->j[a][2] = -l->focal[a] * f->kept[a] / f->t[2];
        f->point[a] = l->focal[a] * ratio + l->principal[a];
        dmat_apply_transposed(camera->rotation, f->j[a], f->jw[a]);
    }
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            f->sigma[a][b] = 0;
            for (int k = 0; k < 3; k++)
                f->sigma[a][b] += r[3 * a + k] * r[3 * b + k] * pow(field(scene, SCALE + k, i), 2);
        }
    double c[2][2];
    for (int a = 0; a < 2; a++)
        for (int b = 0; b < 2; b++) {
            c[a][b] = a == b ? (double)s->dilation : 0;
            for (int m = 0; m < 3; m++)
                for (int n = 0; n < 3; n++)
                    c[a][b] += f->jw[a][m] * f->sigma[m][n] * f->jw[b][n];
        }
    const double det = c[0][0] * c[1][1] - c[0][1] * c[0][1], middle = 0.5 * (c[0][0] + c[1][1]);
    if (!(det > 0))
        return false;
    f->conic[0] = c[1][1] / det;
    f->conic[1] = -c[0][1] / det;
    f->conic[2] = c[0][0] / det;
    const double radius =
        s->exact_cut ? HUGE_VAL : ceil(3 * sqrt(middle + sqrt(fmax(0.1, middle * middle - det))));
    const int side[2] = {camera->width, camera->height};
    for (int a = 0; a < 2; a++) {
        f->box[2 * a] = TILE * (int)fmax(0, fmin(1e7, (f->point[a] - radius) / TILE));
        f->box[2 * a + 1] = (int)fmin(
            side[a], TILE * (double)(int)fmax(0, fmin(1e7, (f->point[a] + radius + TILE - 1) / TILE)));
    }
    f->id = i;
    return true;
}

static int by_depth_then_id(const void *a, const void *b)
{
    const flat *p = a, *q = b;
    const float dp = (float)p->t[2], dq = (float)q->t[2]; /* the rasterizer sorts by the bits of a float */
    if (dp != dq)
        return dp < dq ? -1 : 1;
    return p->id < q->id ? -1 : p->id > q->id;
}

static gbt_status flatten_all(const raster_reference *scene, const gbt_camera *camera,
                              const raster_settings *s, lens *l, flat **out, size_t *count, gbt_error *err)
{
    GBT_TRY(read_lens(camera, l, err));
    *count = 0;
    *out = mem_alloc(scene->count, sizeof **out, "raster reference", err);
    if (*out == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < scene->count; i++)
        *count += flatten(scene, camera, l, s, i, &(*out)[*count]);
    if (*count > 1)
        qsort(*out, *count, sizeof **out, by_depth_then_id);
    return GBT_OK;
}

/* Response before it is limited to alpha_max; 0 if the Gaussian is not drawn there. */
static double response(const raster_reference *scene, const raster_settings *s, const flat *f, int x, int y)
{
    if (x < f->box[0] || x >= f->box[1] || y < f->box[2] || y >= f->box[3])
        return 0;
    const double dx = f->point[0] - x, dy = f->point[1] - y;
    const double p = -0.5 * (f->conic[0] * dx * dx + f->conic[2] * dy * dy) - f->conic[1] * dx * dy;
    if (p > 0 || p < -100)
        return 0;
    const double raw = field(scene, OPACITY, f->id) * exp(p);
    return raw >= (double)s->alpha_min ? raw : 0;
}

/* The background colour of a pixel. */
static void look_behind(const gbt_camera *camera, const raster_settings *s, int x, int y, double behind[3])
{
    double ray[3], world[3];
    if (!gbt_camera_unproject(camera, x + 0.5, y + 0.5, ray))
        return;
    dmat_apply_transposed(camera->rotation, ray, world);
    sky_color_exact(&s->sky, s->background, world, behind);
}

/* Blend front to back. Returns how many Gaussians of the list were visited. */
static size_t blend(const raster_reference *scene, const raster_settings *s, const flat *all, size_t count,
                    int x, int y, const double behind[3], double rgb[3], double *T)
{
    size_t i = 0;
    *T = 1;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (; i < count; i++) {
        const double alpha = fmin((double)s->alpha_max, response(scene, s, &all[i], x, y)),
                     next = *T * (1 - alpha);
        if (alpha > 0 && next < (double)s->transmittance_min)
            break;
        for (int c = 0; c < 3; c++)
            rgb[c] += *T * alpha * field(scene, COLOR + c, all[i].id);
        *T = next;
    }
    for (int c = 0; c < 3; c++)
        rgb[c] += *T * behind[c];
    return i;
}

typedef struct forward_job {
    const raster_reference *scene;
    const gbt_camera *camera;
    const raster_settings *s;
    const flat *all;
    size_t count;
    int across, step;
    double *rgb;
} forward_job;

static void forward_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const forward_job *job = context;
    for (size_t i = begin; i < end; i++) {
        double T, behind[3] = {0};
        const int x = (int)(i % (size_t)job->across) * job->step,
                  y = (int)(i / (size_t)job->across) * job->step;
        look_behind(job->camera, job->s, x, y, behind);
        blend(job->scene, job->s, job->all, job->count, x, y, behind, job->rgb + 3 * i, &T);
    }
}

gbt_status raster_reference_forward(const raster_reference *scene, const gbt_camera *camera,
                                    const raster_settings *settings, int step, double *rgb, gbt_error *err)
{
    lens l;
    forward_job job = {.scene = scene,
                       .camera = camera,
                       .s = settings,
                       .across = (camera->width + step - 1) / step,
                       .step = step,
                       .rgb = rgb};
    flat *all = NULL;
    const gbt_status status = flatten_all(scene, camera, settings, &l, &all, &job.count, err);
    job.all = all;
    if (status == GBT_OK)
        parallel_blocks(raster_reference_pixels(camera, step), PIXEL_GRAIN, forward_block, &job);
    mem_free(all);
    return status;
}

/* Chain rule from dL/dp of one Gaussian on one pixel to its fields, matrix by matrix. */
static void respond_backward(const raster_reference *scene, const gbt_camera *camera, const lens *l,
                             const flat *f, int x, int y, double d_p, double *d)
{
    const size_t n = scene->count, i = f->id;
    const double delta[2] = {f->point[0] - x, f->point[1] - y};
    const double k[2] = {f->conic[0] * delta[0] + f->conic[1] * delta[1],
                         f->conic[1] * delta[0] + f->conic[2] * delta[1]};
    double d_t[3] = {0}, d_sigma[3][3], world[3], q[4], r[9];
    /* dp/dC = (C^-1 delta)(C^-1 delta)^T / 2; C = (J W) Sigma (J W)^T */
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            d_sigma[a][b] = 0.5 * d_p * (k[0] * f->jw[0][a] + k[1] * f->jw[1][a]) *
                            (k[0] * f->jw[0][b] + k[1] * f->jw[1][b]);
    for (int a = 0; a < 2; a++) {
        double d_jw[3] = {0}, d_j[3];
        for (int m = 0; m < 3; m++)
            for (int b = 0; b < 2; b++)
                for (int o = 0; o < 3; o++)
                    d_jw[m] += d_p * k[a] * k[b] * f->jw[b][o] * f->sigma[o][m];
        dmat_apply(camera->rotation, d_jw, d_j);
        const double z = f->t[2], ratio = f->t[a] / z, focal = l->focal[a], d_point = -d_p * k[a];
        const double d_kept = f->kept[a] == ratio ? -focal / z * d_j[2] : 0,
                     d_ratio = d_kept + focal * d_point;
        d_t[a] += d_ratio / z;
        d_t[2] += -d_ratio * ratio / z - focal / (z * z) * d_j[a] + focal * f->kept[a] / (z * z) * d_j[2];
    }
    dmat_apply_transposed(camera->rotation, d_t, world);
    rotation_of(scene, i, q, r);
    double d_r[9];
    for (int c = 0; c < 3; c++) {
        const double s = field(scene, SCALE + c, i);
        double along = 0;
        for (int a = 0; a < 3; a++) {
            d_r[3 * a + c] = 0;
            for (int b = 0; b < 3; b++) {
                d_r[3 * a + c] += 2 * d_sigma[a][b] * r[3 * b + c] * s * s;
                along += r[3 * a + c] * d_sigma[a][b] * r[3 * b + c];
            }
        }
        d[(size_t)(MEAN + c) * n + i] += world[c];
        d[(size_t)(SCALE + c) * n + i] += 2 * s * along;
    }
    /* Derivatives of the entries of the rotation matrix, then projected onto the tangent space of the unit
     * sphere. */
    const double w = q[0], u = q[1], v = q[2], t = q[3];
    double d_q[4] = {2 * (-t * d_r[1] + v * d_r[2] + t * d_r[3] - u * d_r[5] - v * d_r[6] + u * d_r[7]),
                     2 * (v * d_r[1] + t * d_r[2] + v * d_r[3] - 2 * u * d_r[4] - w * d_r[5] + t * d_r[6] +
                          w * d_r[7] - 2 * u * d_r[8]),
                     2 * (-2 * v * d_r[0] + u * d_r[1] + w * d_r[2] + u * d_r[3] + t * d_r[5] - w * d_r[6] +
                          t * d_r[7] - 2 * v * d_r[8]),
                     2 * (-2 * t * d_r[0] - w * d_r[1] + u * d_r[2] + w * d_r[3] - 2 * t * d_r[4] +
                          v * d_r[5] + u * d_r[6] + v * d_r[7])};
    const double off = d_q[0] * w + d_q[1] * u + d_q[2] * v + d_q[3] * t;
    for (int c = 0; c < 4; c++)
        d[(size_t)(QUAT + c) * n + i] += d_q[c] - off * q[c];
}

static void pixel_backward(const raster_reference *scene, const gbt_camera *camera, const lens *l,
                           const raster_settings *s, const flat *all, size_t count, int x, int y,
                           const double d_rgb[3], double *d_fields)
{
    double rgb[3], T, behind[3] = {0};
    look_behind(camera, s, x, y, behind);
    const size_t n = scene->count, passed = blend(scene, s, all, count, x, y, behind, rgb, &T);
    for (size_t i = passed; i-- > 0;) {
        const double raw = response(scene, s, &all[i], x, y), alpha = fmin((double)s->alpha_max, raw);
        if (raw == 0)
            continue;
        double d_alpha = 0;
        T /= 1 - alpha;
        for (int c = 0; c < 3; c++) {
            const double color = field(scene, COLOR + c, all[i].id);
            d_fields[(size_t)(COLOR + c) * n + all[i].id] += T * alpha * d_rgb[c];
            d_alpha += T * (color - behind[c]) * d_rgb[c];
            behind[c] = alpha * color + (1 - alpha) * behind[c];
        }
        if (raw >= (double)s->alpha_max)
            continue;
        d_fields[(size_t)OPACITY * n + all[i].id] += raw / field(scene, OPACITY, all[i].id) * d_alpha;
        respond_backward(scene, camera, l, &all[i], x, y, raw * d_alpha, d_fields);
    }
}

gbt_status raster_reference_backward(const raster_reference *scene, const gbt_camera *camera,
                                     const raster_settings *settings, const double *d_rgb, double *d_fields,
                                     gbt_error *err)
{
    lens l;
    flat *all = NULL;
    size_t count;
    const gbt_status status = flatten_all(scene, camera, settings, &l, &all, &count, err);
    for (int y = 0; y < camera->height && status == GBT_OK; y++)
        for (int x = 0; x < camera->width; x++)
            pixel_backward(scene, camera, &l, settings, all, count, x, y,
                           d_rgb + 3 * ((size_t)y * (size_t)camera->width + (size_t)x), d_fields);
    mem_free(all);
    return status;
}

gbt_status raster_reference_make(const gaussians *g, raster_reference *out, gbt_error *err)
{
    *out = (raster_reference){.count = g->count};
    double *to = out->fields =
        mem_alloc(g->count, GAUSSIANS_FIELD_COUNT * sizeof *to, "raster reference", err);
    if (to == NULL)
        return GBT_ERR_NO_MEMORY;
#define X(name, pad, meaning)                                                                                \
    for (size_t i = 0; i < g->count; i++)                                                                    \
        *to++ = (double)g->name[i];
    GAUSSIANS_FIELDS(X)
#undef X
    return GBT_OK;
}
