/* SPDX-License-Identifier: Apache-2.0 */
/* tests/eval/lpips_network.h -- networks of random weights for LPIPS, and their files. */
#ifndef GBT_TESTS_LPIPS_NETWORK_H
#define GBT_TESTS_LPIPS_NETWORK_H

#include "test_support.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/rng.h"

/* ---- networks, as their papers draw them ---- */

/* out, kernel, stride, pad of a convolution; 0 and the window of maxima; taps are taken in order. */
typedef struct step {
    int out, kernel, stride, pad;
    bool tap;
} step;

typedef struct network {
    const char *name;
    int count;
    step steps[18];
    float *weights[18], *bias[18], *taps[5]; /* [out][in][ky][kx] */
} network;

#define CONV(out)                                                                                            \
    {                                                                                                        \
        out, 3, 1, 1, false                                                                                  \
    }
#define TAPPED(out)                                                                                          \
    {                                                                                                        \
        out, 3, 1, 1, true                                                                                   \
    }
#define POOL(size)                                                                                           \
    {                                                                                                        \
        0, size, 2, 0, false                                                                                 \
    }

static inline float *random_values(size_t count, double low, double high, uint64_t seed)
{
    float *values = mem_alloc(count, sizeof *values, "weights", NULL);
    assert_non_null(values);
    for (size_t i = 0; i < count; i++)
        values[i] = (float)(low + (high - low) * (double)rng_uniform(seed, 1, i));
    return values;
}

/* Weights for the steps. */
static inline void fill_network(network *n)
{
    int in = 3, taps = 0;
    for (int i = 0; i < n->count; i++) {
        const step *s = &n->steps[i];
        if (s->out == 0)
            continue;
        const int inputs = in * s->kernel * s->kernel;
        const double reach = sqrt(6.0 / inputs); /* features keep their size */
        n->weights[i] = random_values((size_t)(s->out * inputs), -reach, reach, (uint64_t)i);
        n->bias[i] = random_values((size_t)s->out, -0.2, 0.2, 100 + (uint64_t)i);
        in = s->out;
        if (s->tap) {
            n->taps[taps] = random_values((size_t)in, 0, 1, 200 + (uint64_t)taps);
            taps++;
        }
    }
}

static inline network make_vgg(void)
{
    network n = {.name = "vgg",
                 .count = 17,
                 .steps = {CONV(64), TAPPED(64), POOL(2), CONV(128), TAPPED(128), POOL(2), CONV(256),
                           CONV(256), TAPPED(256), POOL(2), CONV(512), CONV(512), TAPPED(512), POOL(2),
                           CONV(512), CONV(512), TAPPED(512)}};
    fill_network(&n);
    return n;
}

static inline network make_alex(void)
{
    network n = {.name = "alex",
                 .count = 7,
                 .steps = {{64, 11, 4, 2, true},
                           POOL(3),
                           {192, 5, 1, 2, true},
                           POOL(3),
                           TAPPED(384),
                           TAPPED(256),
                           TAPPED(256)}};
    fill_network(&n);
    return n;
}

static inline void free_network(network *n)
{
    for (int i = 0; i < n->count; i++) {
        mem_free(n->weights[i]);
        mem_free(n->bias[i]);
    }
    for (int i = 0; i < 5; i++)
        mem_free(n->taps[i]);
}

/* ---- the same as a file ---- */

typedef struct safetensors {
    char header[16384];
    size_t length, bytes, capacity;
    unsigned char *data;
} safetensors;

static inline void add_array(safetensors *f, const char *name, const char *shape, const float *values,
                             size_t count)
{
    f->length += (size_t)snprintf(f->header + f->length, sizeof f->header - f->length,
                                  "%c\"%s\":{\"dtype\":\"F32\",\"shape\":%s,\"data_offsets\":[%zu,%zu]}",
                                  f->length == 0 ? '{' : ',', name, shape, f->bytes, f->bytes + 4 * count);
    assert_ok(mem_reserve((void **)&f->data, &f->capacity, f->bytes, f->bytes + 4 * count, 1, "file", NULL));
    memcpy(f->data + f->bytes, values, 4 * count); /* little endian, as every machine that this is tested on
                                                    */
    f->bytes += 4 * count;
}

/* torchvision counts a convolution, its ReLU and maxima as a module each; a slice ends behind a compared
   ReLU. `without` is left out. */
static inline void write_network(const network *n, const char *path, const char *without)
{
    safetensors f = {.length = 0};
    char name[64], shape[64];
    for (int i = 0, module = 0, slice = 1, in = 3, tap = 0; i < n->count; i++) {
        const step *s = &n->steps[i];
        if (s->out == 0) {
            module++;
            continue;
        }
        const size_t count = (size_t)(s->out * in * s->kernel * s->kernel);
        snprintf(name, sizeof name, "net.slice%d.%d.weight", slice, module);
        snprintf(shape, sizeof shape, "[%d,%d,%d,%d]", s->out, in, s->kernel, s->kernel);
        if (without == NULL || strcmp(name, without) != 0)
            add_array(&f, name, shape, n->weights[i], count);
        snprintf(name, sizeof name, "net.slice%d.%d.bias", slice, module);
        snprintf(shape, sizeof shape, "[%d]", s->out);
        add_array(&f, name, shape, n->bias[i], (size_t)s->out);
        in = s->out;
        module += 2;
        slice += s->tap;
        if (!s->tap)
            continue;
        snprintf(name, sizeof name, "lin%d.model.1.weight", tap);
        snprintf(shape, sizeof shape, "[1,%d,1,1]", in);
        if (without == NULL || strcmp(name, without) != 0)
            add_array(&f, name, shape, n->taps[tap], (size_t)in);
        tap++;
    }
    f.header[f.length++] = '}';
    unsigned char *all = mem_calloc(8 + f.length + f.bytes, 1, "file", NULL);
    assert_non_null(all);
    for (int i = 0; i < 8; i++)
        all[i] = (unsigned char)(f.length >> (8 * i));
    memcpy(all + 8, f.header, f.length);
    memcpy(all + 8 + f.length, f.data, f.bytes);
    assert_ok(file_write_atomic(path, all, 8 + f.length + f.bytes, NULL));
    mem_free(all);
    mem_free(f.data);
}

#endif
