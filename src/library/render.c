/* SPDX-License-Identifier: Apache-2.0 */
/* library/render.c -- render pictures into the caller's arrays, and compute gradients of them. */
#include <math.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "frame/plain.h"
#include "frame/plain_view.h"
#include "library/handle.h"

gbt_status gbt_model_render(gbt_model *m, const gbt_camera *camera, bool keep, const gbt_picture *out,
                            gbt_error *err)
{
    loaded_run *r = &m->run;
    frame *f = &r->frame;
    m->kept = false;
    if (out->rgb == NULL)
        return base_fail(err, GBT_ERR_ARGUMENT, "picture: rgb is NULL");
    gbt_camera local = *camera;
    for (int k = 0; k < 3; k++)
        local.center[k] -= r->model.origin[k];
    GBT_TRY(frame_prepare(f, loaded_run_subject(r), &local, &m->settings, err));
    /* wraps the caller's array, so that the tracer writes into it */
    image rgb = {.width = camera->width, .height = camera->height, .channels = 3, .pixels = out->rgb};
    const trace_outputs outputs = {.rgb = &rgb, .depth = out->depth, .transmittance = out->transmittance};
    GBT_TRY(trace_forward(&f->scene, &f->rays, keep != 0, &outputs, NULL, err));
    m->kept = keep != 0;
    return GBT_OK;
}

/* Allocate the gradients of the cloud. */
static gbt_status reserve_gradient(gbt_model *m, gbt_error *err)
{
    const size_t count = m->run.cloud.count;
    if (m->gradient.count == count)
        return GBT_OK;
    gaussian_cloud_free(&m->gradient);
    mem_free(m->d_mean);
    m->d_mean = mem_alloc(count, 3 * sizeof *m->d_mean, "gradient", err);
    return m->d_mean == NULL ? GBT_ERR_NO_MEMORY : gaussian_cloud_alloc(&m->gradient, count, err);
}

/* A raised scale (gaussian_limit_scales()) is a fixed fraction of the largest one, so its gradient goes
   there. */
static void give_to_largest(const float scale_log[3], unsigned raised, float gradient[3])
{
    const int largest = scale_log[0] >= scale_log[1] && scale_log[0] >= scale_log[2] ? 0
                        : scale_log[1] >= scale_log[2]                               ? 1
                                                                                     : 2;
    for (int k = 0; k < 3; k++)
        if (raised >> k & 1) {
            gradient[largest] += gradient[k];
            gradient[k] = 0;
        }
}

/* Sums and products of finite values can overflow. */
static gbt_status beyond_range(gbt_error *err)
{
    return base_fail(err, GBT_ERR_ARGUMENT, "gradient: beyond the range of float (wanted a smaller d_rgb)");
}

static bool all_finite(const float *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

/* Convert f->d_gaussians into the caller's arrays. */
static gbt_status plain_gradient(gbt_model *m, const gbt_gaussians_gradient *out, gbt_error *err)
{
    const gaussian_cloud *cloud = &m->run.cloud;
    gaussian_cloud *g = &m->gradient;
    const frame *f = &m->run.frame;
    const size_t n = cloud->count, width = 3 * (size_t)((cloud->sh_degree + 1) * (cloud->sh_degree + 1));
    GBT_TRY(reserve_gradient(m, err));
    double d_eye[3];
    plain_backward(cloud, f->eye, f->visible, f->visible_count, &f->gaussians, &f->d_gaussians, g);
    GBT_TRY(plain_backward_view(cloud, f->eye, f->visible, f->visible_count, &f->gaussians, &f->d_gaussians,
                                m->d_mean, d_eye, err));
    for (size_t i = 0; i < n && m->quat_length != NULL; i++)
        for (size_t k = 0; k < 4; k++)
            g->quat[4 * i + k] /= m->quat_length[i];
    for (size_t i = 0; i < n && m->raised != NULL; i++)
        give_to_largest(cloud->scale_log + 3 * i, m->raised[i], g->scale_log + 3 * i);
    if (!all_finite(m->d_mean, 3 * n) || !all_finite(g->scale_log, 3 * n) || !all_finite(g->quat, 4 * n) ||
        !all_finite(g->opacity, n) || !all_finite(g->sh, 3 * GAUSSIAN_SH_COUNT * n))
        return beyond_range(err);
    copy_floats(m->d_mean, 3 * n, out->mean);
    copy_floats(g->scale_log, 3 * n, out->scale_log);
    copy_floats(g->quat, 4 * n, out->quat);
    copy_floats(g->opacity, n, out->opacity);
    for (size_t i = 0; i < n && out->sh != NULL; i++)
        copy_floats(g->sh + i * GAUSSIAN_SH_COUNT * 3, width, out->sh + i * width);
    return GBT_OK;
}

gbt_status gbt_model_gradient(gbt_model *m, const float *d_rgb, double d_pose[6],
                              const gbt_gaussians_gradient *d_gaussians, gbt_error *err)
{
    PLAIN_NUMBERS;
    frame *f = &m->run.frame;
    if (!m->kept)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "gradient: no render is kept (wanted gbt_model_render() with keep before each)");
    if (d_gaussians != NULL && m->run.cloud.count == 0)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "gradient: this model's Gaussians are decoded by networks (wanted a model of plain Gaussians)");
    const size_t values = 3 * ray_image_count(&f->rays);
    for (size_t i = 0; i < values; i++)
        if (!isfinite(d_rgb[i]))
            return base_fail(err, GBT_ERR_ARGUMENT, "gradient: value %zu of d_rgb is %g (wanted finite)", i,
                             (double)d_rgb[i]);
    m->kept = false;
    const image d_image = {.width = f->rays.width,
                           .height = f->rays.height,
                           .channels = 3,
                           .pixels = (float *)d_rgb}; /* the pixels are only read */
    GBT_TRY(frame_backward_gaussians(f, &d_image, err));
    if (d_pose != NULL)
        GBT_TRY(frame_backward_pose(f, loaded_run_subject(&m->run), d_pose, err));
    for (int k = 0; k < 6 && d_pose != NULL; k++)
        if (!isfinite(d_pose[k]))
            return beyond_range(err);
    return d_gaussians != NULL ? plain_gradient(m, d_gaussians, err) : GBT_OK;
}
