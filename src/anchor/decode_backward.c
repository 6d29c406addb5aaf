/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_backward.c -- dL/dGaussians -> dL/danchors and dL/dnetworks, or dL/dcamera: the adjoint of
   decode.c, over the same chunks.

   Each row of the anchors' gradient belongs to one chunk. Gradients of the networks, or of the camera, are
   summed per block into a record, and the records are added in block order. */
#include "anchor/decode.h"

#include <math.h>
#include <string.h>

#include "anchor/decode_layout.h"
#include "base/clones.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { OUT_WIDTH_MAX = ALPHA_STRIDE + SHAPE_STRIDE_MAX + COLOR_STRIDE_MAX };

/* Layout of a block's record: the gradient of W1 transposed, [INPUT_STRIDE][HIDDEN_STRIDE], with b1 as one
   row; then those of W2 and b2 per network. */
typedef struct record_layout {
    size_t weight_first[DECODER_NETWORKS], bias_first[DECODER_NETWORKS], size;
} record_layout;

typedef struct backward_job {
    const anchors *a;
    const dense_kernels *kernels;
    decode_layout layout;
    decode_weights weights;
    record_layout record;
    const decode_tape *tape;
    const gaussians *d_gaussians;
    anchors *d_anchors; /* wanted together with d_params; NULL: only the camera's gradient is wanted */
    bool packed;        /* d_anchors has rows for visible anchors only */
    float *d_params;
    const decoder *d;
    double *d_camera; /* [block_count][3]; NULL: not wanted */
    size_t block_count;
} backward_job;

static const float zeros[HIDDEN_STRIDE];

static record_layout record_layout_of(const decode_layout *layout)
{
    record_layout record = {.size = HIDDEN_STRIDE * INPUT_STRIDE};
    for (int network = 0; network < DECODER_NETWORKS; network++) {
        record.weight_first[network] = record.size;
        record.size += layout->out_count[network] * ANCHOR_HIDDEN_DIM;
        record.bias_first[network] = record.size;
        record.size += layout->out_stride[network];
    }
    return record;
}

/* Add `rows` rows of `count` values, `stride` apart, to `sum`. */
FASTEST_CLONE static void add_rows(const float *restrict values, size_t rows, size_t stride, size_t count,
                                   float *restrict sum)
{
    for (size_t r = 0; r < rows; r++)
        for (size_t i = 0; i < count; i++)
            sum[i] += values[r * stride + i];
}

/* Propagate the gradients of logits back through the second layer and the ReLU. */
static void hidden_backward(const backward_job *job, const float *hidden, size_t tiled, const float *d_out,
                            float *d_hidden)
{
    for (int network = 0; network < DECODER_NETWORKS; network++)
        job->kernels->product(&(dense_product){.m = tiled,
                                               .n = ANCHOR_HIDDEN_DIM,
                                               .k = job->layout.out_count[network],
                                               .a = d_out + job->layout.out_first[network],
                                               .a_row = job->layout.out_width,
                                               .a_step = 1,
                                               .b = job->weights.out_hidden[network],
                                               .b_row = ANCHOR_HIDDEN_DIM,
                                               .bias = zeros,
                                               .gate = hidden + network * ANCHOR_HIDDEN_DIM,
                                               .c = d_hidden + network * ANCHOR_HIDDEN_DIM,
                                               .c_row = HIDDEN_STRIDE});
}

/* Contribution of one anchor to dL/dcamera, through its direction and distance: moving the camera is moving
   the anchor the opposite way. */
static void view_backward(const backward_job *job, size_t anchor, const float *d_hidden, double d_camera[3])
{
    double d_input[4] = {0}, offset[3], square = 0, along = 0;
    for (int i = 0; i < 4; i++) {
        const float *weight = job->weights.input_hidden + (ANCHOR_FEATURE_DIM + i) * HIDDEN_STRIDE;
        for (int h = 0; h < HIDDEN_STRIDE; h++)
            d_input[i] += (double)weight[h] * (double)d_hidden[h];
    }
    const float *position = job->a->position + anchor * 3;
    for (int c = 0; c < 3; c++) {
        offset[c] = (double)position[c] - (double)job->tape->camera[c];
        square += offset[c] * offset[c];
        along += offset[c] * d_input[c];
    }
    const double distance = sqrt(square), scaled = distance * (double)job->d->distance_scale;
    if (!(distance > 0 && distance < HUGE_VAL))
        return;
    const bool in_range = job->d->has_distance && scaled > 0.5 * (double)job->d->distance_min &&
                          scaled < 2.0 * (double)job->d->distance_max;
    const double d_distance = in_range ? (double)job->d->distance_scale * d_input[3] : 0;
    for (int c = 0; c < 3; c++)
        d_camera[c] -= (d_input[c] - offset[c] * (along / square) + offset[c] * d_distance) / distance;
}

/* Add the networks' gradient of a chunk to a record. */
static void networks_backward(const backward_job *job, size_t rows, const float *input, const float *hidden,
                              const float *d_out, const float *d_hidden, float *record)
{
    const decode_layout *layout = &job->layout;
    for (int network = 0; network < DECODER_NETWORKS; network++) {
        const float *d_logit = d_out + layout->out_first[network];
        job->kernels->product(&(dense_product){.m = layout->out_count[network],
                                               .n = ANCHOR_HIDDEN_DIM,
                                               .k = rows,
                                               .a = d_logit,
                                               .a_row = 1,
                                               .a_step = layout->out_width,
                                               .b = hidden + network * ANCHOR_HIDDEN_DIM,
                                               .b_row = HIDDEN_STRIDE,
                                               .c = record + job->record.weight_first[network],
                                               .c_row = ANCHOR_HIDDEN_DIM});
        add_rows(d_logit, rows, layout->out_width, layout->out_stride[network],
                 record + job->record.bias_first[network]);
    }
    job->kernels->product(&(dense_product){.m = INPUT_STRIDE,
                                           .n = HIDDEN_STRIDE,
                                           .k = rows,
                                           .a = input,
                                           .a_row = 1,
                                           .a_step = INPUT_STRIDE,
                                           .b = d_hidden,
                                           .b_row = HIDDEN_STRIDE,
                                           .c = record,
                                           .c_row = HIDDEN_STRIDE});
}

FASTEST_CLONE static void add_features(const float *restrict d_feature, size_t rows, const uint32_t *target,
                                       float *restrict sum)
{
    for (size_t r = 0; r < rows; r++)
        for (size_t i = 0; i < ANCHOR_FEATURE_DIM; i++)
            sum[(size_t)target[r] * ANCHOR_FEATURE_DIM + i] += d_feature[r * ANCHOR_FEATURE_DIM + i];
}

static void chunk_backward(const backward_job *job, size_t begin, size_t rows, float *record,
                           double *d_camera)
{
    const decode_tape *tape = job->tape;
    const size_t chunk = begin / DECODE_CHUNK, tiled = decode_tiled(rows);
    _Alignas(64) float input[DECODE_CHUNK * INPUT_STRIDE], hidden[DECODE_CHUNK * HIDDEN_STRIDE],
        d_hidden[DECODE_CHUNK * HIDDEN_STRIDE], d_out[DECODE_CHUNK * OUT_WIDTH_MAX],
        d_feature[DECODE_CHUNK * ANCHOR_FEATURE_DIM], extent[DECODE_CHUNK * 6], d_scale_log[DECODE_CHUNK * 6],
        view[DECODE_CHUNK * VIEW_COUNT];
    uint32_t anchor[DECODE_CHUNK], target[DECODE_CHUNK];
    for (size_t r = 0; r < rows; r++) {
        const uint32_t place = tape->place[begin + r];
        anchor[r] = tape->visible[place];
        target[r] = job->packed ? place : anchor[r];
        memcpy(extent + r * 6, job->a->scale_log + (size_t)anchor[r] * 6, 6 * sizeof *extent);
        memcpy(view + r * VIEW_COUNT, tape->view + (size_t)place * VIEW_COUNT, VIEW_COUNT * sizeof *view);
    }
    job->kernels->exp(extent, rows * 6);
    memset(d_out, 0, tiled * job->layout.out_width * sizeof *d_out);
    memset(d_scale_log, 0, rows * 6 * sizeof *d_scale_log);
    decode_activations_backward(
        &(decode_slopes){.a = job->a,
                         .tape = tape,
                         .layout = &job->layout,
                         .d_gaussians = job->d_gaussians,
                         .begin = begin,
                         .anchor = anchor,
                         .target = target,
                         .extent = extent,
                         .d_out = d_out,
                         .d_scale_log = d_scale_log,
                         .d_offset = job->d_anchors != NULL ? job->d_anchors->offset : NULL},
        tape->first[chunk], tape->first[chunk + 1]);

    decode_inputs(job->a, anchor, view, rows, input);
    decode_hidden(job->kernels, &job->weights, input, tiled, DECODER_OPACITY, DECODER_NETWORKS, hidden);
    hidden_backward(job, hidden, tiled, d_out, d_hidden);
    if (job->d_anchors == NULL) {
        for (size_t r = 0; r < rows; r++)
            view_backward(job, anchor[r], d_hidden + r * HIDDEN_STRIDE, d_camera);
        return;
    }
    networks_backward(job, rows, input, hidden, d_out, d_hidden, record);
    job->kernels->product(&(dense_product){.m = tiled,
                                           .n = ANCHOR_FEATURE_DIM,
                                           .k = HIDDEN_STRIDE,
                                           .a = d_hidden,
                                           .a_row = HIDDEN_STRIDE,
                                           .a_step = 1,
                                           .b = job->weights.hidden_input,
                                           .b_row = ANCHOR_FEATURE_DIM,
                                           .bias = zeros,
                                           .c = d_feature,
                                           .c_row = ANCHOR_FEATURE_DIM});
    add_features(d_feature, rows, target, job->d_anchors->feature);
    for (size_t r = 0; r < rows; r++) {
        const float *scale_log = job->a->scale_log + (size_t)anchor[r] * 6;
        float *sum = job->d_anchors->scale_log + (size_t)target[r] * 6;
        for (size_t c = 0; c < 6; c++)
            sum[c] += decode_cut_gradient(scale_log[c], d_scale_log[r * 6 + c]);
    }
}

static void backward_block(size_t block, size_t begin, size_t end, void *context)
{
    const backward_job *job = context;
    const decode_tape *tape = job->tape;
    float *record = job->d_anchors != NULL ? tape->block_grad + block * job->record.size : NULL;
    double *d_camera = job->d_camera != NULL ? job->d_camera + 3 * block : NULL;
    if (record != NULL)
        memset(record, 0, job->record.size * sizeof *record);
    for (size_t place = begin; place < end; place += DECODE_CHUNK)
        if (tape->filled[place / DECODE_CHUNK] > 0)
            chunk_backward(job, place, tape->filled[place / DECODE_CHUNK], record, d_camera);
}

/* Sum entries [entry, entry + count) of the records in block order. */
static void sum_records(const backward_job *job, size_t entry, size_t count, float *sum)
{
    memset(sum, 0, count * sizeof *sum);
    add_rows(job->tape->block_grad + entry, job->block_count, job->record.size, count, sum);
}

/* Sum the records: first the rows of W1 transposed, including the bias, then the rows of W2, each with its
   bias. */
static void reduce_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const backward_job *job = context;
    const size_t in = job->layout.input_count;
    float sum[HIDDEN_STRIDE];
    for (size_t row = begin; row < end; row++) {
        if (row < INPUT_STRIDE) {
            if (row >= in && row != INPUT_ONE)
                continue;
            sum_records(job, row * HIDDEN_STRIDE, HIDDEN_STRIDE, sum);
            for (size_t column = 0; column < HIDDEN_STRIDE; column++) {
                const size_t network = column / ANCHOR_HIDDEN_DIM, h = column % ANCHOR_HIDDEN_DIM;
                float *d_weight = job->d_params + job->layout.param_first[network];
                d_weight[row == INPUT_ONE ? ANCHOR_HIDDEN_DIM * in + h : h * in + row] += sum[column];
            }
        } else {
            size_t network = 0, o = row - INPUT_STRIDE;
            for (; o >= job->layout.out_count[network]; network++)
                o -= job->layout.out_count[network];
            float *d_weight = job->d_params + job->layout.param_first[network] + ANCHOR_HIDDEN_DIM * (in + 1);
            sum_records(job, job->record.weight_first[network] + o * ANCHOR_HIDDEN_DIM, ANCHOR_HIDDEN_DIM,
                        sum);
            for (size_t h = 0; h < ANCHOR_HIDDEN_DIM; h++)
                d_weight[o * ANCHOR_HIDDEN_DIM + h] += sum[h];
            sum_records(job, job->record.bias_first[network] + o, 1, sum);
            d_weight[job->layout.out_count[network] * ANCHOR_HIDDEN_DIM + o] += sum[0];
        }
    }
}

/* Common start of both adjoints; if tape->kept_count is 0 afterwards, there is nothing to do. */
static gbt_status open_job(const anchors *a, const decoder *d, decode_tape *tape,
                           const gaussians *d_gaussians, backward_job *job, gbt_error *err)
{
    if (a->offset_count != d->offset_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "decode adjoint: anchors have %d offsets, the decoder %d",
                         a->offset_count, d->offset_count);
    if (d_gaussians->count != tape->kept_count)
        return base_fail(err, GBT_ERR_ARGUMENT, "decode adjoint: gradient of %zu Gaussians (wanted %zu)",
                         d_gaussians->count, tape->kept_count);
    *job = (backward_job){.a = a,
                          .d = d,
                          .kernels = dense_best(),
                          .layout = decode_layout_of(d),
                          .tape = tape,
                          .d_gaussians = d_gaussians,
                          .block_count = parallel_block_count(tape->visible_count, DECODE_GRAIN)};
    return decode_pack_weights(d, &job->layout, tape, &job->weights, err);
}

gbt_status decode_backward(const anchors *a, const decoder *d, decode_tape *tape,
                           const gaussians *d_gaussians, anchors *d_anchors, float *d_params, gbt_error *err)
{
    backward_job job;
    if (d_anchors->offset_count != a->offset_count ||
        (d_anchors->count != a->count && d_anchors->count != tape->visible_count))
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "decode adjoint: gradient of %zu anchors with %d offsets (wanted %zu, %d)",
                         d_anchors->count, d_anchors->offset_count, a->count, a->offset_count);
    GBT_TRY(open_job(a, d, tape, d_gaussians, &job, err));
    if (tape->kept_count == 0)
        return GBT_OK;
    job.d_anchors = d_anchors;
    job.packed = d_anchors->count == tape->visible_count;
    job.d_params = d_params;
    job.record = record_layout_of(&job.layout);
    size_t row_count = INPUT_STRIDE;
    for (int network = 0; network < DECODER_NETWORKS; network++)
        row_count += job.layout.out_count[network];
    void *records = tape->block_grad;
    GBT_TRY(mem_reserve(&records, &tape->block_capacity, 0, job.block_count * job.record.size, sizeof(float),
                        "decode adjoint", err));
    tape->block_grad = records;
    parallel_blocks(tape->visible_count, DECODE_GRAIN, backward_block, &job);
    parallel_blocks(row_count, 8, reduce_rows, &job);
    return GBT_OK;
}

gbt_status decode_backward_camera(const anchors *a, const decoder *d, decode_tape *tape,
                                  const gaussians *d_gaussians, double d_camera[3], gbt_error *err)
{
    backward_job job;
    d_camera[0] = d_camera[1] = d_camera[2] = 0;
    GBT_TRY(open_job(a, d, tape, d_gaussians, &job, err));
    if (tape->kept_count == 0)
        return GBT_OK;
    job.d_camera = mem_calloc(job.block_count, 3 * sizeof *job.d_camera, "decode adjoint", err);
    if (job.d_camera == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(tape->visible_count, DECODE_GRAIN, backward_block, &job);
    for (size_t i = 0; i < 3 * job.block_count; i++)
        d_camera[i % 3] += job.d_camera[i];
    mem_free(job.d_camera);
    return GBT_OK;
}
