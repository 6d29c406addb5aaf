/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_scene.c -- the input of benchmarks and studies: Gaussians, plain or decoded from a run, and
   the rays of one camera. */
#include "benchmark/bench_scene.h"

#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "data/gaussian_file.h"

bool bench_scene_needs_camera(const char *path)
{
    return gaussian_file_readable(path) && !file_is_folder(path);
}

gbt_status bench_scene_open(const char *path, const char *camera, bench_scene *out, gbt_error *err)
{
    loaded_run *run = &out->run;
    const bool is_plain = bench_scene_needs_camera(path);
    if (camera == NULL && is_plain)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%.300s: plain Gaussians have no cameras (wanted --camera FILE.json)", path);
    GBT_TRY(loaded_run_open_model(path, run, err));
    if (camera != NULL) {
        GBT_TRY(camera_file_read(camera, run->model.origin, &out->camera, err));
    } else {
        GBT_TRY(loaded_run_open_own_views(path, run, err));
        size_t view = 0;
        while (view + 1 < run->scene.view_count && !run->scene.views[view].is_test)
            view++;
        const gbt_camera taken = photos_camera(&run->photos, view, 0);
        out->camera.shot = ray_shot_of(&taken);
    }
    out->settings = run->settings;
    run->frame.draw.renderer =
        GBT_RENDERER_TRACE; /* also for a run trained with splats: the caller chooses the renderer */
    out->is_plain = is_plain;
    if (is_plain)
        run->frame.draw.footprint = 0; /* the Gaussians exactly as in the file */
    return GBT_OK;
}

static gbt_status trace_rays(void *context, trace_scene *built, const ray_image *rays, image *rgb,
                             gbt_error *err)
{
    (void)context;
    return trace_forward(built, rays, false, &(trace_outputs){.rgb = rgb}, NULL, err);
}

gbt_status bench_scene_decode(bench_scene *s, gbt_error *err)
{
    const frame_tracer whole = {.trace = trace_rays}; /* given a tracer, nothing is left out */
    GBT_TRY(frame_render_with(&s->run.frame, loaded_run_subject(&s->run), &s->camera.shot, &s->settings,
                              s->is_plain ? &whole : NULL, err));
    s->gaussians = frame_drawn(&s->run.frame);
    return ray_image_from_shot(&s->camera.shot, 0, &s->rays, err);
}

void bench_scene_close(bench_scene *s)
{
    camera_file_free(&s->camera);
    ray_image_free(&s->rays);
    loaded_run_close(&s->run);
    memset(s, 0, sizeof *s);
}
