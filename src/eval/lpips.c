/* SPDX-License-Identifier: Apache-2.0 */
/* eval/lpips.c -- LPIPS: the networks (Simonyan 2015, Krizhevsky 2012), reading their weights, and the
   distance.

   picture --> (x - shift) / scale --> [maxima] convolution + ReLU, again and again
        --> distance of two pictures at five layers */
#include "eval/lpips.h"

#include <math.h>
#include <stdio.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "eval/lpips_layers.h"
#include "io/safetensors.h"

enum { LAYERS_MAX = 13, TAPS = 5, PICTURES = 2 };

typedef struct layer {
    const char *name; /* prefix of its arrays: NAME.weight, NAME.bias */
    int out, kernel, stride, pad;
    int pool; /* side of the max-pooling window before it; 0: none */
    bool tap; /* features are compared after this layer */
} layer;

typedef struct architecture {
    const char *name;
    size_t layer_count;
    layer layers[LAYERS_MAX];
} architecture;

/* Layers with torchvision's numbers, divided into slices as in the package `lpips`. */
static const architecture architectures[] = {
    {"vgg",
     13,
     {{"net.slice1.0", 64, 3, 1, 1, 0, false},
      {"net.slice1.2", 64, 3, 1, 1, 0, true},
      {"net.slice2.5", 128, 3, 1, 1, 2, false},
      {"net.slice2.7", 128, 3, 1, 1, 0, true},
      {"net.slice3.10", 256, 3, 1, 1, 2, false},
      {"net.slice3.12", 256, 3, 1, 1, 0, false},
      {"net.slice3.14", 256, 3, 1, 1, 0, true},
      {"net.slice4.17", 512, 3, 1, 1, 2, false},
      {"net.slice4.19", 512, 3, 1, 1, 0, false},
      {"net.slice4.21", 512, 3, 1, 1, 0, true},
      {"net.slice5.24", 512, 3, 1, 1, 2, false},
      {"net.slice5.26", 512, 3, 1, 1, 0, false},
      {"net.slice5.28", 512, 3, 1, 1, 0, true}}},
    {"alex",
     5,
     {{"net.slice1.0", 64, 11, 4, 2, 0, true},
      {"net.slice2.3", 192, 5, 1, 2, 3, true},
      {"net.slice3.6", 384, 3, 1, 1, 3, true},
      {"net.slice4.8", 256, 3, 1, 1, 0, true},
      {"net.slice5.10", 256, 3, 1, 1, 0, true}}},
};
enum { ARCHITECTURES = sizeof architectures / sizeof *architectures };

struct lpips {
    const architecture *is;
    convolution layers[LAYERS_MAX];
    tensor taps[TAPS]; /* [1][channels] weights of the squared feature differences */
};

/* ---- the file ---- */

static gbt_status read_array(const source_file *file, const char *layer_name, const char *suffix, size_t rows,
                             size_t columns, tensor *out, gbt_error *err)
{
    char name[64];
    snprintf(name, sizeof name, "%s.%s", layer_name, suffix);
    GBT_TRY(safetensors_read(file, name, out, err));
    if (out->rows != rows || out->columns != columns)
        return base_fail(err, GBT_ERR_FORMAT, "%s: array %s has %zu x %zu numbers (wanted %zu x %zu)",
                         file->name, name, out->rows, out->columns, rows, columns);
    return GBT_OK;
}

/* Transpose weights from the file's [out][in][ky][kx] to [ky][kx][in][out], the order of the matrix
   product. */
static gbt_status turn_weights(const tensor *from, convolution *c, gbt_error *err)
{
    const size_t in = (size_t)c->in, out = (size_t)c->out, area = (size_t)c->kernel * (size_t)c->kernel;
    c->weights = mem_alloc(in * out * area, sizeof *c->weights, "network", err);
    if (c->weights == NULL)
        return GBT_ERR_NO_MEMORY;
    for (size_t o = 0; o < out; o++)
        for (size_t i = 0; i < in; i++)
            for (size_t k = 0; k < area; k++)
                c->weights[(k * in + i) * out + o] = from->values[(o * in + i) * area + k];
    return GBT_OK;
}

static gbt_status read_layer(const source_file *file, const layer *is, int in, convolution *out,
                             gbt_error *err)
{
    *out =
        (convolution){.in = in, .out = is->out, .kernel = is->kernel, .stride = is->stride, .pad = is->pad};
    tensor weights = {0}, bias = {0};
    gbt_status status = read_array(file, is->name, "weight", (size_t)is->out,
                                   (size_t)(in * is->kernel * is->kernel), &weights, err);
    if (status == GBT_OK)
        status = read_array(file, is->name, "bias", 1, (size_t)is->out, &bias, err);
    out->bias = bias.values; /* ownership moves */
    if (status == GBT_OK)
        status = turn_weights(&weights, out, err);
    mem_free(weights.values);
    return status;
}

/* The network is recognised by its first layer. */
static gbt_status find_architecture(const source_file *file, const architecture **out, gbt_error *err)
{
    tensor first;
    GBT_TRY(safetensors_read(file, "net.slice1.0.weight", &first, err));
    mem_free(first.values);
    for (size_t i = 0; i < ARCHITECTURES; i++) {
        const layer *l = architectures[i].layers;
        if (first.rows == (size_t)l->out && first.columns == (size_t)(3 * l->kernel * l->kernel)) {
            *out = &architectures[i];
            return GBT_OK;
        }
    }
    return base_fail(err, GBT_ERR_FORMAT,
                     "%s: neither VGG16 nor AlexNet: the first layer has %zu x %zu weights", file->name,
                     first.rows, first.columns);
}

static gbt_status read_network(const source_file *file, lpips *net, gbt_error *err)
{
    GBT_TRY(find_architecture(file, &net->is, err));
    int channels = 3, taps = 0;
    for (size_t i = 0; i < net->is->layer_count; i++) {
        const layer *l = &net->is->layers[i];
        GBT_TRY(read_layer(file, l, channels, &net->layers[i], err));
        channels = l->out;
        if (!l->tap)
            continue;
        char name[32];
        snprintf(name, sizeof name, "lin%d.model.1", taps);
        GBT_TRY(read_array(file, name, "weight", 1, (size_t)channels, &net->taps[taps++], err));
    }
    return GBT_OK;
}

gbt_status lpips_open(const char *path, lpips **out, gbt_error *err)
{
    *out = NULL;
    unsigned char *bytes = NULL;
    source_file file = {.name = path};
    GBT_TRY(file_read(path, &bytes, &file.size, err));
    file.bytes = bytes;
    lpips *net = mem_calloc(1, sizeof *net, "network", err);
    const gbt_status status = net == NULL ? GBT_ERR_NO_MEMORY : read_network(&file, net, err);
    mem_free(bytes);
    if (status != GBT_OK) {
        lpips_close(net);
        return status;
    }
    *out = net;
    return GBT_OK;
}

void lpips_close(lpips *net)
{
    for (size_t i = 0; net != NULL && i < LAYERS_MAX; i++)
        convolution_free(&net->layers[i]);
    for (size_t i = 0; net != NULL && i < TAPS; i++)
        mem_free(net->taps[i].values);
    mem_free(net);
}

const char *lpips_network(const lpips *net) { return net->is->name; }

/* ---- the distance ---- */

typedef struct distance_job {
    const feature_plane *of; /* [PICTURES] */
    const float *weight;     /* [channels] */
    double *row;             /* [height] sums */
} distance_job;

static double length_of(const float *v, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += (double)v[i] * (double)v[i];
    return sqrt(sum) + 1e-10; /* the epsilon of the definition */
}

static void distance_rows(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const distance_job *job = context;
    const int channels = job->of[0].channels;
    for (size_t y = begin; y < end; y++) {
        job->row[y] = 0;
        for (int x = 0; x < job->of[0].width; x++) {
            const float *a = feature_plane_at(&job->of[0], x, (int)y),
                        *b = feature_plane_at(&job->of[1], x, (int)y);
            const double to_unit_a = 1 / length_of(a, channels), to_unit_b = 1 / length_of(b, channels);
            for (int c = 0; c < channels; c++) {
                const double difference = (double)a[c] * to_unit_a - (double)b[c] * to_unit_b;
                job->row[y] += (double)job->weight[c] * difference * difference;
            }
        }
    }
}

/* Add to `sum` the mean over the pixels of the weighted squared differences of normalised features. */
static gbt_status add_distance(const feature_plane of[PICTURES], const tensor *weight, double *sum,
                               gbt_error *err)
{
    const size_t height = (size_t)of[0].height;
    distance_job job = {of, weight->values, mem_alloc(height, sizeof *job.row, "distances", err)};
    if (job.row == NULL)
        return GBT_ERR_NO_MEMORY;
    parallel_blocks(height, 1, distance_rows, &job);
    double total = 0;
    for (size_t y = 0; y < height; y++)
        total += job.row[y];
    *sum += total / ((double)height * (double)of[0].width);
    mem_free(job.row);
    return GBT_OK;
}

/* An input image: `picture`, replaced by the photo at invalid pixels, from a column on. */
typedef struct seen {
    const image *picture, *photo;
    const unsigned char *valid; /* NULL: all */
    int first_column;
} seen;

/* Prepare the network input: scale colours to [low, 1], then normalise by the mean and standard deviation of
   the training data. */
static gbt_status feed(const seen *s, float low, int pad, feature_plane *out, gbt_error *err)
{
    static const float shift[3] = {-0.030f, -0.088f, -0.188f}, scale[3] = {0.458f, 0.448f, 0.450f};
    const size_t width = (size_t)s->photo->width;
    GBT_TRY(feature_plane_make(s->photo->width - s->first_column, s->photo->height, 3, pad, out, err));
    for (int y = 0; y < out->height; y++)
        for (int x = 0; x < out->width; x++) {
            const size_t pixel = (size_t)y * width + (size_t)(s->first_column + x);
            const float *from =
                (s->valid == NULL || s->valid[pixel] ? s->picture : s->photo)->pixels + 3 * pixel;
            float *to = feature_plane_at(out, x, y);
            for (int c = 0; c < 3; c++)
                to[c] = (low + (1 - low) * from[c] - shift[c]) / scale[c];
        }
    return GBT_OK;
}

/* Apply one layer to one image; `plane` is replaced by the output, with a border of `pad` pixels. */
static gbt_status advance(const layer *l, const convolution *c, int pad, feature_plane *plane, gbt_error *err)
{
    feature_plane pooled = {0}, out = {0};
    gbt_status status = l->pool > 0 ? pool_max(plane, l->pool, l->pad, &pooled, err) : GBT_OK;
    if (l->pool > 0)
        feature_plane_free(plane);
    if (status == GBT_OK)
        status = convolve(c, l->pool > 0 ? &pooled : plane, pad, &out, err);
    feature_plane_free(&pooled);
    feature_plane_free(plane);
    *plane = out;
    return status;
}

static gbt_status compare_fed(const lpips *net, const seen pictures[PICTURES], float low, double *sum,
                              gbt_error *err)
{
    feature_plane plane[PICTURES] = {{0}};
    gbt_status status = GBT_OK;
    *sum = 0;
    for (int p = 0; p < PICTURES && status == GBT_OK; p++)
        status = feed(&pictures[p], low, net->is->layers[0].pad, &plane[p], err);
    for (size_t i = 0, tap = 0; i < net->is->layer_count && status == GBT_OK; i++) {
        const layer *l = &net->is->layers[i], *next = i + 1 < net->is->layer_count ? l + 1 : NULL;
        const int pad = next != NULL && next->pool == 0 ? next->pad : 0;
        for (int p = 0; p < PICTURES && status == GBT_OK; p++)
            status = advance(l, &net->layers[i], pad, &plane[p], err);
        if (l->tap && status == GBT_OK)
            status = add_distance(plane, &net->taps[tap++], sum, err);
    }
    for (int p = 0; p < PICTURES; p++)
        feature_plane_free(&plane[p]);
    return status;
}

gbt_status lpips_compare(const lpips *net, const image *render, const image *photo,
                         const unsigned char *valid, int first_column, lpips_scores *out, gbt_error *err)
{
    const seen pictures[PICTURES] = {{render, photo, valid, first_column},
                                     {photo, photo, valid, first_column}};
    *out = (lpips_scores){0};
    if (render->width != photo->width || render->height != photo->height || render->channels != 3 ||
        photo->channels != 3)
        return base_fail(
            err, GBT_ERR_ARGUMENT, "LPIPS: %d x %d x %d and %d x %d x %d (wanted equal sizes, 3 channels)",
            render->width, render->height, render->channels, photo->width, photo->height, photo->channels);
    GBT_TRY(compare_fed(net, pictures, -1, &out->lpips, err));
    return compare_fed(net, pictures, 0, &out->lpips_01, err);
}
