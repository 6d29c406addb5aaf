/* SPDX-License-Identifier: Apache-2.0 */
/* library/open.c -- open models from files and arrays, and answer questions about them. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "library/handle.h"

static gbt_status make(gbt_model **out, gbt_error *err)
{
    *out = mem_calloc(1, sizeof **out, "model", err);
    return *out != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

/* Return `m` in *out if opening it succeeded; otherwise close it. */
static gbt_status opened(gbt_model *m, gbt_status status, gbt_model **out)
{
    m->run.frame.draw.renderer = GBT_RENDERER_TRACE;
    m->settings = m->run.settings;
    *out = status == GBT_OK ? m : NULL;
    if (status != GBT_OK)
        gbt_model_close(m);
    return status;
}

gbt_status gbt_model_open(const char *path, gbt_model **out, gbt_error *err)
{
    PLAIN_NUMBERS;
    gbt_model *m;
    *out = NULL;
    GBT_TRY(make(&m, err));
    snprintf(m->path, sizeof m->path, "%s", path); /* longer paths cannot be opened */
    return opened(m, loaded_run_open_model(path, &m->run, err), out);
}

void gbt_model_close(gbt_model *m)
{
    if (m == NULL)
        return;
    loaded_run_close(&m->run);
    mem_free(m->quat_length);
    mem_free(m->raised);
    gaussian_cloud_free(&m->gradient);
    mem_free(m->d_mean);
    mem_free(m);
}

/* ---- the caller's Gaussians ---- */

static const float below_one = 1 - FLT_EPSILON;

typedef struct value_range {
    const char *name;
    const float *values;
    size_t width;
    float low, high;
} value_range;

static gbt_status check(const gbt_gaussians *g, gbt_error *err)
{
    if (g->count < 1 || g->count > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "gaussians: %zu (wanted 1 to 2^32 - 1)", g->count);
    if (g->sh_degree < 0 || g->sh_degree > 3)
        return base_fail(err, GBT_ERR_ARGUMENT, "gaussians: sh_degree %d (wanted 0 to 3)", g->sh_degree);
    const size_t functions = (size_t)((g->sh_degree + 1) * (g->sh_degree + 1));
    const float far = 1e17f, large = 1e18f, log_limit = GAUSSIAN_SCALE_LOG_LIMIT;
    const value_range ranges[] = {{"mean", g->mean, 3, -far, far},
                                  {"scale_log", g->scale_log, 3, -log_limit, log_limit},
                                  {"quat", g->quat, 4, -large, large},
                                  {"opacity", g->opacity, 1, 0, 1},
                                  {"sh", g->sh, 3 * functions, -large, large}};
    for (size_t k = 0; k < sizeof ranges / sizeof *ranges; k++) {
        const value_range *r = &ranges[k];
        if (r->values == NULL)
            return base_fail(err, GBT_ERR_ARGUMENT, "gaussians: %s is NULL", r->name);
        for (size_t i = 0; i < g->count * r->width; i++)
            if (!(r->values[i] >= r->low && r->values[i] <= r->high))
                return base_fail(err, GBT_ERR_ARGUMENT,
                                 "gaussians: %s of Gaussian %zu is %g (wanted %g to %g)", r->name,
                                 i / r->width, (double)r->values[i], (double)r->low, (double)r->high);
    }
    return GBT_OK;
}

/* Copy the caller's Gaussians into the form in which files are read. Records what that changed: the length of
   each quaternion, and which scales were raised. */
static gbt_status copy(const gbt_gaussians *g, gaussian_cloud *cloud, float *quat_length,
                       unsigned char *raised, gbt_error *err)
{
    const size_t width = 3 * (size_t)((g->sh_degree + 1) * (g->sh_degree + 1));
    cloud->sh_degree = g->sh_degree;
    memcpy(cloud->mean, g->mean, 3 * g->count * sizeof *g->mean);
    memcpy(cloud->scale_log, g->scale_log, 3 * g->count * sizeof *g->scale_log);
    memcpy(cloud->opacity, g->opacity, g->count * sizeof *g->opacity);
    memset(cloud->sh, 0, g->count * GAUSSIAN_SH_COUNT * 3 * sizeof *cloud->sh);
    for (size_t i = 0; i < g->count; i++) {
        const float *q = g->quat + 4 * i;
        double square = 0;
        for (int k = 0; k < 4; k++)
            square += (double)q[k] * (double)q[k];
        const double length = sqrt(square);
        if (!(length >= 1e-18))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "gaussians: quat of Gaussian %zu has length %g (wanted 1e-18 or more)", i,
                             length);
        quat_length[i] = (float)length;
        for (size_t k = 0; k < 4; k++)
            cloud->quat[4 * i + k] = (float)((double)q[k] / length);
        memcpy(cloud->sh + i * GAUSSIAN_SH_COUNT * 3, g->sh + i * width, width * sizeof *g->sh);
        gaussian_limit_scales(cloud->scale_log + 3 * i);
        raised[i] = 0;
        for (size_t k = 0; k < 3; k++)
            raised[i] |= (unsigned char)((cloud->scale_log[3 * i + k] > g->scale_log[3 * i + k]) << k);
    }
    return GBT_OK;
}

gbt_status gbt_model_set_gaussians(gbt_model *m, const gbt_gaussians *g, gbt_error *err)
{
    PLAIN_NUMBERS;
    if (m->run.cloud.count == 0 && m->run.model.anchors.count > 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "model: its Gaussians are decoded by networks (wanted a model of plain Gaussians)");
    GBT_TRY(check(g, err));
    gaussian_cloud cloud = {0};
    GBT_TRY(gaussian_cloud_alloc(&cloud, g->count, err));
    float *quat_length = mem_alloc(g->count, sizeof *quat_length, "quaternions", err);
    unsigned char *raised = mem_alloc(g->count, sizeof *raised, "scales", err);
    const gbt_status status =
        quat_length == NULL || raised == NULL ? GBT_ERR_NO_MEMORY : copy(g, &cloud, quat_length, raised, err);
    if (status != GBT_OK) {
        gaussian_cloud_free(&cloud);
        mem_free(quat_length);
        mem_free(raised);
        return status;
    }
    loaded_run_take_cloud(&m->run, &cloud);
    mem_free(m->quat_length);
    m->quat_length = quat_length;
    mem_free(m->raised);
    m->raised = raised;
    m->kept = false;
    return GBT_OK;
}

gbt_status gbt_model_from_gaussians(const gbt_gaussians *g, gbt_model **out, gbt_error *err)
{
    gbt_model *m;
    *out = NULL;
    GBT_TRY(make(&m, err));
    loaded_run_draw_plain(&m->run);
    return opened(m, gbt_model_set_gaussians(m, g, err), out);
}

gbt_status gbt_model_get_gaussians(const gbt_model *m, float *mean, float *scale_log, float *quat,
                                   float *opacity, float *sh, gbt_error *err)
{
    const gaussian_cloud *c = &m->run.cloud;
    const size_t n = c->count, width = 3 * (size_t)((c->sh_degree + 1) * (c->sh_degree + 1));
    if (n == 0)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "model: its Gaussians are decoded by networks for each view (wanted plain "
                         "Gaussians: export it first)");
    for (size_t i = 0; i < 3 * n && mean != NULL; i++)
        mean[i] = (float)((double)c->mean[i] + m->run.model.origin[i % 3]);
    copy_floats(c->scale_log, 3 * n, scale_log);
    copy_floats(c->quat, 4 * n, quat);
    copy_floats(c->opacity, n, opacity);
    for (size_t i = 0; i < n && sh != NULL; i++)
        copy_floats(c->sh + i * GAUSSIAN_SH_COUNT * 3, width, sh + i * width);
    return GBT_OK;
}

/* ---- queries ---- */

gbt_model_info gbt_model_get_info(const gbt_model *m)
{
    const loaded_run *r = &m->run;
    const anchors *a = &r->model.anchors;
    const bool plain = r->cloud.count > 0;
    const size_t count = plain ? r->cloud.count : a->count;
    const float *position = plain ? r->cloud.mean : a->position;
    gbt_model_info info = {.gaussians = plain ? count : count * (size_t)a->offset_count,
                           .anchors = plain ? 0 : count,
                           .sh_degree = plain ? r->cloud.sh_degree : -1,
                           .iterations = r->model.iterations};
    for (int k = 0; k < 3 && count > 0; k++) {
        info.low[k] = HUGE_VAL;
        info.high[k] = -HUGE_VAL;
    }
    for (size_t i = 0; i < 3 * count; i++) {
        const double world = (double)position[i] + r->model.origin[i % 3];
        info.low[i % 3] = fmin(info.low[i % 3], world);
        info.high[i % 3] = fmax(info.high[i % 3], world);
    }
    return info;
}

gbt_model_settings gbt_model_get_settings(const gbt_model *m)
{
    const trace_settings *s = &m->settings;
    return (gbt_model_settings){.background = {s->background[0], s->background[1], s->background[2]},
                                .footprint = m->run.frame.draw.footprint,
                                .t_near = s->t_near,
                                .alpha_min = s->alpha_min,
                                .alpha_max = s->alpha_max,
                                .transmittance_min = s->transmittance_min};
}

gbt_status gbt_model_set_settings(gbt_model *m, const gbt_model_settings *settings, gbt_error *err)
{
    PLAIN_NUMBERS;
    const gbt_model_settings *g = settings;
    for (int k = 0; k < 3; k++)
        if (!isfinite(g->background[k]))
            return base_fail(err, GBT_ERR_ARGUMENT, "settings: background %g (wanted finite)",
                             (double)g->background[k]);
    const value_range ranges[] = {{"footprint", &g->footprint, 1, 0, 4},
                                  {"t_near", &g->t_near, 1, 0, 1e17f},
                                  {"alpha_min", &g->alpha_min, 1, 1e-30f, below_one},
                                  {"alpha_max", &g->alpha_max, 1, FLT_MIN, below_one},
                                  {"transmittance_min", &g->transmittance_min, 1, FLT_MIN, below_one}};
    for (size_t k = 0; k < sizeof ranges / sizeof *ranges; k++)
        if (!(*ranges[k].values >= ranges[k].low && *ranges[k].values <= ranges[k].high))
            return base_fail(err, GBT_ERR_ARGUMENT, "settings: %s %g (wanted %.8g to %.8g)", ranges[k].name,
                             (double)*ranges[k].values, (double)ranges[k].low, (double)ranges[k].high);
    if (g->alpha_max < g->alpha_min)
        return base_fail(err, GBT_ERR_ARGUMENT, "settings: alpha_max %g (wanted alpha_min, %g, or more)",
                         (double)g->alpha_max, (double)g->alpha_min);
    trace_settings *s = &m->settings;
    if (memcmp(s->background, g->background, sizeof s->background) != 0)
        s->sky.varies = false;
    memcpy(s->background, g->background, sizeof s->background);
    s->t_near = g->t_near;
    s->alpha_min = g->alpha_min;
    s->alpha_max = g->alpha_max;
    s->transmittance_min = g->transmittance_min;
    m->run.frame.draw.footprint = g->footprint;
    m->kept = false;
    return GBT_OK;
}

gbt_status gbt_model_open_views(gbt_model *m, const char *data, size_t *count, gbt_error *err)
{
    PLAIN_NUMBERS;
    *count = 0;
    loaded_run_close_views(&m->run);
    if (data == NULL && m->path[0] == '\0')
        return base_fail(err, GBT_ERR_ARGUMENT, "model: made from arrays, it has no cameras (wanted `data`)");
    GBT_TRY(loaded_run_open_views(m->path, data, 0, &m->run, err));
    *count = m->run.scene.view_count;
    return GBT_OK;
}

gbt_status gbt_model_get_view(const gbt_model *m, size_t index, gbt_model_view *out, gbt_error *err)
{
    const loaded_run *r = &m->run;
    if (r->photos.source == NULL || index >= r->scene.view_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "view %zu: there are %zu open", index,
                         r->photos.source == NULL ? 0 : r->scene.view_count);
    const scene_view *view = &r->scene.views[index];
    *out = (gbt_model_view){.name = view->name,
                            .held_out = view->is_test,
                            .camera = photos_camera(&r->photos, index, 0),
                            .t_near = loaded_run_settings(r, index).t_near};
    for (int k = 0; k < 3; k++)
        out->camera.center[k] += r->model.origin[k];
    return GBT_OK;
}
