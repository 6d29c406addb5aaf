/* bake/cloud_frame.c -- plain Gaussians to a picture, and its gradient back to them. */
#include "bake/cloud_frame.h"

#include <math.h>
#include <string.h>

#include "bake/sh.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { BLOCK = 2048 };

typedef struct pass {
    cloud_frame *f;
    const gaussian_cloud *cloud;
    gaussian_cloud *d_cloud;
    double eye[3];
} pass;

static void see_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const pass *p = context;
    const gaussian_cloud *cloud = p->cloud;
    gaussians *g = &p->f->seen;
    const int functions = sh_count(cloud->sh_degree);
    for (size_t i = begin; i < end; i++) {
        const float *m = cloud->mean + 3 * i, *q = cloud->quat + 4 * i;
        double d[3], length = 0;
        for (int k = 0; k < 3; k++) {
            d[k] = (double)m[k] - p->eye[k];
            length += d[k] * d[k];
        }
        length = length > 0 ? sqrt(length) : 1;
        const float direction[3] = {(float)(d[0] / length), (float)(d[1] / length), (float)(d[2] / length)};
        float *y = p->f->basis + i * GAUSSIAN_SH_COUNT, color[3] = {0.5f, 0.5f, 0.5f};
        sh_basis(direction, y);
        const float(*sh)[3] = (const float(*)[3])(cloud->sh + i * GAUSSIAN_SH_COUNT * 3);
        for (int k = 0; k < functions; k++)
            for (int c = 0; c < 3; c++)
                color[c] += y[k] * sh[k][c];
        g->mean_x[i] = m[0], g->mean_y[i] = m[1], g->mean_z[i] = m[2];
        g->scale_x[i] = expf(cloud->scale_log[3 * i]), g->scale_y[i] = expf(cloud->scale_log[3 * i + 1]), g->scale_z[i] = expf(cloud->scale_log[3 * i + 2]);
        g->quat_w[i] = q[0], g->quat_x[i] = q[1], g->quat_y[i] = q[2], g->quat_z[i] = q[3];
        g->opacity[i] = cloud->opacity[i];
        g->red[i] = fmaxf(color[0], 0), g->green[i] = fmaxf(color[1], 0), g->blue[i] = fmaxf(color[2], 0);
    }
}

static float pixel_variance(const cloud_frame *f)
{
    const float step = (float)(f->pixel_step > 1 ? f->pixel_step : 1);
    return f->footprint / (step * step);
}

gbt_status cloud_frame_render(cloud_frame *f, const gaussian_cloud *cloud, const gbt_camera *camera, const trace_settings *settings, bool keep_tape,
                              gbt_error *err)
{
    const ray_shot shot = ray_shot_of(camera);
    GBT_TRY(ray_image_from_shot(&shot, 0, &f->rays, err));
    GBT_TRY(gaussians_resize(&f->seen, cloud->count, err));
    GBT_TRY(mem_reserve((void **)&f->basis, &f->basis_capacity, 0, cloud->count + 1, GAUSSIAN_SH_COUNT * sizeof *f->basis, "colours", err));
    pass p = {.f = f, .cloud = cloud};
    memcpy(p.eye, camera->center, sizeof p.eye);
    parallel_blocks(cloud->count, BLOCK, see_block, &p);
    gaussians_pad(&f->seen);
    f->view = footprint_view_of(camera);
    f->widened = f->footprint > 0;
    if (f->widened)
        GBT_TRY(footprint_forward(&f->view, pixel_variance(f), NULL, &f->seen, &f->wide, err));
    GBT_TRY(image_fit(&f->rgb, f->rays.width, f->rays.height, 3, err));
    GBT_TRY(trace_build(&f->scene, f->widened ? &f->wide : &f->seen, settings, ray_image_reach(&f->rays), err));
    return trace_forward(&f->scene, &f->rays, keep_tape, &(trace_outputs){.rgb = &f->rgb}, NULL, err);
}

static void back_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const pass *p = context;
    const gaussians *g = &p->f->seen, *d = &p->f->d_seen;
    const int functions = sh_count(p->cloud->sh_degree);
    for (size_t i = begin; i < end; i++) {
        gaussian_cloud *out = p->d_cloud;
        const float d_color[3] = {g->red[i] > 0 ? d->red[i] : 0, g->green[i] > 0 ? d->green[i] : 0, g->blue[i] > 0 ? d->blue[i] : 0};
        const float *y = p->f->basis + i * GAUSSIAN_SH_COUNT;
        float *sh = out->sh + i * GAUSSIAN_SH_COUNT * 3;
        for (int k = 0; k < GAUSSIAN_SH_COUNT; k++)
            for (int c = 0; c < 3; c++)
                sh[3 * k + c] = k < functions ? y[k] * d_color[c] : 0;
        out->scale_log[3 * i] = d->scale_x[i] * g->scale_x[i];
        out->scale_log[3 * i + 1] = d->scale_y[i] * g->scale_y[i];
        out->scale_log[3 * i + 2] = d->scale_z[i] * g->scale_z[i];
        out->quat[4 * i] = d->quat_w[i], out->quat[4 * i + 1] = d->quat_x[i], out->quat[4 * i + 2] = d->quat_y[i], out->quat[4 * i + 3] = d->quat_z[i];
        out->opacity[i] = d->opacity[i];
    }
}

gbt_status cloud_frame_backward(cloud_frame *f, const gaussian_cloud *cloud, const image *d_image, gaussian_cloud *d_cloud, float *weight, gbt_error *err)
{
    GBT_TRY(trace_backward(&f->scene, &f->rays, d_image, &f->d_seen, weight, NULL, err));
    if (f->widened)
        footprint_backward(&f->view, pixel_variance(f), NULL, &f->seen, &f->d_seen);
    pass p = {.f = f, .cloud = cloud, .d_cloud = d_cloud};
    parallel_blocks(cloud->count, BLOCK, back_block, &p);
    return GBT_OK;
}

void cloud_frame_free(cloud_frame *f)
{
    ray_image_free(&f->rays);
    gaussians_free(&f->seen);
    gaussians_free(&f->wide);
    gaussians_free(&f->d_seen);
    mem_free(f->basis);
    trace_scene_free(&f->scene);
    image_free(&f->rgb);
    memset(f, 0, sizeof *f);
}
