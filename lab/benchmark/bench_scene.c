/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/bench_scene.c -- what benchmarks and studies trace: the Gaussians of a .ply or of a run, and the
   rays of one camera. */
#include "benchmark/bench_scene.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "data/gaussian_file.h"
#include "data/gaussian_ply.h"

/* Colour of a 3DGS Gaussian from its centre's direction: degree 0 only, so that the workload is tracing and
   nothing else. */
static gbt_status gaussians_from_ply(const char *path, gaussians *out, gbt_error *err)
{
    gaussian_cloud cloud;
    GBT_TRY(gaussian_ply_load(path, &cloud, err));
    const gbt_status status = gaussians_resize(out, cloud.count, err);
    for (size_t i = 0; status == GBT_OK && i < cloud.count; i++) {
        out->mean_x[i] = cloud.mean[3 * i];
        out->mean_y[i] = cloud.mean[3 * i + 1];
        out->mean_z[i] = cloud.mean[3 * i + 2];
        out->scale_x[i] = expf(cloud.scale_log[3 * i]), out->scale_y[i] = expf(cloud.scale_log[3 * i + 1]),
        out->scale_z[i] = expf(cloud.scale_log[3 * i + 2]);
        out->quat_w[i] = cloud.quat[4 * i], out->quat_x[i] = cloud.quat[4 * i + 1],
        out->quat_y[i] = cloud.quat[4 * i + 2], out->quat_z[i] = cloud.quat[4 * i + 3];
        out->opacity[i] = cloud.opacity[i];
        const float *sh = cloud.sh + i * GAUSSIAN_SH_COUNT * 3;
        out->red[i] = fmaxf(0, 0.5f + 0.28209479f * sh[0]),
        out->green[i] = fmaxf(0, 0.5f + 0.28209479f * sh[1]),
        out->blue[i] = fmaxf(0, 0.5f + 0.28209479f * sh[2]);
    }
    if (status == GBT_OK)
        gaussians_pad(out);
    gaussian_cloud_free(&cloud);
    return status;
}

static bool is_ply(const char *path)
{
    const size_t length = strlen(path);
    return length > 4 && strcmp(path + length - 4, ".ply") == 0;
}

bool bench_scene_needs_camera(const char *path)
{
    return gaussian_file_readable(path) && !file_is_folder(path);
}

static gbt_status open_ply(const char *path, const char *camera, bench_scene *out, gbt_error *err)
{
    GBT_TRY(gaussians_from_ply(path, &out->from_ply, err));
    out->gaussians = &out->from_ply;
    out->settings = trace_settings_default();
    return camera_file_read(camera, (const double[3]){0, 0, 0}, &out->camera, err);
}

static gbt_status open_run(const char *path, const char *camera, bench_scene *out, gbt_error *err)
{
    loaded_run *run = out->run = mem_calloc(1, sizeof *run, "run", err);
    if (run == NULL)
        return GBT_ERR_NO_MEMORY;
    if (camera != NULL) {
        GBT_TRY(loaded_run_open_model(path, run, err));
        GBT_TRY(camera_file_read(camera, run->model.origin, &out->camera, err));
    } else {
        GBT_TRY(loaded_run_open(path, NULL, 0, run, err));
        size_t view = 0;
        while (view + 1 < run->scene.view_count && !run->scene.views[view].is_test)
            view++;
        const gbt_camera taken = photos_camera(&run->photos, view, 0);
        out->camera.shot = ray_shot_of(&taken);
    }
    out->settings = run->settings;
    run->frame.draw.renderer =
        GBT_RENDERER_TRACE; /* of a run trained with splats too: who measures chooses */
    return GBT_OK;
}

gbt_status bench_scene_open(const char *path, const char *camera, bench_scene *out, gbt_error *err)
{
    if (camera == NULL && bench_scene_needs_camera(path))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "%.300s: plain Gaussians know no cameras (wanted --camera FILE.json)", path);
    return is_ply(path) ? open_ply(path, camera, out, err) : open_run(path, camera, out, err);
}

gbt_status bench_scene_decode(bench_scene *s, gbt_error *err)
{
    if (s->run != NULL) {
        GBT_TRY(frame_render_with(&s->run->frame, loaded_run_subject(s->run), &s->camera.shot, &s->settings,
                                  NULL, err));
        s->gaussians = frame_drawn(&s->run->frame);
    }
    return ray_image_from_shot(&s->camera.shot, 0, &s->rays, err);
}

void bench_scene_close(bench_scene *s)
{
    camera_file_free(&s->camera);
    ray_image_free(&s->rays);
    gaussians_free(&s->from_ply);
    if (s->run != NULL)
        loaded_run_close(s->run);
    mem_free(s->run);
    memset(s, 0, sizeof *s);
}
