/* SPDX-License-Identifier: Apache-2.0 */
/* benchmark/check_grad.h -- shared by the parts of the gradient check: the scene in float and in double, and
   the rows of the output. */
#ifndef GBT_BENCHMARK_CHECK_GRAD_H
#define GBT_BENCHMARK_CHECK_GRAD_H

#include <math.h>
#include <stdio.h>

#include "reference/decode_ref.h"
#include "run/loaded_run.h"
#include "trace/reference.h"
#include "train/loss.h"

typedef struct grad_checker {
    loaded_run *run;
    frame *frame; /* of `run` */
    size_t view;
    int width, height;
    size_t ray_count;
    image photo, d_image,
        d_masked;         /* d_masked: d_image, but 0 on rays that a renderer's comparison leaves out */
    unsigned char *valid; /* [rays], NULL: all count */
    size_t valid_count;
    loss_scratch scratch;
    gaussians d_gaussians;
    float *weight; /* [Gaussians]: T alpha, summed over all rays */
    anchors d_anchors;
    float *d_params;
    reference_scene scene; /* all Gaussians of the frame, in double */
    decode_ref parameters, d_parameters;
    double *slots, *d_slots; /* [visible * K][DECODE_REF_FIELDS] */
    double *rgb;
    double *terms[3]; /* [rays][3]: each pixel's share of the loss at 0, -step and +step along a direction */
    double gaussian_loss[3]; /* the loss terms of the Gaussians themselves, at the same three places */
    double camera[3];        /* rounded to float, as the decoder gets it */
    FILE *out;
    size_t broken;
} grad_checker;

static inline void grad_print_row(grad_checker *c, const char *stage, const char *class, double error,
                                  double limit)
{
    const bool fine = error <= limit; /* false for NaN */
    fprintf(c->out, "%-12s%-12s%12.1e%12.0e%s\n", stage, class, error, limit, fine ? "" : "  broken");
    c->broken += !fine;
}

/* Accumulates a relative L2 error. */
typedef struct grad_difference {
    double square, wanted_square;
} grad_difference;

static inline void grad_difference_add(grad_difference *d, double got, double wanted)
{
    d->square += (got - wanted) * (got - wanted);
    d->wanted_square += wanted * wanted;
}

static inline double grad_difference_relative(const grad_difference *d)
{
    return d->square == 0 ? 0 : sqrt(d->square / d->wanted_square);
}

static inline void grad_fields_of(const gaussians *g, const float *fields[GAUSSIANS_FIELD_COUNT])
{
    size_t i = 0;
#define X(name, pad, meaning) fields[i++] = g->name;
    GAUSSIANS_FIELDS(X)
#undef X
}

/** Weight of the volume loss with which the run was trained. */
static inline double grad_volume_weight(const grad_checker *c)
{
    const train_rules rules = train_rules_of(&c->run->def);
    return loss_volume_weight(&rules, &c->run->model.decoder);
}

/** Render a view at a small size, keeping the tape for its adjoint. */
gbt_status grad_render_at(grad_checker *c, size_t view, int width, gbt_error *err);

/** Choose the view, read its photo and allocate all memory. Call grad_free() even after a failure. */
gbt_status grad_set_up(grad_checker *c, gbt_error *err);
void grad_free(grad_checker *c);

/** Compare the adjoint of every renderer with its double-precision version. The tracer comes last, because
    the check of the chain uses its weights. `trained`: the renderer with which the run was trained. */
gbt_status grad_check_renderers(grad_checker *c, gbt_renderer trained, gbt_error *err);

/** Check the adjoint of the decoder, then the whole chain. */
gbt_status grad_check_decode(grad_checker *c, gbt_error *err);
gbt_status grad_check_chain(grad_checker *c, gbt_error *err);

#endif
