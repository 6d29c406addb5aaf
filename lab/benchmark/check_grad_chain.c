/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/check_grad_chain.c -- compare the decoder's adjoint with its double-precision version, and the
   gradient of the training loss with finite differences. */
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "benchmark/check_grad.h"

enum { ANCHOR_GRAIN = 256, DIRECTIONS = 3, ATTEMPTS = 24 };

/* Errors that float32 explains (see check_grad_renderers.c). The limit of the chain is wider, because its two
   sides decode values with different rounding, so that one hit in ten thousand falls on the other side of a
   cut-off. */
static const double decode_limit = 1e-5, chain_limit = 1e-3;

/* Step of the differences, in standard deviations of the direction: small, to cross few cut-offs. */
static const double step = 1e-8;
/* Largest relative disagreement of the two one-sided differences; beyond it a cut-off was crossed. */
static const double smooth_limit = 1e-4;
/* Smaller gradients vanish in the rounding of a difference of double losses. */
static const double gradient_floor = 1e-6;

/* A class of parameters, in the three representations in which it is needed here. */
typedef struct parameter_class {
    char name[24];
    double *value;        /* in c->parameters */
    const double *wanted; /* in c->d_parameters */
    const float *got;     /* in c->d_anchors or c->d_params */
    size_t count;
} parameter_class;

enum { CLASS_COUNT = ANCHOR_FIELDS - ANCHOR_FIRST_LEARNED + DECODER_NETWORKS };

static void list_classes(grad_checker *c, parameter_class out[CLASS_COUNT])
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
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(&c->run->model.decoder, networks);
    for (int i = 0; i < DECODER_NETWORKS; i++) {
        const size_t b = networks[i].begin;
        *out = (parameter_class){.value = c->parameters.params + b,
                                 .wanted = c->d_parameters.params + b,
                                 .got = c->d_params + b,
                                 .count = networks[i].end - b};
        snprintf(out->name, sizeof out->name, "%s mlp", networks[i].label);
        out++;
    }
}

/* The float adjoint of the whole image, and the same gradients of the Gaussians propagated through the
   double-precision decoder. */
gbt_status grad_check_decode(grad_checker *c, gbt_error *err)
{
    frame *f = c->frame;
    GBT_TRY(grad_render_at(c, c->view, c->width, err)); /* a recorded pass has one adjoint */
    GBT_TRY(frame_backward_gaussians(f, &c->d_image, err));
    loss_add_gradient(&f->gaussians, grad_volume_weight(c), &f->d_gaussians);
    GBT_TRY(frame_backward_anchors(f, &c->run->model.anchors, &c->run->model.decoder, &c->d_anchors,
                                   c->d_params, err));
    const float *d_fields[GAUSSIANS_FIELD_COUNT];
    grad_fields_of(&f->d_gaussians, d_fields);
    for (size_t i = 0; i < f->gaussians.count; i++)
        for (size_t k = 0; k < GAUSSIANS_FIELD_COUNT; k++)
            c->d_slots[f->tape.slot[i] * (size_t)DECODE_REF_FIELDS + k] = (double)d_fields[k][i];
    decode_ref_backward(&c->parameters, c->camera, f->visible, f->visible_count, c->d_slots,
                        &c->d_parameters);
    parameter_class classes[CLASS_COUNT];
    list_classes(c, classes);
    for (int class = 0; class < CLASS_COUNT; class ++) {
        grad_difference d = {0};
        for (size_t i = 0; i < classes[class].count; i++)
            grad_difference_add(&d, (double)classes[class].got[i], classes[class].wanted[i]);
        grad_print_row(c, "decode", classes[class].name, grad_difference_relative(&d), decode_limit);
    }
    return GBT_OK;
}

/* The loss of the picture in double, with SSIM by its definition (image/metrics.h): the terms whose mean it
   is. */
static void loss_terms(const grad_checker *c, double *terms)
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
    const grad_checker *c = context;
    decode_ref_forward(&c->parameters, c->camera, c->frame->visible + begin, end - begin,
                       c->slots + begin * (size_t)c->parameters.offset_count * DECODE_REF_FIELDS);
}

/* The training loss of c->parameters, in double from end to end. Gaussians that no ray blended do not affect
   the image and are not traced. */
static gbt_status chain_loss(grad_checker *c, reference_scene *seen, int which, gbt_error *err)
{
    const frame *f = c->frame;
    parallel_blocks(f->visible_count, ANCHOR_GRAIN, decode_block, c);
    const double volume_weight = grad_volume_weight(c);
    double shares = 0;
    size_t to = 0;
    for (size_t i = 0; i < f->gaussians.count; i++) {
        double *slot = c->slots + f->tape.slot[i] * (size_t)DECODE_REF_FIELDS;
        shares += loss_of_gaussian(slot, volume_weight);
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

/* One-sided differences of the loss in both senses of `direction`, per unit length. They are formed pixel by
   pixel before summing, to avoid the cancellation of large sums. */
static gbt_status differences_along(grad_checker *c, const parameter_class *class, const double *direction,
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

/* Check one class of parameters. `scratch` holds two arrays of its size. `error` is NaN if too few directions
   crossed no cut-off. */
static gbt_status check_class(grad_checker *c, const parameter_class *class, uint64_t stream, double *scratch,
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

gbt_status grad_check_chain(grad_checker *c, gbt_error *err)
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
            grad_print_row(c, "chain", classes[class].name, error, chain_limit);
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
