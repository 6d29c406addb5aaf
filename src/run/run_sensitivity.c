/* SPDX-License-Identifier: Apache-2.0 */
/* run/run_sensitivity.c -- estimate sensitivities by adjoint passes with random signs through the training
   views. */
#include "run/run_sensitivity.h"

#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"
#include "base/stop_signal.h"
#include "train/step_pixels.h"

enum { VIEWS_MAX = 64, PROBE_PIXELS = 50000, SEED = 11 };

typedef struct probe {
    image signs;
    anchors d_anchors;
    float *d_params;
} probe;

/* Half the run's resolution, with at most about PROBE_PIXELS pixels, gives the same estimate as all
   pixels. */
static gbt_camera probe_camera(const loaded_run *r, size_t view, int *spacing)
{
    const gbt_camera full = photos_camera(&r->photos, view, 0);
    const gbt_camera all = full.width < 16 || full.height < 16 ? full : photos_camera(&r->photos, view, 1);
    gbt_camera some = all;
    *spacing = step_spacing(&all, PROBE_PIXELS);
    if (!gbt_camera_every(&all, *spacing, *spacing / 2, *spacing / 2, &some))
        *spacing = 1;
    return some;
}

static gbt_status add_view(loaded_run *r, size_t view, probe *p, model_sensitivity *out, gbt_error *err)
{
    const anchors *a = &r->model.anchors;
    const gbt_camera camera = probe_camera(r, view, &r->frame.draw.pixel_step);
    const trace_settings settings = loaded_run_settings(r, view);
    GBT_TRY(frame_render(&r->frame, frame_neural(a, &r->model.decoder), &camera, &settings, true, err));
    GBT_TRY(image_fit(&p->signs, camera.width, camera.height, 3, err));
    const size_t values = (size_t)camera.width * (size_t)camera.height * 3;
    for (size_t i = 0; i < values; i++)
        p->signs.pixels[i] = rng_uniform(SEED, view, i) < 0.5f ? -1.0f : 1.0f;
    anchors_zero_learned(&p->d_anchors);
    GBT_TRY(frame_backward_gaussians(&r->frame, &p->signs, err));
    GBT_TRY(frame_backward_anchors(&r->frame, a, &r->model.decoder, &p->d_anchors, p->d_params, err));
    model_sensitivity_add(out, a, &p->d_anchors, (double)values);
    return GBT_OK;
}

static gbt_status add_views(loaded_run *r, size_t count, model_sensitivity *out, gbt_error *err)
{
    probe p = {.d_anchors.offset_count = r->model.anchors.offset_count};
    gbt_status status = anchors_resize(&p.d_anchors, r->model.anchors.count, err);
    p.d_params = mem_calloc(r->model.decoder.param_count, sizeof *p.d_params, "gradient", err);
    if (status == GBT_OK && p.d_params == NULL)
        status = GBT_ERR_NO_MEMORY;
    const size_t wanted = count < VIEWS_MAX ? count : VIEWS_MAX;
    size_t training = 0;
    for (size_t view = 0; view < r->scene.view_count && status == GBT_OK; view++) {
        if (r->scene.views[view].is_test)
            continue;
        if (stop_signal_seen())
            status = base_fail(err, GBT_ERR_INTERRUPTED, MAKING_SMALL_STOPPED);
        else if ((training + 1) * wanted / count > training * wanted / count) /* evenly choose `wanted` of
                                                                                 `count` views */
            status = add_view(r, view, &p, out, err);
        training++;
    }
    image_free(&p.signs);
    anchors_free(&p.d_anchors);
    mem_free(p.d_params);
    return status;
}

gbt_status run_sensitivity(loaded_run *r, model_sensitivity *out, gbt_error *err)
{
    size_t count = 0;
    for (size_t view = 0; view < r->scene.view_count; view++)
        count += !r->scene.views[view].is_test;
    if (count == 0 || r->model.anchors.count == 0)
        return model_sensitivity_guess(&r->model, out, err);
    GBT_TRY(model_sensitivity_start(out, r->model.anchors.count, err));
    const gbt_status status = add_views(r, count, out, err);
    r->frame.draw.pixel_step = 1;
    model_sensitivity_end(out);
    return status;
}
