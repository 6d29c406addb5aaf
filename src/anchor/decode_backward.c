/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/decode_backward.c -- dL/dGaussians -> dL/danchors and dL/dnetworks, or dL/dcamera: the adjoint of
   decode.c, over the same chunks.

   Rows of the anchors' gradient belong to one chunk each. The networks' gradient, or the camera's, is one
   record per block, added in block order. */
#include "anchor/decode.h"

#include <math.h>
#include <string.h>

#include "anchor/decode_layout.h"
#include "base/clones.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { OUT_STRIDE_MAX = ALPHA_STRIDE + SHAPE_STRIDE_MAX + COLOR_STRIDE_MAX };

/* A block's record: gradients of W1 with the bias as a column, then of W2 and b2 per head. */
typedef struct record_layout {
    size_t weight_first[HEAD_COUNT], bias_first[HEAD_COUNT], size;
} record_layout;

typedef struct backward_job {
    const anchors *a;
    const dense_kernels *kernels;
    decode_layout layout;
    decode_weights weights;
    record_layout record;
    const decode_tape *tape;
    const gaussians *d_gaussians;
    anchors *d_anchors; /* with d_params; NULL: the camera's gradient alone is wanted */
    bool packed;        /* d_anchors has a row for each visible anchor */
    float *d_params;
    const decoder *d; /* for the camera's gradient: */
    double camera[3];
    double *d_camera; /* [block_count][3] */
    size_t block_count;
    size_t out_first[HEAD_COUNT], out_stride; /* columns of one row of logit gradients */
} backward_job;

static const float zeros[HIDDEN_STRIDE];

/* Where the gradient of a visible anchor goes. */
static size_t gradient_row(const backward_job *job, size_t row)
{
    return job->packed ? row : job->tape->visible[row];
}

static record_layout record_layout_of(const decode_layout *layout)
{
    record_layout record = {.size = HIDDEN_STRIDE * INPUT_STRIDE};
    for (int head = 0; head < HEAD_COUNT; head++) {
        record.weight_first[head] = record.size;
        record.size += layout->out_count[head] * ANCHOR_HIDDEN_DIM;
        record.bias_first[head] = record.size;
        record.size += layout->out_stride[head];
    }
    return record;
}

/* A scale that was raised to DECODE_SCALE_RATIO of the largest moves with that one alone. `scale` is before
   the raising. */
static void pass_held_scales(const float scale[3], float d_scale[3])
{
    const int large = scale[1] > scale[0] ? (scale[2] > scale[1] ? 2 : 1) : scale[2] > scale[0] ? 2 : 0;
    for (int c = 0; c < 3; c++)
        if (scale[c] < DECODE_SCALE_RATIO * scale[large]) {
            d_scale[large] += DECODE_SCALE_RATIO * d_scale[c];
            d_scale[c] = 0.0f;
        }
}

/* Through the activations: logit gradients into `d_out`, offsets and log-scales straight into the anchors'
   gradient. */
static void activations_backward(const backward_job *job, size_t begin, size_t rows, const float *extent,
                                 float *d_out)
{
    const decode_tape *tape = job->tape;
    const gaussians *d = job->d_gaussians;
    const size_t offsets = job->layout.offset_count, stride = tape->output_stride,
                 chunk = begin / DECODE_CHUNK;
    const float *kept = tape->output;
    size_t g = tape->first[chunk];
    const size_t last = tape->first[chunk + 1];
    for (size_t r = 0; r < rows && g < last; r++) {
        const size_t slot_begin = (begin + r) * offsets;
        if (tape->slot[g] >= slot_begin + offsets)
            continue;
        const size_t anchor = tape->visible[begin + r], target = gradient_row(job, begin + r);
        const float *x = job->a->position + anchor * 3, *offset = job->a->offset + anchor * offsets * 3;
        const float *e = extent + r * 6, *scale_log = job->a->scale_log + anchor * 6;
        float *row = d_out + r * job->out_stride;
        float sum[6] = {0}, unwanted[3 * ANCHOR_MAX_OFFSETS] = {0};
        float *d_offset = job->d_anchors != NULL ? job->d_anchors->offset + target * offsets * 3 : unwanted;
        for (; g < last && tape->slot[g] < slot_begin + offsets; g++) {
            const size_t k = tape->slot[g] - slot_begin;
            const float d_mean[3] = {d->mean_x[g], d->mean_y[g], d->mean_z[g]};
            float d_scale[3] = {d->scale_x[g], d->scale_y[g], d->scale_z[g]}, scale[3];
            const float d_color[3] = {d->red[g], d->green[g], d->blue[g]};
            const float d_quat[4] = {d->quat_w[g], d->quat_x[g], d->quat_y[g], d->quat_z[g]};
            float *d_shape = row + job->out_first[1] + k * SHAPE_OUTPUTS,
                  *d_logit = row + job->out_first[2] + k * COLOR_OUTPUTS;
            for (int c = 0; c < 3; c++) {
                const float shift = offset[k * 3 + (size_t)c] * e[c];
                if (fabsf(x[c] + shift) < DECODE_MEAN_LIMIT) {
                    d_offset[k * 3 + (size_t)c] += d_mean[c] * e[c];
                    sum[c] += d_mean[c] * shift;
                }
                scale[c] = e[3 + c] * kept[(size_t)(KEPT_SIGMOID + c) * stride + g];
                const float value = kept[(size_t)(KEPT_COLOR + c) * stride + g];
                d_logit[c] = d_color[c] * (value * (1.0f - value));
            }
            pass_held_scales(scale, d_scale);
            for (int c = 0; c < 3; c++) {
                const float scaled = d_scale[c] * scale[c];
                sum[3 + c] += scaled;
                d_shape[c] = scaled * (1.0f - kept[(size_t)(KEPT_SIGMOID + c) * stride + g]);
            }
            float q[4], along = 0.0f;
            for (int c = 0; c < 4; c++) {
                q[c] = kept[(size_t)(KEPT_QUAT + c) * stride + g];
                along += q[c] * d_quat[c];
            }
            const float inverse_length = kept[KEPT_INVERSE_LENGTH * stride + g];
            for (int c = 0; c < 4; c++)
                d_shape[3 + c] = (d_quat[c] - q[c] * along) * inverse_length;
            const float alpha = kept[KEPT_ALPHA * stride + g];
            row[job->out_first[0] + k] = d->opacity[g] * (1.0f - alpha * alpha);
        }
        if (job->d_anchors == NULL)
            continue;
        float *d_scale_log = job->d_anchors->scale_log + target * 6;
        for (int c = 0; c < 6; c++)
            d_scale_log[c] += decode_cut_gradient(scale_log[c], sum[c]);
    }
}

FASTEST_CLONE static void relu_backward(const float *restrict hidden, size_t count, float *restrict d_hidden)
{
    for (size_t i = 0; i < count; i++)
        d_hidden[i] = hidden[i] > 0.0f ? d_hidden[i] : 0.0f;
}

/* Adds `rows` rows of `count` values, `stride` apart, to `sum`. */
FASTEST_CLONE static void add_rows(const float *restrict values, size_t rows, size_t stride, size_t count,
                                   float *restrict sum)
{
    for (size_t r = 0; r < rows; r++)
        for (size_t i = 0; i < count; i++)
            sum[i] += values[r * stride + i];
}

/* Logit gradients back through the second layer and the ReLU. */
static void hidden_backward(const backward_job *job, size_t begin, size_t tiled, const float *d_out,
                            float *d_hidden)
{
    const float *hidden = job->tape->hidden + begin * HIDDEN_STRIDE;
    for (int head = 0; head < HEAD_COUNT; head++)
        job->kernels->product(&(dense_product){.m = tiled,
                                               .n = ANCHOR_HIDDEN_DIM,
                                               .k = job->layout.out_count[head],
                                               .a = d_out + job->out_first[head],
                                               .a_row = job->out_stride,
                                               .a_step = 1,
                                               .b = job->weights.out_hidden[head],
                                               .b_row = ANCHOR_HIDDEN_DIM,
                                               .bias = zeros,
                                               .c = d_hidden + head * ANCHOR_HIDDEN_DIM,
                                               .c_row = HIDDEN_STRIDE});
    relu_backward(hidden, tiled * HIDDEN_STRIDE, d_hidden);
}

/* dL/dcamera of one row from the gradient of its direction and distance: moving the camera is moving every
   anchor the other way. */
static void view_backward(const backward_job *job, size_t row, const float *d_hidden, double d_camera[3])
{
    double d_input[4] = {0}, offset[3], square = 0, along = 0;
    for (int i = 0; i < 4; i++) {
        const float *weight = job->weights.input_hidden + (ANCHOR_FEATURE_DIM + i) * HIDDEN_STRIDE;
        for (int h = 0; h < HIDDEN_STRIDE; h++)
            d_input[i] += (double)weight[h] * (double)d_hidden[h];
    }
    const float *position = job->a->position + job->tape->visible[row] * (size_t)3;
    for (int c = 0; c < 3; c++) {
        offset[c] = (double)position[c] - job->camera[c];
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

/* Logit gradients back through the two layers of the three networks. */
static void layers_backward(const backward_job *job, size_t begin, size_t rows, const float *d_out,
                            float *record)
{
    const dense_kernels *kernels = job->kernels;
    const size_t tiled = (rows + DECODE_TILE - 1) / DECODE_TILE * DECODE_TILE;
    const float *hidden = job->tape->hidden + begin * HIDDEN_STRIDE,
                *input = job->tape->input + begin * INPUT_STRIDE;
    _Alignas(64) float d_hidden[DECODE_CHUNK * HIDDEN_STRIDE], d_feature[DECODE_CHUNK * ANCHOR_FEATURE_DIM];
    hidden_backward(job, begin, tiled, d_out, d_hidden);
    for (int head = 0; head < HEAD_COUNT; head++) {
        const float *d_logit = d_out + job->out_first[head];
        kernels->product(&(dense_product){.m = job->layout.out_count[head],
                                          .n = ANCHOR_HIDDEN_DIM,
                                          .k = rows,
                                          .a = d_logit,
                                          .a_row = 1,
                                          .a_step = job->out_stride,
                                          .b = hidden + head * ANCHOR_HIDDEN_DIM,
                                          .b_row = HIDDEN_STRIDE,
                                          .c = record + job->record.weight_first[head],
                                          .c_row = ANCHOR_HIDDEN_DIM});
        add_rows(d_logit, rows, job->out_stride, job->layout.out_stride[head],
                 record + job->record.bias_first[head]);
    }
    kernels->product(&(dense_product){.m = HIDDEN_STRIDE,
                                      .n = INPUT_STRIDE,
                                      .k = rows,
                                      .a = d_hidden,
                                      .a_row = 1,
                                      .a_step = HIDDEN_STRIDE,
                                      .b = input,
                                      .b_row = INPUT_STRIDE,
                                      .c = record,
                                      .c_row = INPUT_STRIDE});
    kernels->product(&(dense_product){.m = tiled,
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
    for (size_t r = 0; r < rows; r++) {
        float *target = job->d_anchors->feature + gradient_row(job, begin + r) * ANCHOR_FEATURE_DIM;
        for (int i = 0; i < ANCHOR_FEATURE_DIM; i++)
            target[i] += d_feature[r * ANCHOR_FEATURE_DIM + (size_t)i];
    }
}

static void chunk_backward(const backward_job *job, size_t begin, size_t rows, float *record,
                           double *d_camera)
{
    _Alignas(64) float d_out[DECODE_CHUNK * OUT_STRIDE_MAX], extent[DECODE_CHUNK * 6];
    const size_t tiled = (rows + DECODE_TILE - 1) / DECODE_TILE * DECODE_TILE;
    memset(d_out, 0, tiled * job->out_stride * sizeof *d_out);
    for (size_t r = 0; r < rows; r++)
        memcpy(extent + r * 6, job->a->scale_log + (size_t)job->tape->visible[begin + r] * 6,
               6 * sizeof *extent);
    job->kernels->exp(extent, rows * 6);
    activations_backward(job, begin, rows, extent, d_out);
    if (job->d_anchors != NULL) {
        layers_backward(job, begin, rows, d_out, record);
        return;
    }
    _Alignas(64) float d_hidden[DECODE_CHUNK * HIDDEN_STRIDE];
    hidden_backward(job, begin, tiled, d_out, d_hidden);
    for (size_t r = 0; r < rows; r++)
        view_backward(job, begin + r, d_hidden + r * HIDDEN_STRIDE, d_camera);
}

static void backward_block(size_t block, size_t begin, size_t end, void *context)
{
    const backward_job *job = context;
    const decode_tape *tape = job->tape;
    float *record = job->d_anchors != NULL ? tape->block_grad + block * job->record.size : NULL;
    double *d_camera = job->d_camera != NULL ? job->d_camera + 3 * block : NULL;
    if (record != NULL)
        memset(record, 0, job->record.size * sizeof *record);
    for (size_t row = begin; row < end; row += DECODE_CHUNK)
        if (tape->first[row / DECODE_CHUNK] != tape->first[row / DECODE_CHUNK + 1])
            chunk_backward(job, row, end - row < DECODE_CHUNK ? end - row : DECODE_CHUNK, record, d_camera);
}

/* Entries [entry, entry + count) of the records, summed in block order. */
static void sum_records(const backward_job *job, size_t entry, size_t count, float *sum)
{
    memset(sum, 0, count * sizeof *sum);
    add_rows(job->tape->block_grad + entry, job->block_count, job->record.size, count, sum);
}

/* Rows of W1 with their bias as a column first, then rows of W2, each with its bias. */
static void reduce_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const backward_job *job = context;
    const size_t in = job->layout.input_count;
    float sum[INPUT_STRIDE];
    for (size_t row = begin; row < end; row++) {
        if (row < HIDDEN_STRIDE) {
            const size_t head = row / ANCHOR_HIDDEN_DIM, h = row % ANCHOR_HIDDEN_DIM;
            float *d_weight = job->d_params + job->layout.param_first[head];
            sum_records(job, row * INPUT_STRIDE, INPUT_STRIDE, sum);
            for (size_t i = 0; i < in; i++)
                d_weight[h * in + i] += sum[i];
            d_weight[ANCHOR_HIDDEN_DIM * in + h] += sum[INPUT_ONE];
        } else {
            size_t head = 0, o = row - HIDDEN_STRIDE;
            for (; o >= job->layout.out_count[head]; head++)
                o -= job->layout.out_count[head];
            float *d_weight = job->d_params + job->layout.param_first[head] + ANCHOR_HIDDEN_DIM * (in + 1);
            sum_records(job, job->record.weight_first[head] + o * ANCHOR_HIDDEN_DIM, ANCHOR_HIDDEN_DIM, sum);
            for (size_t h = 0; h < ANCHOR_HIDDEN_DIM; h++)
                d_weight[o * ANCHOR_HIDDEN_DIM + h] += sum[h];
            sum_records(job, job->record.bias_first[head] + o, 1, sum);
            d_weight[job->layout.out_count[head] * ANCHOR_HIDDEN_DIM + o] += sum[0];
        }
    }
}

/* What both adjoints begin with; after it tape->kept_count may be 0, and nothing is left to do. */
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
    for (int head = 0; head < HEAD_COUNT; head++) {
        job->out_first[head] = job->out_stride;
        job->out_stride += job->layout.out_stride[head];
    }
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
    size_t row_count = HIDDEN_STRIDE;
    for (int head = 0; head < HEAD_COUNT; head++)
        row_count += job.layout.out_count[head];
    void *records = tape->block_grad;
    GBT_TRY(mem_reserve(&records, &tape->block_capacity, 0, job.block_count * job.record.size, sizeof(float),
                        "decode adjoint", err));
    tape->block_grad = records;
    parallel_blocks(tape->visible_count, DECODE_GRAIN, backward_block, &job);
    parallel_blocks(row_count, 8, reduce_rows, &job);
    return GBT_OK;
}

gbt_status decode_backward_camera(const anchors *a, const decoder *d, const float camera_center[3],
                                  decode_tape *tape, const gaussians *d_gaussians, double d_camera[3],
                                  gbt_error *err)
{
    backward_job job;
    d_camera[0] = d_camera[1] = d_camera[2] = 0;
    GBT_TRY(open_job(a, d, tape, d_gaussians, &job, err));
    if (tape->kept_count == 0)
        return GBT_OK;
    job.d_camera = mem_calloc(job.block_count, 3 * sizeof *job.d_camera, "decode adjoint", err);
    if (job.d_camera == NULL)
        return GBT_ERR_NO_MEMORY;
    for (int c = 0; c < 3; c++)
        job.camera[c] = (double)camera_center[c];
    parallel_blocks(tape->visible_count, DECODE_GRAIN, backward_block, &job);
    for (size_t i = 0; i < 3 * job.block_count; i++)
        d_camera[i % 3] += job.d_camera[i];
    mem_free(job.d_camera);
    return GBT_OK;
}
