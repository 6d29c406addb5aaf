/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode.c -- anchors + camera centre -> Gaussians.

   visible anchors --> input --> opacity network --count per chunk--> prefix sum
        --> anchors that have Gaussians --> shape and colour networks --> packed arrays
                            (kept for the adjoint)

   Two passes over the same chunks: the first evaluates opacities and so decides which Gaussians exist; the
   second computes everything else of those, directly at their final positions. Inputs (except directions and
   distances) and hidden layers are recomputed in each pass and in the adjoint, because that is faster than
   storing and loading them. */
#include "anchor/decode.h"

#include <math.h>
#include <string.h>

#include "anchor/activations.h"
#include "anchor/decode_layout.h"
#include "base/clones.h"
#include "base/compare.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

typedef struct forward_job {
    const anchors *a;
    const decoder *d;
    const dense_kernels *kernels;
    decode_layout layout;
    decode_weights weights;
    float opacity_min;
    gaussians *out;
    decode_tape *tape;
} forward_job;

static size_t round_up(size_t count, size_t multiple) { return (count + multiple - 1) / multiple * multiple; }

static void decide_chunk(const forward_job *job, size_t begin, size_t end)
{
    decode_tape *tape = job->tape;
    const size_t rows = end - begin, tiled = decode_tiled(rows), offsets = job->layout.offset_count;
    float *alpha = tape->alpha + begin * offsets, *view = tape->view + begin * VIEW_COUNT;
    _Alignas(64) float input[DECODE_CHUNK * INPUT_STRIDE], hidden[DECODE_CHUNK * ANCHOR_HIDDEN_DIM],
        logits[DECODE_CHUNK * ALPHA_STRIDE];
    decode_views(job->a, job->d, tape->camera, tape->visible + begin, rows, view);
    decode_inputs(job->a, tape->visible + begin, view, rows, input);
    decode_hidden(job->kernels, &job->weights, input, tiled, DECODER_OPACITY, DECODER_OPACITY + 1, hidden);
    job->kernels->product(&(dense_product){.m = tiled,
                                           .n = ALPHA_STRIDE,
                                           .k = ANCHOR_HIDDEN_DIM,
                                           .a = hidden,
                                           .a_row = ANCHOR_HIDDEN_DIM,
                                           .a_step = 1,
                                           .b = job->weights.hidden_out[DECODER_OPACITY],
                                           .b_row = ALPHA_STRIDE,
                                           .bias = job->weights.out_bias[DECODER_OPACITY],
                                           .c = logits,
                                           .c_row = ALPHA_STRIDE});
    for (size_t r = 0; r < rows; r++)
        for (size_t k = 0; k < offsets; k++)
            alpha[r * offsets + k] = logits[r * ALPHA_STRIDE + k];
    job->kernels->tanh(alpha, rows * offsets);
    size_t kept = 0, filled = 0;
    for (size_t r = 0; r < rows; r++) {
        const size_t before = kept;
        float sum = 0.0f;
        for (size_t k = 0; k < offsets; k++) {
            const float value = alpha[r * offsets + k];
            sum += value > 0.0f ? value : 0.0f;
            kept += value > job->opacity_min;
        }
        tape->opacity_sum[begin + r] = sum;
        if (kept > before)
            tape->place[begin + filled++] = (uint32_t)(begin + r);
    }
    tape->first[begin / DECODE_CHUNK] = kept;
    tape->filled[begin / DECODE_CHUNK] = (uint32_t)filled;
}

static void decide_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    for (size_t place = begin; place < end; place += DECODE_CHUNK)
        decide_chunk(context, place, smaller_size(place + DECODE_CHUNK, end));
}

/* Copy the logits of the kept Gaussians to their positions in the tape, and values without an activation to
   `out`. */
static size_t gather_kept(const forward_job *job, size_t begin, size_t rows, const float *shape,
                          const float *color, const float *extent, uint16_t *row_of)
{
    decode_tape *tape = job->tape;
    gaussians *out = job->out;
    const size_t offsets = job->layout.offset_count, first = tape->first[begin / DECODE_CHUNK],
                 stride = tape->output_stride;
    const size_t shape_stride = job->layout.out_stride[DECODER_SHAPE],
                 color_stride = job->layout.out_stride[DECODER_COLOR];
    float *kept = tape->output;
    size_t g = first;
    for (size_t r = 0; r < rows; r++) {
        const size_t place = tape->place[begin + r], anchor = tape->visible[place];
        const float *alpha = tape->alpha + place * offsets, *e = extent + r * 6;
        const float *x = job->a->position + anchor * 3, *offset = job->a->offset + anchor * offsets * 3;
        for (size_t k = 0; k < offsets; k++) {
            if (!(alpha[k] > job->opacity_min))
                continue;
            const float *s = shape + r * shape_stride + k * DECODER_SHAPE_OUTPUTS,
                        *c = color + r * color_stride + k * DECODER_COLOR_OUTPUTS;
            kept[KEPT_ALPHA * stride + g] = alpha[k];
            /* KEPT_QUAT follows KEPT_SIGMOID, in the order of the network's outputs. */
            for (int i = 0; i < DECODER_SHAPE_OUTPUTS; i++)
                kept[(size_t)(KEPT_SIGMOID + i) * stride + g] = s[i];
            for (int i = 0; i < DECODER_COLOR_OUTPUTS; i++)
                kept[(size_t)(KEPT_COLOR + i) * stride + g] = c[i];
            out->opacity[g] = alpha[k];
            out->mean_x[g] =
                activation_clamp(x[0] + offset[k * 3 + 0] * e[0], -DECODE_MEAN_LIMIT, DECODE_MEAN_LIMIT);
            out->mean_y[g] =
                activation_clamp(x[1] + offset[k * 3 + 1] * e[1], -DECODE_MEAN_LIMIT, DECODE_MEAN_LIMIT);
            out->mean_z[g] =
                activation_clamp(x[2] + offset[k * 3 + 2] * e[2], -DECODE_MEAN_LIMIT, DECODE_MEAN_LIMIT);
            tape->slot[g] = (uint32_t)(place * offsets + k);
            row_of[g - first] = (uint16_t)r;
            g++;
        }
    }
    return g - first;
}

FASTEST_CLONE static void hold_ratio(float *const scale[3], size_t count)
{
    float *restrict x = scale[0], *restrict y = scale[1], *restrict z = scale[2];
    for (size_t i = 0; i < count; i++) {
        const float least = DECODE_SCALE_RATIO * larger(x[i], larger(y[i], z[i]));
        x[i] = larger(x[i], least);
        y[i] = larger(y[i], least);
        z[i] = larger(z[i], least);
    }
}

static void emit_chunk(const forward_job *job, size_t begin)
{
    decode_tape *tape = job->tape;
    const size_t rows = tape->filled[begin / DECODE_CHUNK], tiled = decode_tiled(rows);
    const uint32_t *place = tape->place + begin;
    enum { AFTER_OPACITY = DECODER_NETWORKS - DECODER_SHAPE, HIDDEN = AFTER_OPACITY * ANCHOR_HIDDEN_DIM };
    _Alignas(64) float input[DECODE_CHUNK * INPUT_STRIDE], hidden[DECODE_CHUNK * HIDDEN],
        shape[DECODE_CHUNK * SHAPE_STRIDE_MAX], color[DECODE_CHUNK * COLOR_STRIDE_MAX],
        extent[DECODE_CHUNK * 6], view[DECODE_CHUNK * VIEW_COUNT];
    uint16_t row_of[CHUNK_SLOTS];
    uint32_t anchor[DECODE_CHUNK];
    float *const logits[AFTER_OPACITY] = {shape, color};
    for (size_t r = 0; r < rows; r++) {
        anchor[r] = tape->visible[place[r]];
        memcpy(view + r * VIEW_COUNT, tape->view + (size_t)place[r] * VIEW_COUNT, VIEW_COUNT * sizeof *view);
    }
    decode_inputs(job->a, anchor, view, rows, input);
    decode_hidden(job->kernels, &job->weights, input, tiled, DECODER_SHAPE, DECODER_NETWORKS, hidden);
    for (int network = DECODER_SHAPE; network < DECODER_NETWORKS; network++) {
        const size_t stride = job->layout.out_stride[network];
        job->kernels->product(&(dense_product){.m = tiled,
                                               .n = stride,
                                               .k = ANCHOR_HIDDEN_DIM,
                                               .a = hidden + (network - DECODER_SHAPE) * ANCHOR_HIDDEN_DIM,
                                               .a_row = HIDDEN,
                                               .a_step = 1,
                                               .b = job->weights.hidden_out[network],
                                               .b_row = stride,
                                               .bias = job->weights.out_bias[network],
                                               .c = logits[network - DECODER_SHAPE],
                                               .c_row = stride});
    }
    for (size_t r = 0; r < rows; r++)
        memcpy(extent + r * 6, job->a->scale_log + (size_t)anchor[r] * 6, 6 * sizeof *extent);
    job->kernels->exp(extent, rows * 6);

    const size_t n = gather_kept(job, begin, rows, shape, color, extent, row_of);
    const size_t first = tape->first[begin / DECODE_CHUNK], stride = tape->output_stride;
    float *kept = tape->output + first;
    for (int i = 0; i < 3; i++) {
        job->kernels->sigmoid(kept + (size_t)(KEPT_SIGMOID + i) * stride, n);
        job->kernels->sigmoid(kept + (size_t)(KEPT_COLOR + i) * stride, n);
    }
    job->kernels->normalize(kept + (KEPT_QUAT + 0) * stride, kept + (KEPT_QUAT + 1) * stride,
                            kept + (KEPT_QUAT + 2) * stride, kept + (KEPT_QUAT + 3) * stride,
                            kept + KEPT_INVERSE_LENGTH * stride, n);

    gaussians *out = job->out;
    float *const scale[3] = {out->scale_x + first, out->scale_y + first, out->scale_z + first};
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            scale[c][i] = extent[row_of[i] * 6 + 3 + c] * kept[(size_t)(KEPT_SIGMOID + c) * stride + i];
    hold_ratio(scale, n);
    float *const copied[7] = {out->quat_w, out->quat_x, out->quat_y, out->quat_z,
                              out->red,    out->green,  out->blue};
    const int field[7] = {KEPT_QUAT,  KEPT_QUAT + 1,  KEPT_QUAT + 2, KEPT_QUAT + 3,
                          KEPT_COLOR, KEPT_COLOR + 1, KEPT_COLOR + 2};
    for (int i = 0; i < 7; i++)
        memcpy(copied[i] + first, kept + (size_t)field[i] * stride, n * sizeof(float));
}

static void emit_block(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    for (size_t place = begin; place < end; place += DECODE_CHUNK)
        emit_chunk(context, place);
}

static gbt_status reserve_places(decode_tape *tape, size_t visible_count, gbt_error *err)
{
    const size_t places = decode_tiled(visible_count);
    const size_t chunks = parallel_block_count(visible_count, DECODE_CHUNK);
    GBT_TRY(mem_reserve((void **)&tape->first, &tape->first_capacity, 0, chunks + 1, sizeof *tape->first,
                        "decode tape", err));
    GBT_TRY(mem_reserve((void **)&tape->filled, &tape->filled_capacity, 0, chunks, sizeof *tape->filled,
                        "decode tape", err));
    GBT_TRY(mem_reserve((void **)&tape->place, &tape->place_capacity, 0, places, sizeof *tape->place,
                        "decode tape", err));
    if (places <= tape->capacity && tape->alpha != NULL)
        return GBT_OK;
    const size_t capacity = decode_tiled(places + places / 4);
    float *block = /* one allocation for three arrays, owned by `alpha` */
        mem_alloc(capacity, (ALPHA_STRIDE + 1 + VIEW_COUNT) * sizeof *block, "decode tape", err);
    if (block == NULL)
        return GBT_ERR_NO_MEMORY;
    mem_free(tape->alpha);
    tape->capacity = capacity;
    tape->alpha = block;
    tape->opacity_sum = tape->alpha + capacity * ALPHA_STRIDE;
    tape->view = tape->opacity_sum + capacity;
    return GBT_OK;
}

static gbt_status reserve_kept(decode_tape *tape, size_t count, gbt_error *err)
{
    if (count <= tape->slot_capacity && tape->slot != NULL)
        return GBT_OK;
    const size_t capacity = round_up(count + count / 4 + 1, DENSE_COLUMNS);
    uint32_t *slot = mem_alloc(capacity, sizeof *slot, "decode slots", err);
    float *output = mem_alloc(capacity, KEPT_FIELDS * sizeof *output, "decode tape", err);
    if (slot == NULL || output == NULL) {
        mem_free(slot);
        mem_free(output);
        return GBT_ERR_NO_MEMORY;
    }
    mem_free(tape->slot);
    mem_free(tape->output);
    tape->slot = slot;
    tape->output = output;
    tape->slot_capacity = tape->output_stride = capacity;
    return GBT_OK;
}

static gbt_status check_arguments(const anchors *a, const decoder *d, const uint32_t *visible,
                                  size_t visible_count, gbt_error *err)
{
    if (d->offset_count < 1 || d->offset_count > ANCHOR_MAX_OFFSETS || a->offset_count != d->offset_count)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "decode: anchors have %d offsets, the decoder %d (wanted equal, 1 to %d)",
                         a->offset_count, d->offset_count, ANCHOR_MAX_OFFSETS);
    if (visible_count > UINT32_MAX / ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_ARGUMENT, "decode: %zu visible anchors (wanted at most %u)",
                         visible_count, (unsigned)(UINT32_MAX / ANCHOR_MAX_OFFSETS));
    for (size_t i = 0; i < visible_count; i++)
        if (visible[i] >= a->count || (i > 0 && visible[i] <= visible[i - 1]))
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "decode: visible[%zu] is %u (wanted ascending, below %zu)", i, visible[i],
                             a->count);
    return GBT_OK;
}

gbt_status decode_forward(const anchors *a, const decoder *d, const float camera_center[3],
                          const uint32_t *visible, size_t visible_count, float opacity_min, gaussians *out,
                          decode_tape *tape, gbt_error *err)
{
    tape->visible_count = 0;
    tape->kept_count = 0;
    GBT_TRY(check_arguments(a, d, visible, visible_count, err));
    forward_job job = {.a = a,
                       .d = d,
                       .kernels = dense_best(),
                       .layout = decode_layout_of(d),
                       .opacity_min = opacity_min,
                       .out = out,
                       .tape = tape};
    GBT_TRY(decode_pack_weights(d, &job.layout, tape, &job.weights, err));
    GBT_TRY(reserve_places(tape, visible_count, err));
    tape->visible = visible;
    memcpy(tape->camera, camera_center, sizeof tape->camera);
    parallel_blocks(visible_count, DECODE_GRAIN, decide_block, &job);

    const size_t chunks = parallel_block_count(visible_count, DECODE_CHUNK);
    size_t kept = 0;
    for (size_t i = 0; i < chunks; i++) {
        const size_t here = tape->first[i];
        tape->first[i] = kept;
        kept += here;
    }
    tape->first[chunks] = kept;
    GBT_TRY(reserve_kept(tape, kept, err));
    GBT_TRY(gaussians_resize(out, kept, err));
    parallel_blocks(visible_count, DECODE_GRAIN, emit_block, &job);
    gaussians_pad(out);
    tape->visible_count = visible_count;
    tape->kept_count = kept;
    return GBT_OK;
}

void decode_tape_free(decode_tape *tape)
{
    mem_free(tape->alpha);
    mem_free(tape->output);
    mem_free(tape->first);
    mem_free(tape->filled);
    mem_free(tape->place);
    mem_free(tape->weights);
    mem_free(tape->block_grad);
    mem_free(tape->slot);
    memset(tape, 0, sizeof *tape);
}
