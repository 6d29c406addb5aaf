/* SPDX-License-Identifier: Apache-2.0 */
/* reference/decode_ref.c -- the decoder in double precision, written directly from the equations (Yang 2026,
   eqs 13-15), without optimization. */
#include "reference/decode_ref.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"

enum {
    FEATURE = ANCHOR_FEATURE_DIM,
    HIDDEN = ANCHOR_HIDDEN_DIM,
    INPUT_MAX = FEATURE + 4,
    OUT_MAX = 11 * ANCHOR_MAX_OFFSETS
};

static const double limit = 30.0; /* for the arguments of exp and sigmoid, as in activations.h */

/* Intermediate values of the three networks of one anchor, in the order opacity, shape, colour. */
typedef struct activations {
    double input[INPUT_MAX];
    double hidden[3][HIDDEN];
    double out[OUT_MAX]; /* logits: K, 7K, 3K */
} activations;

static size_t input_count(const decode_ref *r) { return FEATURE + 3 + (r->has_distance ? 1 : 0); }

static size_t out_count(const decode_ref *r, int head)
{
    static const size_t per_offset[DECODER_NETWORKS] = {
#define X(id, label, outputs) outputs,
        DECODER_NETWORK_LIST(X)
#undef X
    };
    return per_offset[head] * (size_t)r->offset_count;
}

static gbt_status allocate(decode_ref *out, gbt_error *err)
{
    out->params = mem_calloc(out->param_count, sizeof(double), "decode reference", err);
    bool made = out->params != NULL;
    for (int f = 0; f < ANCHOR_FIELDS; f++) {
        const size_t width = row_field_width(&anchor_fields[f], out->offset_count);
        out->field[f] = mem_calloc(out->count * width, sizeof(double), "decode reference", err);
        made = made && out->field[f] != NULL;
    }
    if (made)
        return GBT_OK;
    decode_ref_free(out);
    return GBT_ERR_NO_MEMORY;
}

static void widen(double *to, const float *from, size_t count)
{
    for (size_t i = 0; i < count; i++)
        to[i] = (double)from[i];
}

gbt_status decode_ref_load(decode_ref *out, const anchors *a, const decoder *d, gbt_error *err)
{
    *out = (decode_ref){.count = a->count,
                        .param_count = d->param_count,
                        .offset_count = a->offset_count,
                        .has_distance = d->has_distance,
                        .distance_scale = (double)d->distance_scale,
                        .distance_min = (double)d->distance_min,
                        .distance_max = (double)d->distance_max};
    const gbt_status status = allocate(out, err);
    if (status != GBT_OK)
        return status;
    for (int f = 0; f < ANCHOR_FIELDS; f++)
        widen(out->field[f], a->field[f], a->count * anchors_width(a, f));
    widen(out->params, d->params, d->param_count);
    return GBT_OK;
}

gbt_status decode_ref_zero(decode_ref *out, const decode_ref *like, gbt_error *err)
{
    *out = *like;
    return allocate(out, err);
}

void decode_ref_free(decode_ref *r)
{
    for (int f = 0; f < ANCHOR_FIELDS; f++)
        mem_free(r->field[f]);
    mem_free(r->params);
    memset(r, 0, sizeof *r);
}

static double cut(double x) { return fmin(fmax(x, -limit), limit); }

static double slope(double x) /* derivative of cut() */ { return x >= -limit && x <= limit ? 1.0 : 0.0; }

static const double scale_ratio = (double)1e-4f; /* smallest scale relative to the largest */

static size_t largest_of(const double scale[3])
{
    return scale[1] > scale[0] ? (scale[2] > scale[1] ? 2 : 1) : scale[2] > scale[0] ? 2 : 0;
}

static double sigmoid(double x) { return 1.0 / (1.0 + exp(-cut(x))); }

static void run_networks(const decode_ref *r, const double camera[3], size_t anchor, activations *act)
{
    const size_t in = input_count(r);
    memcpy(act->input, r->feature + anchor * FEATURE, FEATURE * sizeof(double));
    double view[3], square = 0;
    for (int c = 0; c < 3; c++) {
        view[c] = r->position[anchor * 3 + (size_t)c] - camera[c];
        square += view[c] * view[c];
    }
    const double distance = sqrt(square);
    for (int c = 0; c < 3; c++)
        act->input[FEATURE + c] = distance > 0 ? view[c] / distance : c == 2;
    if (r->has_distance)
        act->input[FEATURE + 3] =
            fmin(fmax(distance * r->distance_scale, r->distance_min / 2), r->distance_max * 2);

    const double *p = r->params;
    double *out = act->out;
    for (int head = 0; head < 3; head++) {
        const double *w1 = p, *b1 = w1 + HIDDEN * in, *w2 = b1 + HIDDEN,
                     *b2 = w2 + out_count(r, head) * HIDDEN;
        for (size_t h = 0; h < HIDDEN; h++) {
            double sum = b1[h];
            for (size_t i = 0; i < in; i++)
                sum += w1[h * in + i] * act->input[i];
            act->hidden[head][h] = fmax(sum, 0.0);
        }
        for (size_t o = 0; o < out_count(r, head); o++) {
            double sum = b2[o];
            for (size_t h = 0; h < HIDDEN; h++)
                sum += w2[o * HIDDEN + h] * act->hidden[head][h];
            *out++ = sum;
        }
        p = b2 + out_count(r, head);
    }
}

/* Normalize a quaternion. Returns 1 / length, or 0 if its direction is undefined. */
static double unit_quaternion(const double raw[4], double q[4])
{
    double square = 0;
    for (int c = 0; c < 4; c++)
        square += raw[c] * raw[c];
    const double inverse = square >= 1e-24 ? 1.0 / sqrt(square) : 0.0;
    for (int c = 0; c < 4; c++)
        q[c] = inverse > 0 ? raw[c] * inverse : c == 0;
    return inverse;
}

void decode_ref_forward(const decode_ref *r, const double camera_center[3], const uint32_t *visible,
                        size_t visible_count, double *out)
{
    const size_t offsets = (size_t)r->offset_count;
    activations act;
    for (size_t v = 0; v < visible_count; v++) {
        const size_t i = visible[v];
        run_networks(r, camera_center, i, &act);
        for (size_t k = 0; k < offsets; k++) {
            double *g = out + (v * offsets + k) * DECODE_REF_FIELDS;
            const double *shape = act.out + offsets + k * 7, *color = act.out + offsets * 8 + k * 3;
            for (size_t c = 0; c < 3; c++) {
                g[c] = r->position[i * 3 + c] +
                       r->offset[(i * offsets + k) * 3 + c] * exp(cut(r->scale_log[i * 6 + c]));
                g[3 + c] = exp(cut(r->scale_log[i * 6 + 3 + c])) * sigmoid(shape[c]);
                g[11 + c] = sigmoid(color[c]);
            }
            const double least = scale_ratio * g[3 + largest_of(g + 3)];
            for (size_t c = 3; c < 6; c++)
                g[c] = fmax(g[c], least);
            unit_quaternion(shape + 3, g + 6);
            g[10] = tanh(act.out[k]);
        }
    }
}

/* Propagate the logit gradients of one anchor back through its three networks. */
static void networks_backward(const decode_ref *r, size_t anchor, const activations *act,
                              const double *d_logit, decode_ref *grad)
{
    const size_t in = input_count(r);
    size_t first = 0;
    for (int head = 0; head < 3; head++) {
        const size_t count = out_count(r, head), w2_first = first + HIDDEN * (in + 1);
        double d_hidden[HIDDEN] = {0};
        for (size_t o = 0; o < count; o++) {
            for (size_t h = 0; h < HIDDEN; h++) {
                d_hidden[h] += d_logit[o] * r->params[w2_first + o * HIDDEN + h];
                grad->params[w2_first + o * HIDDEN + h] += d_logit[o] * act->hidden[head][h];
            }
            grad->params[w2_first + count * HIDDEN + o] += d_logit[o];
        }
        for (size_t h = 0; h < HIDDEN; h++) {
            if (act->hidden[head][h] <= 0)
                continue;
            for (size_t i = 0; i < in; i++)
                grad->params[first + h * in + i] += d_hidden[h] * act->input[i];
            grad->params[first + HIDDEN * in + h] += d_hidden[h];
            for (size_t i = 0; i < FEATURE; i++)
                grad->feature[anchor * FEATURE + i] += d_hidden[h] * r->params[first + h * in + i];
        }
        d_logit += count;
        first = w2_first + count * (HIDDEN + 1);
    }
}

void decode_ref_backward(const decode_ref *r, const double camera_center[3], const uint32_t *visible,
                         size_t visible_count, const double *d_out, decode_ref *grad)
{
    const size_t offsets = (size_t)r->offset_count;
    activations act;
    for (size_t v = 0; v < visible_count; v++) {
        const size_t i = visible[v];
        run_networks(r, camera_center, i, &act);
        double d_logit[OUT_MAX];
        for (size_t k = 0; k < offsets; k++) {
            const double *d = d_out + (v * offsets + k) * DECODE_REF_FIELDS;
            const double *shape = act.out + offsets + k * 7, *color = act.out + offsets * 8 + k * 3;
            double *d_shape = d_logit + offsets + k * 7, *d_color = d_logit + offsets * 8 + k * 3, q[4],
                   along = 0;
            double raw[3], d_scale[3] = {d[3], d[4], d[5]};
            for (size_t c = 0; c < 3; c++)
                raw[c] = exp(cut(r->scale_log[i * 6 + 3 + c])) * sigmoid(shape[c]);
            const size_t large = largest_of(raw);
            for (size_t c = 0; c < 3; c++)
                if (raw[c] < scale_ratio * raw[large]) {
                    d_scale[large] += scale_ratio * d_scale[c];
                    d_scale[c] = 0;
                }
            for (size_t c = 0; c < 3; c++) {
                const double log_mean = r->scale_log[i * 6 + c], log_scale = r->scale_log[i * 6 + 3 + c];
                const double e = exp(cut(log_mean)), s = sigmoid(shape[c]), scaled = d_scale[c] * raw[c];
                grad->offset[(i * offsets + k) * 3 + c] += d[c] * e;
                grad->scale_log[i * 6 + c] +=
                    d[c] * r->offset[(i * offsets + k) * 3 + c] * e * slope(log_mean);
                grad->scale_log[i * 6 + 3 + c] += scaled * slope(log_scale);
                d_shape[c] = scaled * (1 - s);
                const double value = sigmoid(color[c]);
                d_color[c] = d[11 + c] * value * (1 - value);
            }
            const double inverse_length = unit_quaternion(shape + 3, q);
            for (int c = 0; c < 4; c++)
                along += q[c] * d[6 + c];
            for (int c = 0; c < 4; c++)
                d_shape[3 + c] = (d[6 + c] - q[c] * along) * inverse_length;
            const double alpha = tanh(act.out[k]);
            d_logit[k] = d[10] * (1 - alpha * alpha);
        }
        networks_backward(r, i, &act, d_logit, grad);
    }
}
