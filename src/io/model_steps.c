/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_steps.c -- measures how sensitive pictures are to each parameter; derives quantization steps. */
#include "io/model_steps.h"

#include <math.h>

#include "anchor/decode.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"

enum { DIM = ANCHOR_FEATURE_DIM, GUESS_VIEWS = 16, DOUBLINGS_MAX = 2 };

/* The guess without views counts every Gaussian as visible. Only about 1 / VISIBLE_INVERSE of the area that
   Gaussians could cover is in front and in a picture, as measured against real views on three scenes
   (docs/compression.md). */
#define VISIBLE_INVERSE 30.0

/* ---- sums ---- */

gbt_status model_sensitivity_start(model_sensitivity *s, size_t count, gbt_error *err)
{
    *s = (model_sensitivity){.count = count,
                             .anchor = mem_calloc(count, sizeof *s->anchor, "sensitivities", err)};
    return s->anchor != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static double sum_squares(const float *x, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += (double)x[i] * (double)x[i];
    return sum;
}

/* The number of learned floats of one anchor. */
static size_t channel_count(const anchors *a)
{
    size_t count = 0;
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
        count += anchors_width(a, f);
    return count;
}

void model_sensitivity_add(model_sensitivity *s, const anchors *a, const anchors *gradient, double values)
{
    const size_t k3 = (size_t)a->offset_count * 3, channels = channel_count(a);
    s->values += values;
    for (size_t i = 0; i < s->count; i++) {
        double all = 0;
        for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
            all += sum_squares(gradient->field[f] + i * anchors_width(a, f), anchors_width(a, f));
        if (!(all > 0) || !isfinite(all))
            continue;
        s->anchor[i] += all / (double)channels;
        for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++) {
            const size_t width = anchors_width(a, f);
            for (size_t c = 0; c < width; c++) {
                const double x = (double)gradient->field[f][i * width + c];
                s->field[f][c] += x * x;
            }
        }
        const float *feature = gradient->feature + i * DIM, *offset = gradient->offset + i * k3;
        for (size_t axis = 0; axis < 3; axis++) { /* mean = position + offset exp(scale_log) */
            double sum = 0;
            for (size_t c = axis; c < k3; c += 3)
                sum += (double)offset[c];
            sum *= exp(-fmax(fmin((double)a->scale_log[i * 6 + axis], 30), -30));
            s->position += sum * sum / 3;
        }
        for (size_t c = 0; c < DIM; c++)
            for (size_t d = 0; d <= c; d++)
                s->feature[c][d] += (double)feature[c] * (double)feature[d];
    }
}

void model_sensitivity_end(model_sensitivity *s)
{
    const double count = s->count > 0 ? (double)s->count : 1, scale = s->values > 0 ? 1 / s->values : 0;
    for (size_t i = 0; i < s->count; i++)
        s->anchor[i] *= scale;
    s->position *= scale / count;
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++)
        for (size_t c = 0; c < MODEL_WIDTH_MAX; c++)
            s->field[f][c] *= scale / count;
    double trace = 0;
    for (size_t c = 0; c < DIM; c++)
        trace += s->feature[c][c] *= scale / count;
    for (size_t c = 0; c < DIM; c++) {
        for (size_t d = 0; d < c; d++)
            s->feature[c][d] = s->feature[d][c] = s->feature[c][d] * scale / count;
        s->feature[c][c] += 0.05 * trace / DIM + 1e-30;
    }
    s->values = 1;
}

void model_sensitivity_free(model_sensitivity *s)
{
    mem_free(s->anchor);
    *s = (model_sensitivity){0};
}

/* ---- an estimate without views ---- */

/* Place a camera at random around an anchor, at the distance that training cameras had from the scene. */
static void guess_camera(const model *m, uint64_t view, float camera[3])
{
    const decoder *d = &m->decoder;
    const float distance = d->has_distance && d->distance_scale > 0 ? 1 / d->distance_scale : m->extent;
    const size_t at = (size_t)((double)rng_uniform(1, 0, view) * (double)m->anchors.count);
    double way[3], length = 0;
    for (uint64_t k = 0; k < 3; k++) {
        way[k] = (double)rng_normal(1, 1 + k, view);
        length += way[k] * way[k];
    }
    for (int k = 0; k < 3; k++)
        camera[k] =
            m->anchors.position[3 * at + (size_t)k] + distance * (float)(way[k] / sqrt(length + 1e-30));
}

/* A random gradient of one Gaussian such as random signs on all pixels that it covers, unoccluded, would
   give. A sum over N random signs grows with sqrt(N), so the size is the square root of the area (of the two
   longer axes), times the derivative by colour, opacity or shape. Returns area times opacity. */
static double guess_gradient(const gaussians *g, size_t i, uint64_t view, gaussians *out)
{
    const float x = g->scale_x[i], y = g->scale_y[i], z = g->scale_z[i];
    const float most = fmaxf(x, fmaxf(y, z)), least = fminf(x, fminf(y, z)),
                middle = fmaxf(fminf(x, y), fminf(fmaxf(x, y), z));
    const float opacity = fmaxf(g->opacity[i], 0), root = sqrtf(most * middle), seen = root * opacity,
                turn = 0.5f * seen * logf(most / least);
    const float half = 0.5f * seen, move = half / middle;
    float *const fields[] = {out->opacity, out->red,    out->green,   out->blue,    out->mean_x,
                             out->mean_y,  out->mean_z, out->scale_x, out->scale_y, out->scale_z,
                             out->quat_w,  out->quat_x, out->quat_y,  out->quat_z};
    const float size[] = {root,     seen,     seen,     seen, move, move, move,
                          half / x, half / y, half / z, turn, turn, turn, turn};
    for (size_t f = 0; f < sizeof fields / sizeof *fields; f++)
        fields[f][i] = rng_uniform(2 + view, f, i) < 0.5f ? -size[f] : size[f];
    return (double)(seen * root);
}

typedef struct guess {
    gaussians drawn, gradient;
    decode_tape tape;
    anchors d_anchors;
    float *d_params;
    uint32_t *visible;
} guess;

static gbt_status guess_view(const model *m, guess *g, uint64_t view, model_sensitivity *s, gbt_error *err)
{
    const anchors *a = &m->anchors;
    float camera[3];
    guess_camera(m, view, camera);
    /* also fills g->drawn with the Gaussians */
    GBT_TRY(decode_forward(a, &m->decoder, camera, g->visible, a->count, -0.3f, &g->drawn, &g->tape, err));
    GBT_TRY(gaussians_resize(&g->gradient, g->drawn.count, err));
    gaussians_zero(&g->gradient);
    double covered = 0;
    for (size_t i = 0; i < g->drawn.count; i++)
        covered += guess_gradient(&g->drawn, i, view, &g->gradient);
    anchors_zero_learned(&g->d_anchors);
    GBT_TRY(decode_backward(a, &m->decoder, &g->tape, &g->gradient, &g->d_anchors, g->d_params, err));
    model_sensitivity_add(s, a, &g->d_anchors, 3 * VISIBLE_INVERSE * covered);
    return GBT_OK;
}

gbt_status model_sensitivity_guess(const model *m, model_sensitivity *s, gbt_error *err)
{
    const size_t count = m->anchors.count;
    GBT_TRY(model_sensitivity_start(s, count, err));
    guess g = {.d_anchors.offset_count = m->anchors.offset_count};
    gbt_status status = anchors_resize(&g.d_anchors, count, err);
    g.d_params = mem_calloc(m->decoder.param_count, sizeof *g.d_params, "gradient", err);
    g.visible = mem_alloc(count, sizeof *g.visible, "anchors", err);
    if (status == GBT_OK && (g.d_params == NULL || g.visible == NULL))
        status = GBT_ERR_NO_MEMORY;
    for (size_t i = 0; i < count && status == GBT_OK; i++)
        g.visible[i] = (uint32_t)i;
    for (uint64_t view = 0; view < GUESS_VIEWS && count > 0 && status == GBT_OK; view++)
        status = guess_view(m, &g, view, s, err);
    model_sensitivity_end(s);
    mem_free(s->anchor);
    s->anchor = NULL;
    gaussians_free(&g.drawn);
    gaussians_free(&g.gradient);
    decode_tape_free(&g.tape);
    anchors_free(&g.d_anchors);
    mem_free(g.d_params);
    mem_free(g.visible);
    return status;
}

/* ---- steps ---- */

static const struct {
    double divisor, most;
    bool of_largest;
} step_limits[ANCHOR_FIELDS] = {
#define X(part, name, field, divisor, most, of_largest) [field] = {divisor, most, of_largest},
    CODE_FIELD_LIST(X)
#undef X
};

static double largest_of(const float *values, size_t count)
{
    double largest = 0;
    for (size_t i = 0; i < count; i++)
        largest = fmax(largest, fabs((double)values[i]));
    return largest;
}

/* The step within its limits; the upper limit where the sensitivity is 0. */
static double step_of(double noise, double sensitivity, double least, double most)
{
    const double step = sensitivity > 0 ? noise / sqrt(sensitivity) : most;
    return fmin(fmax(isfinite(step) ? step : most, least), most);
}

static gbt_status find_doublings(const model_sensitivity *s, model_steps *out, gbt_error *err)
{
    out->count = s->count;
    out->doubling = mem_calloc(s->count, sizeof *out->doubling, "steps", err);
    if (out->doubling == NULL)
        return GBT_ERR_NO_MEMORY;
    double mean = 0;
    for (size_t i = 0; i < s->count; i++)
        mean += s->anchor[i] / (double)s->count;
    for (size_t i = 0; i < s->count; i++) {
        const double doublings = mean > 0 ? floor(0.5 * log2(mean / (s->anchor[i] + 1e-6 * mean)) + 0.5) : 0;
        out->doubling[i] = (uint8_t)fmin(fmax(doublings, 0), DOUBLINGS_MAX);
    }
    return GBT_OK;
}

/* The factor that all steps have in common at a quality. Uniform noise as wide as one step has the variance
   step^2 / 12. */
static double noise_at(const anchors *a, double quality)
{
    return sqrt(12 * pow(10, -quality / 10) / ((double)channel_count(a) * fmax((double)a->count, 1)));
}

/* The smallest cell that can be stored: the anchor farthest from the first one is 2^20 cells away. */
static double least_cell(const anchors *a)
{
    double side = 0;
    for (size_t i = 0; i < a->count * 3; i++)
        side = fmax(side, fabs((double)a->position[i] - (double)a->position[i % 3]));
    return fmax(side, 1e-20) / (1 << 20);
}

bool model_positions_fit(const model *m, const model_sensitivity *s, double quality)
{
    return step_of(noise_at(&m->anchors, quality), s->position, 0, INFINITY) >= least_cell(&m->anchors);
}

gbt_status model_steps_at(const model *m, const model_sensitivity *s, double quality, model_steps *out,
                          gbt_error *err)
{
    const anchors *a = &m->anchors;
    if (!(quality > 0 && quality < 200))
        return base_fail(err, GBT_ERR_ARGUMENT, "quality: wanted 0 to 200 dB, got %g", quality);
    if (s->count != a->count)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "sensitivities of another model (wanted %zu anchors, got %zu)", a->count, s->count);
    const double noise = noise_at(a, quality), cell = least_cell(a);
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS; f++) {
        const size_t width = anchors_width(a, f);
        const double unit =
            step_limits[f].of_largest ? fmax(largest_of(a->field[f], a->count * width), 1e-20) : 1;
        for (size_t c = 0; c < width; c++)
            out->field[f][c] = (float)step_of(noise, f == ANCHOR_FEATURE ? s->feature[c][c] : s->field[f][c],
                                              unit / step_limits[f].divisor, unit * step_limits[f].most);
    }
    out->position = step_of(noise, s->position, cell, cell * (1 << 14));
    return s->anchor != NULL ? find_doublings(s, out, err) : GBT_OK;
}

void model_steps_free(model_steps *steps)
{
    mem_free(steps->doubling);
    *steps = (model_steps){0};
}
