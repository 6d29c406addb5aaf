/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_activations.c -- adjoint of the activations: from gradients of Gaussians to those of network
   outputs, offsets and log-scales.

   It handles BATCH Gaussians at a time: values of their anchors are gathered, the arithmetic runs in SIMD
   lanes, and the results are scattered to the rows of the anchors. */
#include <math.h>
#include <string.h>

#include "anchor/decode_layout.h"
#include "base/clones.h"
#include "base/compare.h"

enum { BATCH = 64 };

/* Inputs of a batch, one value per Gaussian. */
typedef struct batch_in {
    float position[3][BATCH], offset[3][BATCH], extent[6][BATCH];
} batch_in;

typedef struct batch_out {
    float offset[3][BATCH], scale_log[6][BATCH], alpha[BATCH], shape[DECODER_SHAPE_OUTPUTS][BATCH],
        color[DECODER_COLOR_OUTPUTS][BATCH];
} batch_out;

/* Adjoint of means: gradients of offsets and of the offset log-scales. */
FASTEST_CLONE static void back_means(const batch_in *restrict in, const gaussians *d, size_t g, size_t count,
                                     batch_out *restrict out)
{
    const float *const d_mean[3] = {d->mean_x + g, d->mean_y + g, d->mean_z + g};
    for (int c = 0; c < 3; c++) {
        const float *restrict slope = d_mean[c];
        for (size_t i = 0; i < count; i++) {
            const float e = in->extent[c][i], shift = in->offset[c][i] * e;
            const int inside = fabsf(in->position[c][i] + shift) < DECODE_MEAN_LIMIT;
            out->offset[c][i] = inside ? slope[i] * e : 0.0f;
            out->scale_log[c][i] = inside ? slope[i] * shift : 0.0f;
        }
    }
}

/* Adjoint of scales: gradients of log-scales and network outputs. A scale that was raised to
   DECODE_SCALE_RATIO of the largest depends only on the largest. */
FASTEST_CLONE static void back_scales(const batch_in *restrict in, const float *restrict kept, size_t stride,
                                      const gaussians *d, size_t g, size_t count, batch_out *restrict out)
{
    const float *const d_scale[3] = {d->scale_x + g, d->scale_y + g, d->scale_z + g};
    float scale[3][BATCH], slope[3][BATCH], least[BATCH], largest[BATCH], passed_on[BATCH];
    for (int c = 0; c < 3; c++) {
        memcpy(slope[c], d_scale[c], count * sizeof slope[c][0]);
        for (size_t i = 0; i < count; i++)
            scale[c][i] = in->extent[3 + c][i] * kept[(size_t)(KEPT_SIGMOID + c) * stride + i];
    }
    for (size_t i = 0; i < count; i++) {
        const float x = scale[0][i], y = scale[1][i], z = scale[2][i], most = larger(x, larger(y, z));
        largest[i] = most;
        least[i] = DECODE_SCALE_RATIO * most;
        const float from_x = x < least[i] ? slope[0][i] : 0.0f, from_y = y < least[i] ? slope[1][i] : 0.0f,
                    from_z = z < least[i] ? slope[2][i] : 0.0f;
        passed_on[i] =
            DECODE_SCALE_RATIO * from_x + DECODE_SCALE_RATIO * from_y + DECODE_SCALE_RATIO * from_z;
    }
    for (int c = 0; c < 3; c++) {
        const float *restrict sigmoid = kept + (size_t)(KEPT_SIGMOID + c) * stride;
        for (size_t i = 0; i < count; i++) {
            const float s = scale[c][i], more = s == largest[i] ? passed_on[i] : 0.0f;
            passed_on[i] -= more; /* the first of several equal largest scales gets the gradient */
            const float scaled = (s < least[i] ? 0.0f : slope[c][i] + more) * s;
            out->scale_log[3 + c][i] = scaled;
            out->shape[c][i] = scaled * (1.0f - sigmoid[i]);
        }
    }
}

FASTEST_CLONE static void back_rotations(const float *restrict kept, size_t stride, const gaussians *d,
                                         size_t g, size_t count, batch_out *restrict out)
{
    const float *restrict d_w = d->quat_w + g, *restrict d_x = d->quat_x + g, *restrict d_y = d->quat_y + g,
                          *restrict d_z = d->quat_z + g;
    const float *restrict w = kept + KEPT_QUAT * stride, *restrict x = w + stride, *restrict y = x + stride,
                          *restrict z = y + stride, *restrict inverse_length = z + stride;
    for (size_t i = 0; i < count; i++) {
        const float along = w[i] * d_w[i] + x[i] * d_x[i] + y[i] * d_y[i] + z[i] * d_z[i];
        out->shape[3][i] = (d_w[i] - w[i] * along) * inverse_length[i];
        out->shape[4][i] = (d_x[i] - x[i] * along) * inverse_length[i];
        out->shape[5][i] = (d_y[i] - y[i] * along) * inverse_length[i];
        out->shape[6][i] = (d_z[i] - z[i] * along) * inverse_length[i];
    }
}

FASTEST_CLONE static void back_colors(const float *restrict kept, size_t stride, const gaussians *d, size_t g,
                                      size_t count, batch_out *restrict out)
{
    const float *const d_color[3] = {d->red + g, d->green + g, d->blue + g};
    const float *restrict alpha = kept + KEPT_ALPHA * stride, *restrict d_opacity = d->opacity + g;
    for (int c = 0; c < 3; c++) {
        const float *restrict value = kept + (size_t)(KEPT_COLOR + c) * stride, *restrict slope = d_color[c];
        for (size_t i = 0; i < count; i++)
            out->color[c][i] = slope[i] * (value[i] * (1.0f - value[i]));
    }
    for (size_t i = 0; i < count; i++)
        out->alpha[i] = d_opacity[i] * (1.0f - alpha[i] * alpha[i]);
}

/* Gather the rows and anchor values of Gaussians [g, g + count), starting the search at row `r`. Returns the
   row of the last one. */
static size_t gather(const decode_slopes *s, size_t g, size_t count, size_t r, batch_in *in,
                     size_t row[BATCH], size_t k[BATCH])
{
    const size_t offsets = s->layout->offset_count;
    const uint32_t *slot = s->tape->slot + g, *place = s->tape->place + s->begin;
    for (size_t i = 0; i < count; i++) {
        while (slot[i] >= (place[r] + 1) * offsets)
            r++;
        row[i] = r;
        k[i] = slot[i] - place[r] * offsets;
        const float *position = s->a->position + (size_t)s->anchor[r] * 3,
                    *offset = s->a->offset + ((size_t)s->anchor[r] * offsets + k[i]) * 3;
        for (int c = 0; c < 3; c++) {
            in->position[c][i] = position[c];
            in->offset[c][i] = offset[c];
        }
        for (int c = 0; c < 6; c++)
            in->extent[c][i] = s->extent[r * 6 + (size_t)c];
    }
    return r;
}

static void scatter(const decode_slopes *s, const batch_out *out, size_t count, const size_t row[BATCH],
                    const size_t k[BATCH])
{
    const decode_layout *layout = s->layout;
    for (size_t i = 0; i < count; i++) {
        float *logits = s->d_out + row[i] * layout->out_width, *scale_log = s->d_scale_log + row[i] * 6;
        float *shape = logits + layout->out_first[DECODER_SHAPE] + k[i] * DECODER_SHAPE_OUTPUTS,
              *color = logits + layout->out_first[DECODER_COLOR] + k[i] * DECODER_COLOR_OUTPUTS;
        logits[layout->out_first[DECODER_OPACITY] + k[i]] = out->alpha[i];
        for (int c = 0; c < DECODER_SHAPE_OUTPUTS; c++)
            shape[c] = out->shape[c][i];
        for (int c = 0; c < DECODER_COLOR_OUTPUTS; c++)
            color[c] = out->color[c][i];
        for (int c = 0; c < 6; c++)
            scale_log[c] += out->scale_log[c][i];
        if (s->d_offset == NULL)
            continue;
        float *offset = s->d_offset + (s->target[row[i]] * layout->offset_count + k[i]) * 3;
        for (int c = 0; c < 3; c++)
            offset[c] += out->offset[c][i];
    }
}

void decode_activations_backward(const decode_slopes *s, size_t g, size_t end)
{
    const size_t stride = s->tape->output_stride;
    for (size_t r = 0, count; g < end; g += count) {
        count = end - g < BATCH ? end - g : BATCH;
        batch_in in;
        batch_out out;
        size_t row[BATCH], k[BATCH];
        r = gather(s, g, count, r, &in, row, k);
        const float *kept = s->tape->output + g;
        back_means(&in, s->d_gaussians, g, count, &out);
        back_scales(&in, kept, stride, s->d_gaussians, g, count, &out);
        back_rotations(kept, stride, s->d_gaussians, g, count, &out);
        back_colors(kept, stride, s->d_gaussians, g, count, &out);
        scatter(s, &out, count, row, k);
    }
}
