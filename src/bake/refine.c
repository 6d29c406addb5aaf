/* SPDX-License-Identifier: Apache-2.0 */
/* bake/refine.c -- fits plain Gaussians to the model's pictures: render both, loss, adjoint, Adam. */
#include "bake/refine.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "image/metrics.h"
#include "train/adam.h"

enum { BLOCK = 512, PIXEL_STEP = 2, STREAM = 1, REST = 3 * (GAUSSIAN_SH_COUNT - 1) };

static const double rate_end = 0.1; /* learning rates decay to this fraction */
static const struct {
    double opacity, scale, rotation, color, harmonics;
} first_rates = {0.04, 0.006, 0.002, 0.005, 0.0025};

typedef struct refining {
    gaussian_cloud *cloud, gradient, moment1, moment2;
    float *logit; /* [count] logits of the opacities, which are optimized */
    frame frame;
    image d_image;
    loss_scratch scratch;
    adam_rates opacity, scale, rotation, color, harmonics;
} refining;

refine_def refine_def_default(void) { return (refine_def){.steps = 500}; }

static gbt_status open_state(refining *r, gaussian_cloud *cloud, gbt_error *err)
{
    gaussian_cloud *same[] = {&r->gradient, &r->moment1, &r->moment2};
    const size_t n = cloud->count;
    r->cloud = cloud;
    r->logit = mem_alloc(n, sizeof *r->logit, "opacities", err);
    if (r->logit == NULL)
        return GBT_ERR_NO_MEMORY;
    for (int k = 0; k < 3; k++) {
        gaussian_cloud *c = same[k];
        GBT_TRY(gaussian_cloud_alloc(c, n, err));
        memset(c->scale_log, 0, 3 * n * sizeof(float));
        memset(c->quat, 0, 4 * n * sizeof(float));
        memset(c->opacity, 0, n * sizeof(float));
        memset(c->sh, 0, n * GAUSSIAN_SH_COUNT * 3 * sizeof(float));
    }
    for (size_t i = 0; i < n; i++) {
        const float o = fminf(fmaxf(cloud->opacity[i], 1e-4f), 1 - 1e-4f);
        r->logit[i] = logf(o / (1 - o));
    }
    return GBT_OK;
}

static void close_state(refining *r)
{
    gaussian_cloud_free(&r->gradient);
    gaussian_cloud_free(&r->moment1);
    gaussian_cloud_free(&r->moment2);
    mem_free(r->logit);
    frame_free(&r->frame);
    image_free(&r->d_image);
    loss_scratch_free(&r->scratch);
}

static void step_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    refining *r = context;
    gaussian_cloud *p = r->cloud, *g = &r->gradient, *m = &r->moment1, *v = &r->moment2;
    const size_t n = end - begin, sh_width = GAUSSIAN_SH_COUNT * 3;
    for (size_t i = begin; i < end; i++)
        g->opacity[i] *= p->opacity[i] * (1 - p->opacity[i]); /* chain rule: from opacity to its logit */
    adam_step(r->logit + begin, g->opacity + begin, m->opacity + begin, v->opacity + begin, n, r->opacity);
    adam_step(p->scale_log + 3 * begin, g->scale_log + 3 * begin, m->scale_log + 3 * begin,
              v->scale_log + 3 * begin, 3 * n, r->scale);
    adam_step(p->quat + 4 * begin, g->quat + 4 * begin, m->quat + 4 * begin, v->quat + 4 * begin, 4 * n,
              r->rotation);
    for (size_t i = begin; i < end; i++) {
        const size_t at = i * sh_width;
        adam_step(p->sh + at, g->sh + at, m->sh + at, v->sh + at, 3, r->color);
        adam_step(p->sh + at + 3, g->sh + at + 3, m->sh + at + 3, v->sh + at + 3, REST, r->harmonics);
        p->opacity[i] = 1 / (1 + expf(-r->logit[i]));
        float *q = p->quat + 4 * i;
        const float norm = sqrtf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int k = 0; k < 4; k++)
            q[k] /= norm;
        gaussian_limit_scales(p->scale_log + 3 * i);
    }
}

static void set_rates(refining *r, int step, int steps)
{
    const double fall = pow(rate_end, (double)step / steps);
    const uint64_t t = (uint64_t)step + 1;
    r->opacity = adam_rates_at(fall * first_rates.opacity, t);
    r->scale = adam_rates_at(fall * first_rates.scale, t);
    r->rotation = adam_rates_at(fall * first_rates.rotation, t);
    r->color = adam_rates_at(fall * first_rates.color, t);
    r->harmonics = adam_rates_at(fall * first_rates.harmonics, t);
}

static gbt_status refine_step(refining *r, frame *teacher, const anchors *a, const decoder *d,
                              const gbt_camera *camera, const trace_settings *settings,
                              const uint32_t words[4], gbt_error *err)
{
    gbt_camera sparse = *camera;
    const bool some = gbt_camera_every(camera, PIXEL_STEP, (int)(words[1] % PIXEL_STEP),
                                       (int)(words[2] % PIXEL_STEP), &sparse);
    teacher->draw.pixel_step = r->frame.draw.pixel_step = some ? PIXEL_STEP : 1;
    GBT_TRY(frame_render(teacher, frame_neural(a, d), &sparse, settings, false, err));
    GBT_TRY(frame_render(&r->frame, frame_plain(r->cloud), &sparse, settings, true, err));
    GBT_TRY(image_fit(&r->d_image, sparse.width, sparse.height, 3, err));
    image_loss_result loss;
    GBT_TRY(image_loss(&r->frame.rgb, &teacher->rgb, NULL, IMAGE_DSSIM_WEIGHT, &r->scratch, &r->d_image,
                       &loss, err));
    GBT_TRY(frame_backward_plain(&r->frame, r->cloud, &r->d_image, &r->gradient, err));
    parallel_blocks(r->cloud->count, BLOCK, step_block, r);
    return GBT_OK;
}

gbt_status refine_cloud(frame *teacher, const anchors *a, const decoder *d, const gbt_camera *cameras,
                        size_t camera_count, const trace_settings *settings, const refine_def *def,
                        gaussian_cloud *cloud, gbt_error *err)
{
    if (def->steps < 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "refine: %d steps (wanted 0 or more)", def->steps);
    if (camera_count == 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "refine: no cameras (wanted 1 or more)");
    refining r = {.frame.draw.footprint = teacher->draw.footprint};
    gbt_status status = open_state(&r, cloud, err);
    const int pixel_step = teacher->draw.pixel_step;
    if (status == GBT_OK && def->steps > 0)
        log_count("refine", 0, (uint64_t)def->steps, (double)NAN);
    for (int i = 0; i < def->steps && status == GBT_OK; i++) {
        uint32_t words[4];
        rng_philox(def->seed, STREAM, (uint64_t)i, words);
        set_rates(&r, i, def->steps);
        const size_t at = words[0] % camera_count;
        status = refine_step(&r, teacher, a, d, &cameras[at], &settings[at], words, err);
        log_count("refine", (uint64_t)i + 1, (uint64_t)def->steps, (double)NAN);
    }
    teacher->draw.pixel_step = pixel_step;
    close_state(&r);
    return status;
}
