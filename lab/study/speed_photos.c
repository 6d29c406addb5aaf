/* SPDX-License-Identifier: Apache-2.0 */
/* study/speed_photos.c -- how well the pictures of each setting of the study "speed" match the held-out
   photos. */
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "benchmark/bench_scene.h"
#include "image/metrics.h"
#include "study/speed.h"

/* Draw the current view of `s`, which has its own near distance, with the settings of a row. */
static gbt_status draw(const bench_scene *s, const speed_row *row, trace_scene *traced,
                       raster_scene *splatted, image *rgb, gbt_error *err)
{
    trace_settings settings = row->settings;
    settings.t_near = s->settings.t_near;
    if (!row->splats) {
        GBT_TRY(trace_build(traced, s->gaussians, &settings, ray_image_reach(&s->rays), err));
        return trace_forward(traced, &s->rays, false, &(trace_outputs){.rgb = rgb}, NULL, err);
    }
    const raster_settings splat = frame_splat_settings(&settings, row->form);
    return raster_forward(splatted, row->form == RASTER_EWA ? &s->run.frame.gaussians : s->gaussians,
                          &s->camera.shot.camera, &splat, false, rgb, NULL, NULL, err);
}

/* Whether a row needs a picture of its own: other kernels and instruction sets give the default's picture. */
static bool is_own_picture(const speed_row *row)
{
    return !row->is_default && row->knob != KNOB_KERNEL && row->knob != KNOB_ISA;
}

/* Score a view as gbtrace eval does. A photo that is masked completely is skipped for all rows. */
static gbt_status score_view(bench_scene *s, size_t view, speed_model *out, gbt_error *err)
{
    const gbt_camera camera = photos_camera(&s->run.photos, view, 0);
    s->camera.shot = ray_shot_of(&camera);
    s->settings.t_near = loaded_run_settings(&s->run, view).t_near;
    GBT_TRY(bench_scene_decode(s, err));
    image photo = {0}, copy = {0}, rgb = {0};
    trace_scene traced = {0};
    raster_scene splatted = {0};
    const unsigned char *valid = NULL;
    bool counts = true;
    gbt_status status = frame_read_photo(&s->run.frame, &s->run.scene.views[view], &photo, &valid, err);
    if (status == GBT_OK)
        status = image_alloc(&rgb, camera.width, camera.height, 3, err);
    if (status == GBT_OK)
        status = image_alloc(&copy, camera.width, camera.height, 3, err);
    for (size_t i = 0; i < out->row_count && status == GBT_OK && counts; i++) {
        image_scores scores = {0};
        if (!is_own_picture(&out->rows[i]))
            continue;
        status = draw(s, &out->rows[i], &traced, &splatted, &rgb, err);
        if (status != GBT_OK)
            break;
        memcpy(copy.pixels, photo.pixels, 3 * ray_image_count(&s->rays) * sizeof *copy.pixels);
        status = image_score_photo(&rgb, &copy, valid, s->run.def.exposure, NULL, &scores, err);
        counts = isfinite(scores.psnr);
        out->rows[i].photo_psnr += counts ? scores.psnr : 0;
    }
    out->photo_count += counts;
    trace_scene_free(&traced);
    raster_scene_free(&splatted);
    image_free(&photo);
    image_free(&copy);
    image_free(&rgb);
    return status;
}

gbt_status speed_measure_photos(bench_scene *s, speed_model *out, gbt_error *err)
{
    if (s->run.scene.view_count == 0)
        return GBT_OK;
    for (size_t i = 0; i < out->row_count; i++)
        out->rows[i].photo_psnr = 0;
    for (size_t view = 0; view < s->run.scene.view_count; view++)
        if (s->run.scene.views[view].is_test)
            GBT_TRY(score_view(s, view, out, err));
    for (size_t i = 0; i < out->row_count; i++) /* the second row is the preset "default" */
        out->rows[i].photo_psnr = is_own_picture(&out->rows[i])
                                      ? out->rows[i].photo_psnr / (double)out->photo_count
                                      : out->rows[1].photo_psnr;
    return GBT_OK;
}
