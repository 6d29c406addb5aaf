/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/check_grad.c -- gradients on the user's own scene: renderers and decode against the same in
   double, the whole chain against differences. docs/gradients.md.

   tracer      float adjoint of the image gradient      | reference_scene_backward() on the same Gaussians
   rasterizer  the same                                 | raster_reference_backward()
   per-ray     the same                                 | reference_scene_backward()
   decode      float adjoint of the Gaussians' gradient | decode_ref_backward() on the same anchors
   chain       float gradient of the training loss g    | d . g against central differences of the loss,
                                                        | all of it in double; by the tracer

   For normally distributed directions d, E[(d . (g - g'))^2] = |g - g'|^2: a few directions estimate the
   relative L2 error of a class of parameters, whatever its size. */
#include <math.h>
#include <string.h>

#include "anchor/decode_ref.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "image/metrics.h"
#include "lab/lab.h"
#include "raster/raster_ref.h"
#include "run/loaded_run.h"
#include "trace/reference.h"
#include "trace/rounding_band.h"
#include "train/loss.h"

enum {
    CHECK_WIDTH = 48,
    CHECK_WIDTH_LARGE = 24,
    LARGE_COUNT = 50000,
    RAY_GRAIN = 16,
    ANCHOR_GRAIN = 256,
    DIRECTIONS = 3,
    ATTEMPTS = 24
};

/* What float32 leaves. A trained scene has Gaussians that are 1e-5 of their distance thin, where the rounding
   of coordinates alone is 1e-2 of a std-dev: the renderers' limit is five times that of the tests' random
   scenes. The chain's is wider again: its two sides do not decode the same bits, so a hit in ten thousand
   falls on the other side of a cut. */
static const double renderer_limit = 5e-5, decode_limit = 1e-5, chain_limit = 1e-3;

static const double colour_limit = 1e-5; /* between splats in float and in double that blend the same */
static const double step =
    1e-8; /* of a difference, in standard deviations of the direction: few cuts are crossed */
static const double smooth_limit =
    1e-4; /* the differences to both sides agree to this part of the gradient, or a cut was crossed */
static const double gradient_floor = 1e-6; /* below it a difference of double losses is rounding */

typedef struct checker {
    loaded_run *run;
    frame *frame; /* of `run` */
    size_t view;
    int width, height;
    size_t ray_count;
    image photo, d_image, d_masked; /* d_masked: 0 on rays that are left out of a renderer's rows */
    unsigned char *valid;           /* [rays], NULL: all count */
    size_t valid_count;
    loss_scratch scratch;
    gaussians d_gaussians;
    float *weight; /* [Gaussians]: T alpha summed over rays */
    anchors d_anchors;
    float *d_params;
    reference_scene scene; /* all Gaussians of the frame */
    decode_ref parameters, d_parameters;
    double *slots, *d_slots; /* [visible * K][DECODE_REF_FIELDS] */
    double *rgb;
    double *terms[3];        /* [rays][3]: every pixel's share of the loss at 0, -step, +step */
    double gaussian_loss[3]; /* the Gaussians' own terms, the same */
    double camera[3];        /* as the decoder gets it, rounded to float */
    FILE *out;
    size_t broken;
} checker;

static void print_row(checker *c, const char *stage, const char *class, double error, double limit)
{
    const bool fine = error <= limit; /* false for NaN */
    fprintf(c->out, "%-12s%-12s%12.1e%12.0e%s\n", stage, class, error, limit, fine ? "" : "  broken");
    c->broken += !fine;
}

/* ---- set up ---- */

static gbt_status render_at(checker *c, size_t view, int width, gbt_error *err)
{
    const gbt_camera full = photos_camera(&c->run->photos, view, 0);
    c->width = full.width < width ? full.width : width;
    c->height = (int)fmax(1, floor((double)full.height * c->width / full.width + 0.5));
    c->ray_count = (size_t)c->width * (size_t)c->height;
    const gbt_camera camera = gbt_camera_resized(&full, c->width, c->height);
    for (int k = 0; k < 3; k++)
        c->camera[k] = (double)(float)camera.center[k];
    return frame_render(c->frame, frame_neural(&c->run->model.anchors, &c->run->model.decoder), &camera,
                        &c->run->settings, true, err);
}

static gbt_status allocate(checker *c, gbt_error *err)
{
    const size_t slot_count = c->frame->visible_count * (size_t)c->run->model.anchors.offset_count;
    GBT_TRY(image_alloc(&c->d_image, c->width, c->height, 3, err));
    GBT_TRY(image_alloc(&c->d_masked, c->width, c->height, 3, err));
    GBT_TRY(reference_scene_make(frame_drawn(c->frame), &c->scene, err));
    GBT_TRY(decode_ref_load(&c->parameters, &c->run->model.anchors, &c->run->model.decoder, err));
    GBT_TRY(decode_ref_zero(&c->d_parameters, &c->parameters, err));
    c->d_anchors.offset_count = c->run->model.anchors.offset_count;
    GBT_TRY(anchors_resize(&c->d_anchors, c->run->model.anchors.count, err)); /* new rows are zero */
    c->weight = mem_calloc(c->scene.count, sizeof *c->weight, "check weights", err);
    c->d_params = mem_calloc(c->run->model.decoder.param_count, sizeof *c->d_params, "check gradient", err);
    c->slots = mem_calloc(slot_count, DECODE_REF_FIELDS * sizeof *c->slots, "check slots", err);
    c->d_slots = mem_calloc(slot_count, DECODE_REF_FIELDS * sizeof *c->d_slots, "check slots", err);
    c->rgb = mem_calloc(c->ray_count, 3 * sizeof *c->rgb, "check image", err);
    bool fine =
        c->weight != NULL && c->d_params != NULL && c->slots != NULL && c->d_slots != NULL && c->rgb != NULL;
    for (int i = 0; i < 3; i++) {
        c->terms[i] = mem_calloc(c->ray_count, 3 * sizeof *c->terms[i], "check loss", err);
        fine = fine && c->terms[i] != NULL;
    }
    return fine ? GBT_OK : GBT_ERR_NO_MEMORY;
}

/* The first held-out view (the first one, when none is held out), small: the reference asks every Gaussian
   about every ray. */
static gbt_status set_up(checker *c, gbt_error *err)
{
    const scene *s = &c->run->scene;
    size_t view = 0;
    while (view < s->view_count && !s->views[view].is_test)
        view++;
    if (view == s->view_count)
        view = 0;
    c->view = view;
    GBT_TRY(render_at(c, view, CHECK_WIDTH, err));
    if (c->frame->gaussians.count > LARGE_COUNT)
        GBT_TRY(render_at(c, view, CHECK_WIDTH_LARGE, err));
    GBT_TRY(scene_read_photo_valid(&s->views[view], c->width, c->height, &c->photo, &c->valid, err));
    for (size_t i = 0; i < c->ray_count; i++)
        c->valid_count += c->valid == NULL || c->valid[i];
    GBT_TRY(allocate(c, err));
    image_loss_result loss;
    GBT_TRY(loss_of_image(&c->frame->rgb, &c->photo, c->valid, &c->scratch, &c->d_image, &loss, err));
    fprintf(c->out, "%s, %d x %d pixels: %zu Gaussians of %zu visible anchors, loss %.6g\n",
            s->views[view].name, c->width, c->height, c->scene.count, c->frame->visible_count,
            loss.loss + loss_of_gaussians(&c->frame->gaussians));
    fprintf(c->out, "%-12s%-12s%12s%12s\n", "stage", "class", "error", "limit");
    return GBT_OK;
}

/* ---- renderers ---- */

typedef struct band_job {
    const checker *c;
    bool *in_band;      /* [rays] */
    gbt_status *status; /* per block */
} band_job;

static void band_block(size_t block, size_t begin, size_t end, void *context)
{
    const band_job *job = context;
    const ray_image *rays = &job->c->frame->rays;
    band_scratch scratch = {0};
    for (size_t i = begin; i < end && job->status[block] == GBT_OK; i++)
        job->status[block] =
            rounding_band_find(&job->c->scene, &job->c->run->settings, ray_image_origin(rays, i),
                               rays->dir + 3 * i, &scratch, &job->in_band[i]);
    band_scratch_free(&scratch);
}

/* Rays where rounding may change which Gaussians are blended, or their order. */
static gbt_status find_band(checker *c, bool *in_band, gbt_error *err)
{
    const size_t blocks = parallel_block_count(c->ray_count, RAY_GRAIN);
    band_job job = {
        .c = c, .in_band = in_band, .status = mem_calloc(blocks, sizeof *job.status, "check band", err)};
    gbt_status status = job.status == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        parallel_blocks(c->ray_count, RAY_GRAIN, band_block, &job);
    for (size_t block = 0; status == GBT_OK && block < blocks; block++)
        if (job.status[block] != GBT_OK)
            status = base_fail(err, job.status[block], "check-grad: no memory for the hits of a ray");
    mem_free(job.status);
    return status;
}

/* The same for splats, whose definition in double shows no hits: pixels on which it draws another colour. */
static gbt_status find_other_colours(checker *c, const raster_reference *splats,
                                     const raster_settings *settings, bool *in_band, gbt_error *err)
{
    GBT_TRY(raster_reference_forward(splats, &c->frame->camera, settings, 1, c->rgb, err));
    for (size_t i = 0; i < 3 * c->ray_count; i++)
        in_band[i / 3] =
            in_band[i / 3] || !(fabs(c->rgb[i] - (double)c->frame->rgb.pixels[i]) <= colour_limit);
    return GBT_OK;
}

/* Relative L2 error, summed up. */
typedef struct difference {
    double square, wanted_square;
} difference;

static void difference_add(difference *d, double got, double wanted)
{
    d->square += (got - wanted) * (got - wanted);
    d->wanted_square += wanted * wanted;
}

static double difference_relative(const difference *d)
{
    return d->square == 0 ? 0 : sqrt(d->square / d->wanted_square);
}

static void fields_of(const gaussians *g, const float *fields[GAUSSIANS_FIELD_COUNT])
{
    size_t i = 0;
#define X(name, pad, meaning) fields[i++] = g->name;
    GAUSSIANS_FIELDS(X)
#undef X
}

/* The adjoint in double of d_masked, by the renderer's definition. `wanted` [GAUSSIANS_FIELD_COUNT][count],
   zero before. */
static gbt_status renderer_in_double(checker *c, const raster_reference *splats,
                                     const raster_settings *settings, const double *d_rgb, double *wanted,
                                     double d_background[3], gbt_error *err)
{
    if (c->frame->draw.renderer == GBT_RENDERER_RASTER)
        return raster_reference_backward(splats, &c->frame->camera, settings, d_rgb, wanted, d_background,
                                         err);
    return reference_scene_backward(&c->scene, &c->run->settings, &c->frame->rays, d_rgb, NULL, wanted,
                                    d_background, err);
}

static void print_renderer(checker *c, const char *stage, const double *wanted, const float d_background[3],
                           const double d_background_wanted[3])
{
    static const char *const names[] = {"mean", "scale", "rotation", "opacity", "colour"};
    static const size_t first[] = {REFERENCE_mean_x,  REFERENCE_scale_x, REFERENCE_quat_w,
                                   REFERENCE_opacity, REFERENCE_red,     GAUSSIANS_FIELD_COUNT};
    const float *got[GAUSSIANS_FIELD_COUNT];
    fields_of(&c->d_gaussians, got);
    for (size_t class = 0; class < sizeof names / sizeof *names; class ++) {
        difference d = {0};
        for (size_t f = first[class]; f < first[class + 1]; f++)
            for (size_t i = 0; i < c->scene.count; i++)
                difference_add(&d, (double)got[f][i], wanted[f * c->scene.count + i]);
        print_row(c, stage, names[class], difference_relative(&d), renderer_limit);
    }
    difference d = {0};
    for (int k = 0; k < 3; k++)
        difference_add(&d, (double)d_background[k], d_background_wanted[k]);
    print_row(c, stage, "background", difference_relative(&d), renderer_limit);
}

static gbt_status check_renderer(checker *c, gbt_renderer renderer, const char *stage, gbt_error *err)
{
    frame *f = c->frame;
    f->draw.renderer = renderer;
    GBT_TRY(render_at(c, c->view, c->width, err));
    /* As frame.c draws splats: dilated where they have no footprint. */
    raster_settings settings = frame_splat_settings(&c->run->settings, RASTER_EWA);
    settings.dilation = f->widened ? 0 : settings.dilation;
    const raster_reference splats = {c->scene.count, c->scene.fields};
    bool *in_band = mem_calloc(c->ray_count, sizeof *in_band, "check rays", err);
    double *d_rgb = mem_alloc(c->ray_count, 3 * sizeof *d_rgb, "check gradient", err);
    double *wanted =
        mem_calloc(c->scene.count, GAUSSIANS_FIELD_COUNT * sizeof *wanted, "check gradient", err);
    double d_background_wanted[3] = {0};
    float d_background[3];
    size_t left_out = 0;
    gbt_status status = in_band == NULL || d_rgb == NULL || wanted == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        status = renderer == GBT_RENDERER_RASTER ? find_other_colours(c, &splats, &settings, in_band, err)
                                                 : find_band(c, in_band, err);
    for (size_t i = 0; status == GBT_OK && i < 3 * c->ray_count; i++) {
        left_out += i % 3 == 0 && in_band[i / 3];
        c->d_masked.pixels[i] = in_band[i / 3] ? 0 : c->d_image.pixels[i];
        d_rgb[i] = (double)c->d_masked.pixels[i];
    }
    if (status == GBT_OK)
        status =
            renderer == GBT_RENDERER_TRACE
                ? trace_backward(&f->scene, &f->rays, &c->d_masked, &c->d_gaussians, c->weight, d_background,
                                 err)
                : raster_backward(&f->splats, &c->d_masked, &c->d_gaussians, c->weight, d_background, err);
    if (status == GBT_OK)
        status = renderer_in_double(c, &splats, &settings, d_rgb, wanted, d_background_wanted, err);
    if (status == GBT_OK) {
        print_renderer(c, stage, wanted, d_background, d_background_wanted);
        fprintf(c->out, "%s: %zu of %zu rays are left out: rounding may change what they blend\n", stage,
                left_out, c->ray_count);
        if (10 * left_out > 9 * c->ray_count)
            status = base_fail(err, GBT_ERR_INTERNAL,
                               "check-grad: too few rays are left for the %s's gradients", stage);
    }
    mem_free(in_band);
    mem_free(d_rgb);
    mem_free(wanted);
    return status;
}

/* The tracer last: the chain goes on with its weights. */
static gbt_status check_renderers(checker *c, gbt_renderer trained, gbt_error *err)
{
    if (raster_takes(&c->frame->camera))
        GBT_TRY(check_renderer(c, GBT_RENDERER_RASTER, "rasterizer", err));
    if (trained == GBT_RENDERER_PER_RAY)
        GBT_TRY(check_renderer(c, GBT_RENDERER_PER_RAY, "per-ray", err));
    return check_renderer(c, GBT_RENDERER_TRACE, "tracer", err);
}

/* ---- decode and chain ---- */

/* A class of parameters in the three forms in which it appears here. */
typedef struct parameter_class {
    char name[24];
    double *value;        /* in c->parameters */
    const double *wanted; /* in c->d_parameters */
    const float *got;     /* in c->d_anchors or c->d_params */
    size_t count;
} parameter_class;

enum { CLASS_COUNT = ANCHOR_FIELDS - ANCHOR_FIRST_LEARNED + DECODER_PARTS };

static void list_classes(checker *c, parameter_class out[CLASS_COUNT])
{
    const size_t n = c->parameters.count;
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++) {
        *out = (parameter_class){.value = c->parameters.field[f],
                                 .wanted = c->d_parameters.field[f],
                                 .got = c->d_anchors.field[f],
                                 .count = n * anchors_width(&c->d_anchors, f)};
        snprintf(out->name, sizeof out->name, "%s", anchor_fields[f].label);
        out++;
    }
    decoder_part parts[DECODER_PARTS];
    decoder_parts(&c->run->model.decoder, parts);
    for (int i = 0; i < DECODER_PARTS; i++) {
        const size_t b = parts[i].begin;
        *out = (parameter_class){.value = c->parameters.params + b,
                                 .wanted = c->d_parameters.params + b,
                                 .got = c->d_params + b,
                                 .count = parts[i].end - b};
        snprintf(out->name, sizeof out->name, "%s mlp", parts[i].label);
        out++;
    }
}

/* The adjoint of the whole image; then the same gradients of the Gaussians through the decoder in
   double. */
static gbt_status check_decode(checker *c, gbt_error *err)
{
    frame *f = c->frame;
    GBT_TRY(render_at(c, c->view, c->width, err)); /* a kept pass has one adjoint */
    GBT_TRY(frame_backward_gaussians(f, &c->d_image, err));
    loss_add_gradient(&f->gaussians, &f->d_gaussians);
    GBT_TRY(frame_backward_anchors(f, &c->run->model.anchors, &c->run->model.decoder, &c->d_anchors,
                                   c->d_params, err));
    const float *d_fields[GAUSSIANS_FIELD_COUNT];
    fields_of(&f->d_gaussians, d_fields);
    for (size_t i = 0; i < f->gaussians.count; i++)
        for (size_t k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
            c->d_slots[f->tape.slot[i] * (size_t)DECODE_REF_FIELDS + k] = (double)d_fields[k][i];
    decode_ref_backward(&c->parameters, c->camera, f->visible, f->visible_count, c->d_slots,
                        &c->d_parameters);
    parameter_class classes[CLASS_COUNT];
    list_classes(c, classes);
    for (int class = 0; class < CLASS_COUNT; class ++) {
        difference d = {0};
        for (size_t i = 0; i < classes[class].count; i++)
            difference_add(&d, (double)classes[class].got[i], classes[class].wanted[i]);
        print_row(c, "decode", classes[class].name, difference_relative(&d), decode_limit);
    }
    return GBT_OK;
}

/* The loss of the picture with SSIM from its definition (image/metrics.h), in double: the terms of its
   mean. */
static void loss_terms(const checker *c, double *terms)
{
    enum { RADIUS = 5, TAPS = 2 * RADIUS + 1 };
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03, values = (double)(3 * c->valid_count);
    double taps[TAPS], total = 0;
    for (int k = 0; k < TAPS; k++) {
        taps[k] = exp(-(k - RADIUS) * (k - RADIUS) / (2 * 1.5 * 1.5));
        total += taps[k];
    }
    for (int y = 0; y < c->height; y++)
        for (int x = 0; x < c->width; x++)
            for (int channel = 0; channel < 3; channel++) {
                const size_t pixel = (size_t)y * (size_t)c->width + (size_t)x,
                             out = 3 * pixel + (size_t)channel;
                double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
                terms[out] = 0;
                if (c->valid != NULL && !c->valid[pixel])
                    continue;
                for (int dy = -RADIUS; dy <= RADIUS; dy++)
                    for (int dx = -RADIUS; dx <= RADIUS; dx++) {
                        if (x + dx < 0 || x + dx >= c->width || y + dy < 0 || y + dy >= c->height)
                            continue;
                        const size_t near = (size_t)(y + dy) * (size_t)c->width + (size_t)(x + dx),
                                     at = 3 * near + (size_t)channel;
                        if (c->valid != NULL && !c->valid[near])
                            continue;
                        const double tap = taps[dx + RADIUS] * taps[dy + RADIUS] / (total * total),
                                     p = c->rgb[at], q = (double)c->photo.pixels[at];
                        a += tap * p;
                        b += tap * q;
                        aa += tap * p * p;
                        bb += tap * q * q;
                        ab += tap * p * q;
                    }
                const double ssim = (2 * a * b + c1) * (2 * (ab - a * b) + c2) /
                                    ((a * a + b * b + c1) * (aa - a * a + bb - b * b + c2));
                terms[out] = loss_of_value(c->rgb[out], (double)c->photo.pixels[out], ssim) / values;
            }
}

static void decode_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const checker *c = context;
    decode_ref_forward(&c->parameters, c->camera, c->frame->visible + begin, end - begin,
                       c->slots + begin * (size_t)c->parameters.offset_count * DECODE_REF_FIELDS);
}

/* The training loss of c->parameters, in double from end to end. Gaussians that no ray blended are not
   traced: they are not in the image. */
static gbt_status chain_loss(checker *c, reference_scene *seen, int which, gbt_error *err)
{
    const frame *f = c->frame;
    parallel_blocks(f->visible_count, ANCHOR_GRAIN, decode_block, c);
    double shares = 0;
    size_t to = 0;
    for (size_t i = 0; i < f->gaussians.count; i++) {
        double *slot = c->slots + f->tape.slot[i] * (size_t)DECODE_REF_FIELDS;
        shares += loss_of_gaussian(slot);
        if (!(c->weight[i] > 0))
            continue;
        frame_widen_exact(f, i, slot);
        for (size_t k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
            seen->fields[k * seen->count + to] = slot[k];
        to++;
    }
    GBT_TRY(reference_scene_forward(seen, &c->run->settings, &f->rays, c->rgb, NULL, NULL, err));
    loss_terms(c, c->terms[which]);
    c->gaussian_loss[which] = f->gaussians.count > 0 ? shares / (double)f->gaussians.count : 0;
    return GBT_OK;
}

/* Differences of the loss along `direction` to both sides, per length. Summed pixel by pixel, so that no
   large sums are subtracted. */
static gbt_status differences_along(checker *c, const parameter_class *class, const double *direction,
                                    double *keep, reference_scene *seen, double out[2], gbt_error *err)
{
    gbt_status status = GBT_OK;
    memcpy(keep, class->value, class->count * sizeof *keep);
    for (int side = 1; side <= 2 && status == GBT_OK; side++) {
        for (size_t i = 0; i < class->count; i++)
            class->value[i] = keep[i] + (side == 1 ? -step : step) * direction[i];
        status = chain_loss(c, seen, side, err);
    }
    memcpy(class->value, keep, class->count * sizeof *keep);
    out[0] = c->gaussian_loss[0] - c->gaussian_loss[1];
    out[1] = c->gaussian_loss[2] - c->gaussian_loss[0];
    for (size_t i = 0; i < 3 * c->ray_count; i++) {
        out[0] += c->terms[0][i] - c->terms[1][i];
        out[1] += c->terms[2][i] - c->terms[0][i];
    }
    out[0] /= step;
    out[1] /= step;
    return status;
}

/* `scratch` holds two arrays of the class's size. `error` is NaN when too few directions crossed no cut. */
static gbt_status check_class(checker *c, const parameter_class *class, uint64_t stream, double *scratch,
                              reference_scene *seen, size_t *crossed, double *error, gbt_error *err)
{
    double *const direction = scratch, *const keep = scratch + class->count;
    double length = 0, square = 0;
    for (size_t i = 0; i < class->count; i++)
        length += (double)class->got[i] * (double)class->got[i];
    length = fmax(sqrt(length), gradient_floor);
    int measured = 0;
    for (uint64_t attempt = 0; attempt < ATTEMPTS && measured < DIRECTIONS; attempt++) {
        double along = 0, wanted[2];
        for (size_t i = 0; i < class->count; i++) {
            direction[i] = rng_normal(stream, attempt, i);
            along += direction[i] * (double)class->got[i];
        }
        GBT_TRY(differences_along(c, class, direction, keep, seen, wanted, err));
        if (!(fabs(wanted[1] - wanted[0]) <= smooth_limit * length)) {
            ++*crossed;
            continue;
        }
        along -= 0.5 * (wanted[0] + wanted[1]);
        square += along * along;
        measured++;
    }
    *error = measured == DIRECTIONS ? sqrt(square / DIRECTIONS) / length : (double)NAN;
    return GBT_OK;
}

static gbt_status check_chain(checker *c, gbt_error *err)
{
    parameter_class classes[CLASS_COUNT];
    list_classes(c, classes);
    size_t largest = 0, crossed = 0;
    for (int class = 0; class < CLASS_COUNT; class ++)
        largest = classes[class].count > largest ? classes[class].count : largest;
    reference_scene seen = {0};
    for (size_t i = 0; i < c->scene.count; i++)
        seen.count += c->weight[i] > 0;
    seen.fields = mem_alloc(seen.count, GAUSSIANS_FIELD_COUNT * sizeof *seen.fields, "check scene", err);
    double *scratch = mem_alloc(largest, 2 * sizeof *scratch, "check directions", err);
    gbt_status status = seen.fields == NULL || scratch == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    if (status == GBT_OK)
        status = chain_loss(c, &seen, 0, err);
    for (int class = 0; class < CLASS_COUNT && status == GBT_OK; class ++) {
        double error;
        status = check_class(c, &classes[class], (uint64_t) class, scratch, &seen, &crossed, &error, err);
        if (status == GBT_OK)
            print_row(c, "chain", classes[class].name, error, chain_limit);
    }
    if (status == GBT_OK)
        fprintf(
            c->out,
            "chain: %d random directions for each class; %zu more crossed a cut-off and were drawn again\n",
            DIRECTIONS, crossed);
    reference_scene_free(&seen);
    mem_free(scratch);
    return status;
}

static void free_all(checker *c)
{
    image_free(&c->photo);
    image_free(&c->d_image);
    image_free(&c->d_masked);
    loss_scratch_free(&c->scratch);
    gaussians_free(&c->d_gaussians);
    mem_free(c->valid);
    mem_free(c->weight);
    anchors_free(&c->d_anchors);
    mem_free(c->d_params);
    reference_scene_free(&c->scene);
    decode_ref_free(&c->parameters);
    decode_ref_free(&c->d_parameters);
    mem_free(c->slots);
    mem_free(c->d_slots);
    mem_free(c->rgb);
    for (int i = 0; i < 3; i++)
        mem_free(c->terms[i]);
}

gbt_status lab_check_grad(const char *run, FILE *out, gbt_error *err)
{
    loaded_run *loaded = mem_calloc(1, sizeof *loaded, "run", err);
    if (loaded == NULL)
        return GBT_ERR_NO_MEMORY;
    checker c = {.run = loaded, .frame = &loaded->frame, .out = out};
    gbt_status status = loaded_run_open_model(run, loaded, err);
    if (status == GBT_OK)
        status = loaded_run_need_anchors(loaded, run, err);
    if (status == GBT_OK)
        status = loaded_run_open_views(run, NULL, 0, loaded, err);
    const gbt_renderer trained = loaded->frame.draw.renderer;
    loaded->frame.draw.renderer = GBT_RENDERER_TRACE;
    if (status == GBT_OK)
        status = set_up(&c, err);
    if (status == GBT_OK)
        status = check_renderers(&c, trained, err);
    if (status == GBT_OK)
        status = check_decode(&c, err);
    if (status == GBT_OK)
        status = check_chain(&c, err);
    if (status == GBT_OK && c.broken > 0)
        status =
            base_fail(err, GBT_ERR_INTERNAL, "%s: %zu gradient errors are above their limits", run, c.broken);
    free_all(&c);
    loaded_run_close(loaded);
    mem_free(loaded);
    return status;
}
