/* SPDX-License-Identifier: Apache-2.0 */
/* frame/frame.c -- render one view of a model (rays, visibility, Gaussians, tree, trace), and the adjoint. */
#include "frame/frame.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/camera_pose.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "data/scene.h"
#include "frame/one_start.h"
#include "frame/plain.h"
#include "frame/plain_view.h"
#include "frame/visible.h"
#include "trace/pose_gradient.h"

enum { SKY_BLOCK = 4096 };
static const float least_through = 0.01f; /* pixels with less transmittance are left out of the sky's
                                             gradient */

enum { VALID_BLOCK = 1 << 15 /* pixels */ };

void frame_times_add(frame_times *sum, const frame_times *more)
{
    stage_add(&sum->rays, more->rays);
    stage_add(&sum->visible, more->visible);
    stage_add(&sum->decode, more->decode);
    stage_add(&sum->build, more->build);
    stage_add(&sum->trace, more->trace);
    stage_add(&sum->adjoint, more->adjoint);
    stage_add(&sum->decode_adjoint, more->decode_adjoint);
}

/* ---- render and adjoint ---- */

/* Convert a variance from pixels of the full image to pixels of the camera, which may have only every n-th of
   them. */
static float pixel_variance(const frame *f, float variance)
{
    const float step = (float)(f->draw.pixel_step > 1 ? f->draw.pixel_step : 1);
    return variance / (step * step);
}

/* Variance by which splats are dilated, camera pixels^2; 0 with other renderers, and when the Gaussians were
   already widened. */
static float dilation_of(const frame *f)
{
    return f->draw.renderer == GBT_RENDERER_RASTER && !f->widened
               ? pixel_variance(f, raster_settings_default().dilation)
               : 0;
}

/* Smallest pixel size of every Gaussian of the last render; NULL: no limit. */
static const float *pixel_min_of(const frame *f) { return f->pixel_limited ? f->pixel_min : NULL; }

/* Widen f->gaussians by the view's pixel footprint. */
static gbt_status widen(frame *f, frame_subject subject, gbt_error *err)
{
    if (f->pixel_limited) {
        GBT_TRY(mem_reserve((void **)&f->pixel_min, &f->pixel_min_capacity, 0, f->gaussians.count + 1,
                            sizeof *f->pixel_min, "pixel sizes", err));
        for (size_t i = 0; i < f->gaussians.count; i++)
            f->pixel_min[i] = f->draw.anchor_pixel[frame_part(f, subject, i)];
    }
    return footprint_forward(&f->view, pixel_variance(f, f->draw.footprint), pixel_min_of(f), &f->gaussians,
                             &f->wide, err);
}

/* Whether a rasterizer could draw the shot. */
static bool is_plain_view(const ray_shot *shot)
{
    return shot->given == NULL && shot->aperture_radius <= 0 && raster_takes(&shot->camera);
}

/* How much wider than on the edge of the picture a splat beyond it may be drawn: its width grows with the
   slope k of its centre as sqrt(1 + k^2), up to the limits of the projection. 1 for rays. */
static float splats_wider(const frame *f, const gbt_camera *camera)
{
    double low[2], high[2], wider = 1;
    if (f->draw.renderer != GBT_RENDERER_RASTER)
        return 1;
    raster_limits(camera, low, high);
    for (int k = 0; k < 2; k++)
        for (int end = 0; end < 2; end++) {
            const double limit = end == 0 ? low[k] : high[k], other = end == 0 ? high[k] : low[k],
                         edge = limit + 0.15 / 1.3 * (other - limit);
            wider = fmax(wider, (1 + limit * limit) / (1 + edge * edge));
        }
    return (float)sqrt(wider);
}

/* All stages up to building the tree, and f->rays through the middle of the aperture. `tracer` is
   optional. */
static gbt_status prepare(frame *f, frame_subject subject, const ray_shot *shot,
                          const trace_settings *settings, const frame_tracer *tracer, gbt_error *err)
{
    stage_clock clock = stage_begin();
    ray_shot middle = *shot;
    middle.aperture_radius = 0;
    f->camera = shot->camera;
    GBT_TRY(ray_image_from_shot(&middle, 0, &f->rays, err));
    const camera_lens *lens = f->rays.lens.fx > 0 ? &f->rays.lens : NULL; /* NULL when the rays were given */
    memset(f->half_fov_tan, 0, sizeof f->half_fov_tan);
    if (lens != NULL)
        camera_lens_half_fov_tan(lens, shot->camera.width, shot->camera.height, f->half_fov_tan);
    f->times.rays = stage_lap(&clock);
    view_bounds bounds;
    GBT_TRY(view_bounds_find(shot, &f->rays, &bounds, err));
    memcpy(f->eye, bounds.center, sizeof f->eye);
    if (tracer != NULL)
        bounds = view_bounds_none();
    f->by_screen = f->draw.sight == FRAME_SIGHT_BY_ANCHOR && subject.cloud == NULL && tracer == NULL &&
                   is_plain_view(shot);
    if (f->by_screen)
        f->screen = screen_of(&shot->camera, (double)settings->t_near);
    f->view = footprint_view_with(&shot->camera, lens);
    f->pixel_limited = f->draw.anchor_pixel != NULL && subject.cloud == NULL;
    f->widened = f->draw.footprint > 0 && shot->given == NULL; /* given rays have no known width */
    /* sigmas: where the response of an opaque Gaussian falls to alpha_min */
    const visible_reach extent = {
        .sigmas = 1.001f * sqrtf(2 * logf(1 / settings->alpha_min)) * splats_wider(f, &shot->camera),
        .width = sqrtf(f->widened ? pixel_variance(f, f->draw.footprint) : dilation_of(f)),
        .pixel = (float)f->view.pixel,
        .parallel = f->view.kind == FOOTPRINT_PARALLEL,
        .pixel_min = f->pixel_limited ? f->draw.anchor_pixel : NULL};
    GBT_TRY(visible_find(subject, &bounds, &extent, f->by_screen ? &f->screen : NULL, &f->draw.dropout,
                         &f->visible, &f->visible_count, &f->visible_capacity, err));
    f->times.visible = stage_lap(&clock);
    /* A Gaussian with opacity below alpha_min is never blended and has no gradient, so it is not made. */
    if (subject.cloud != NULL)
        GBT_TRY(plain_forward(subject.cloud, f->eye, f->visible, f->visible_count, &f->gaussians, err));
    else
        GBT_TRY(decode_forward(subject.anchors, subject.decoder, f->eye, f->visible, f->visible_count,
                               f->draw.makes_faint ? 0 : settings->alpha_min, &f->gaussians, &f->tape, err));
    if (f->widened)
        GBT_TRY(widen(f, subject, err));
    if (shot->one_start && f->rays.common_origin)
        GBT_TRY(one_start_move(&shot->camera, &f->rays.lens, &f->wide, err));
    f->times.decode = stage_lap(&clock);
    f->times.build = (stage_time){0};
    memset(&f->counters, 0, sizeof f->counters);
    GBT_TRY(image_fit(&f->rgb, f->rays.width, f->rays.height, 3, err));
    if (f->draw.renderer != GBT_RENDERER_TRACE)
        return GBT_OK;
    const float aperture = shot->given == NULL ? (float)shot->aperture_radius : 0;
    const float reach = fmaxf(ray_image_reach(&f->rays) + aperture, tracer != NULL ? tracer->reach : 0);
    GBT_TRY(trace_build(&f->scene, frame_drawn(f), settings, reach, err));
    f->times.build = stage_lap(&clock);
    return GBT_OK;
}

raster_settings frame_splat_settings(const trace_settings *settings, raster_form form)
{
    raster_settings s = raster_settings_default();
    s.form = form;
    s.alpha_min = settings->alpha_min;
    s.alpha_max = settings->alpha_max;
    s.transmittance_min = settings->transmittance_min;
    s.near = settings->t_near;
    memcpy(s.background, settings->background, sizeof s.background);
    s.sky = settings->sky;
    return s;
}

static gbt_status splat(frame *f, const trace_settings *settings, bool keep_tape, float *through,
                        gbt_error *err)
{
    raster_settings s =
        frame_splat_settings(settings, f->draw.renderer == GBT_RENDERER_RASTER ? RASTER_EWA : RASTER_PER_RAY);
    s.dilation = dilation_of(f);
    raster_counters counted = {0};
    GBT_TRY(raster_forward(&f->splats, frame_drawn(f), &f->camera, &s, keep_tape, &f->rgb, through, &counted,
                           err));
    f->counters.rays = counted.pixels;
    f->counters.hits = f->counters.blended = counted.blended;
    return GBT_OK;
}

gbt_status frame_prepare(frame *f, frame_subject subject, const gbt_camera *camera,
                         const trace_settings *settings, gbt_error *err)
{
    const ray_shot shot = ray_shot_of(camera);
    return prepare(f, subject, &shot, settings, NULL, err);
}

gbt_status frame_render(frame *f, frame_subject subject, const gbt_camera *camera,
                        const trace_settings *settings, bool keep_tape, gbt_error *err)
{
    ray_shot shot = ray_shot_of(camera);
    shot.one_start = f->draw.one_start && f->draw.footprint > 0 && !camera_is_still(camera);
    GBT_TRY(prepare(f, subject, &shot, settings, NULL, err));
    stage_clock clock = stage_begin();
    float *through = NULL;
    if (keep_tape && settings->sky.varies) {
        GBT_TRY(mem_reserve((void **)&f->through, &f->through_capacity, 0, ray_image_count(&f->rays),
                            sizeof *f->through, "transmittances", err));
        through = f->through;
    }
    if (f->draw.renderer == GBT_RENDERER_TRACE)
        GBT_TRY(trace_forward(&f->scene, &f->rays, keep_tape,
                              &(trace_outputs){.rgb = &f->rgb, .transmittance = through}, &f->counters, err));
    else
        GBT_TRY(splat(f, settings, keep_tape, through, err));
    f->times.trace = stage_lap(&clock);
    return GBT_OK;
}

static gbt_status trace_sample(frame *f, const ray_shot *shot, int sample, const frame_tracer *tracer,
                               gbt_error *err)
{
    stage_clock clock = stage_begin();
    if (shot->given == NULL && shot->aperture_radius > 0)
        GBT_TRY(ray_image_from_shot(shot, sample, &f->rays, err));
    stage_add(&f->times.rays, stage_lap(&clock));
    if (tracer != NULL)
        GBT_TRY(tracer->trace(tracer->context, &f->scene, &f->rays, &f->rgb, err));
    else
        GBT_TRY(
            trace_forward(&f->scene, &f->rays, false, &(trace_outputs){.rgb = &f->rgb}, &f->counters, err));
    stage_add(&f->times.trace, stage_lap(&clock));
    return GBT_OK;
}

/* Trace all samples and add them, in order, in double. */
static gbt_status trace_samples(frame *f, const ray_shot *shot, const frame_tracer *tracer, double *sum,
                                gbt_error *err)
{
    const size_t values = 3 * ray_image_count(&f->rays);
    const int samples = ray_shot_sample_count(shot);
    for (int s = 0; s < samples; s++) {
        GBT_TRY(trace_sample(f, shot, s, tracer, err));
        for (size_t i = 0; i < values; i++)
            sum[i] += (double)f->rgb.pixels[i];
    }
    for (size_t i = 0; i < values; i++)
        f->rgb.pixels[i] = (float)(sum[i] / samples);
    return GBT_OK;
}

gbt_status frame_render_with(frame *f, frame_subject subject, const ray_shot *shot,
                             const trace_settings *settings, const frame_tracer *tracer, gbt_error *err)
{
    GBT_TRY(ray_shot_check(shot, err));
    if (f->draw.renderer != GBT_RENDERER_TRACE) {
        if (tracer != NULL || shot->given != NULL || shot->aperture_radius > 0 ||
            !camera_is_still(&shot->camera))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "renderer: splats can only draw a still pinhole camera (wanted trace for this "
                             "picture)");
        return frame_render(f, subject, &shot->camera, settings, false, err);
    }
    GBT_TRY(prepare(f, subject, shot, settings, tracer, err));
    f->times.trace = (stage_time){0};
    if (ray_shot_sample_count(shot) == 1)
        return trace_sample(f, shot, 0, tracer, err);
    double *sum = mem_calloc(ray_image_count(&f->rays), 3 * sizeof *sum, "picture", err);
    const gbt_status status = sum == NULL ? GBT_ERR_NO_MEMORY : trace_samples(f, shot, tracer, sum, err);
    mem_free(sum);
    return status;
}

void frame_widen_exact(const frame *f, size_t i, double field[GAUSSIANS_FIELD_COUNT])
{
    footprint_gaussian g; /* its fields are the first fields of GAUSSIANS_FIELDS, in order */
    if (!f->widened)
        return;
    memcpy(&g, field, sizeof g);
    footprint_widen(&f->view, (double)pixel_variance(f, f->draw.footprint),
                    f->pixel_limited ? (double)f->pixel_min[i] : 0, &g);
    memcpy(field, &g, sizeof g);
}

gbt_status frame_backward_gaussians(frame *f, const image *d_image, gbt_error *err)
{
    stage_clock clock = stage_begin();
    GBT_TRY(mem_reserve((void **)&f->blend_weight, &f->blend_weight_capacity, 0, f->gaussians.count + 1,
                        sizeof *f->blend_weight, "weights", err));
    if (f->draw.renderer == GBT_RENDERER_TRACE)
        GBT_TRY(trace_backward(&f->scene, &f->rays, d_image, &f->d_gaussians, f->blend_weight, err));
    else
        GBT_TRY(raster_backward(&f->splats, d_image, &f->d_gaussians, f->blend_weight, err));
    if (f->widened)
        footprint_backward(&f->view, pixel_variance(f, f->draw.footprint), pixel_min_of(f), &f->gaussians,
                           &f->d_gaussians);
    f->times.adjoint = stage_lap(&clock);
    return GBT_OK;
}

gbt_status frame_backward_pose(frame *f, frame_subject subject, double d_pose[6], gbt_error *err)
{
    double d_eye[3];
    if (subject.cloud != NULL)
        GBT_TRY(plain_backward_view(subject.cloud, f->eye, f->visible, f->visible_count, &f->gaussians,
                                    &f->d_gaussians, NULL, d_eye, err));
    else
        GBT_TRY(
            decode_backward_camera(subject.anchors, subject.decoder, &f->tape, &f->d_gaussians, d_eye, err));
    const double eye[3] = {(double)f->eye[0], (double)f->eye[1], (double)f->eye[2]};
    return pose_gradient(&f->gaussians, &f->d_gaussians, &f->camera, eye, d_eye, d_pose, err);
}

typedef struct sky_job {
    const frame *f;
    const sky *sky;
    const image *d_image;
    double (*sums)[SH_COUNT][3]; /* per block */
} sky_job;

static void sum_sky(size_t block, size_t begin, size_t end, void *context)
{
    const sky_job *job = context;
    double(*sum)[3] = job->sums[block];
    for (size_t i = begin; i < end; i++) {
        const float through = job->f->through[i], *d = job->d_image->pixels + 3 * i;
        float y[SH_COUNT];
        if (!(through > least_through))
            continue;
        sky_basis(job->sky, job->f->rays.dir + 3 * i, y);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < SH_COUNT; k++)
                sum[k][c] += (double)(through * d[c] * y[k]);
    }
}

gbt_status frame_backward_sky(const frame *f, const sky *behind, const image *d_image,
                              double d_sky[SH_COUNT][3], gbt_error *err)
{
    const size_t count = ray_image_count(&f->rays), blocks = parallel_block_count(count, SKY_BLOCK);
    sky_job job = {f, behind, d_image, mem_calloc(blocks, sizeof *job.sums, "gradient of the sky", err)};
    if (job.sums == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(count, SKY_BLOCK, sum_sky, &job);
    memset(d_sky, 0, SH_COUNT * sizeof *d_sky);
    for (size_t b = 0; b < blocks; b++)
        for (int k = 0; k < 3 * SH_COUNT; k++)
            d_sky[k / 3][k % 3] += job.sums[b][k / 3][k % 3];
    mem_free(job.sums);
    return GBT_OK;
}

gbt_status frame_backward_anchors(frame *f, const anchors *a, const decoder *d, anchors *d_anchors,
                                  float *d_params, gbt_error *err)
{
    stage_clock clock = stage_begin();
    GBT_TRY(decode_backward(a, d, &f->tape, &f->d_gaussians, d_anchors, d_params, err));
    f->times.decode_adjoint = stage_lap(&clock);
    return GBT_OK;
}

gbt_status frame_backward_plain(frame *f, const gaussian_cloud *cloud, const image *d_image,
                                gaussian_cloud *d_cloud, gbt_error *err)
{
    GBT_TRY(frame_backward_gaussians(f, d_image, err));
    plain_backward(cloud, f->eye, f->visible, f->visible_count, &f->gaussians, &f->d_gaussians, d_cloud);
    return GBT_OK;
}

gbt_status frame_blend_weights(frame *f, gbt_error *err)
{
    image nothing = {0};
    GBT_TRY(image_alloc(&nothing, f->rgb.width, f->rgb.height, 3, err));
    memset(nothing.pixels, 0, 3 * (size_t)nothing.width * (size_t)nothing.height * sizeof *nothing.pixels);
    const gbt_status status = frame_backward_gaussians(f, &nothing, err);
    image_free(&nothing);
    return status;
}

static bool has_ray(const ray_image *rays, size_t i)
{
    const float *d = rays->dir + 3 * i;
    return d[0] != 0 || d[1] != 0 || d[2] != 0;
}

typedef struct valid_job {
    const ray_image *rays;
    const unsigned char *photo;
    unsigned char *out;
    atomic_bool missing; /* whether a pixel has no ray */
} valid_job;

static void look_for_missing(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    valid_job *job = context;
    bool missing = false;
    for (size_t i = begin; i < end; i++)
        missing |= !has_ray(job->rays, i);
    if (missing)
        atomic_store(&job->missing, true);
}

static void mark_valid(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const valid_job *job = context;
    for (size_t i = begin; i < end; i++)
        job->out[i] = (job->photo == NULL || job->photo[i] != 0) && has_ray(job->rays, i);
}

gbt_status frame_valid(frame *f, const unsigned char *photo, const unsigned char **out, gbt_error *err)
{
    const size_t count = ray_image_count(&f->rays);
    valid_job job = {.rays = &f->rays, .photo = photo};
    atomic_init(&job.missing, false);
    parallel_blocks(count, VALID_BLOCK, look_for_missing, &job);
    *out = photo;
    if (!atomic_load(&job.missing))
        return GBT_OK;
    GBT_TRY(mem_reserve((void **)&f->valid, &f->valid_capacity, 0, count, 1, "valid pixels", err));
    job.out = f->valid;
    parallel_blocks(count, VALID_BLOCK, mark_valid, &job);
    *out = f->valid;
    return GBT_OK;
}

gbt_status frame_read_photo(frame *f, const scene_view *view, image *photo, const unsigned char **valid,
                            gbt_error *err)
{
    mem_free(f->photo_valid);
    GBT_TRY(scene_read_photo_valid(view, f->rays.width, f->rays.height, photo, &f->photo_valid, err));
    return frame_valid(f, f->photo_valid, valid, err);
}

void frame_free(frame *f)
{
    ray_image_free(&f->rays);
    mem_free(f->visible);
    mem_free(f->pixel_min);
    mem_free(f->blend_weight);
    mem_free(f->through);
    mem_free(f->valid);
    mem_free(f->photo_valid);
    gaussians_free(&f->gaussians);
    gaussians_free(&f->wide);
    gaussians_free(&f->d_gaussians);
    decode_tape_free(&f->tape);
    trace_scene_free(&f->scene);
    raster_scene_free(&f->splats);
    image_free(&f->rgb);
    memset(f, 0, sizeof *f);
}
