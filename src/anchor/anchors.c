/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/anchors.c -- allocation of anchors and decoders, and initialisation of the decoder. */
#include "anchor/anchors.h"

#include <math.h>
#include <string.h>

#include "anchor/rows.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/rng.h"

const row_field anchor_fields[ANCHOR_FIELDS] = {
#define X(name, id, label, width, per_offset, meaning) {#name, label, width, per_offset},
    ANCHOR_FIELD_LIST(X)
#undef X
};

gbt_status anchors_resize(anchors *a, size_t count, gbt_error *err)
{
    if (a->offset_count < 1 || a->offset_count > ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_ARGUMENT, "anchors: offset_count %d (wanted 1 to %d)", a->offset_count,
                         ANCHOR_MAX_OFFSETS);
    GBT_TRY(rows_resize(a->field, anchor_fields, ANCHOR_FIELDS, a->offset_count, &a->capacity, a->count,
                        count, "anchors", err));
    a->count = count;
    return GBT_OK;
}

void anchors_free(anchors *a)
{
    for (int f = 0; f < ANCHOR_FIELDS; f++)
        mem_free(a->field[f]);
    memset(a, 0, sizeof *a);
}

void anchors_copy(anchors *to, const anchors *from)
{
    for (int f = 0; f < ANCHOR_FIELDS && from->count > 0; f++)
        memcpy(to->field[f], from->field[f], from->count * anchors_width(from, f) * sizeof(float));
}

void anchors_zero_learned(anchors *a)
{
    for (int f = ANCHOR_FIRST_LEARNED; f < ANCHOR_FIELDS && a->count > 0; f++)
        memset(a->field[f], 0, a->count * anchors_width(a, f) * sizeof(float));
}

/* ---- networks ---- */

static const struct {
    const char *label;
    size_t outputs; /* outputs per Gaussian */
} network_list[DECODER_NETWORKS] = {
#define X(id, label, outputs) {label, outputs},
    DECODER_NETWORK_LIST(X)
#undef X
};

static size_t network_size(int network, size_t offset_count, size_t input_count)
{
    const size_t out = offset_count * network_list[network].outputs;
    return ANCHOR_HIDDEN_DIM * (input_count + 1) + out * (ANCHOR_HIDDEN_DIM + 1);
}

static size_t input_dim(bool has_distance) { return ANCHOR_FEATURE_DIM + 3 + (has_distance ? 1 : 0); }

gbt_status decoder_init(decoder *d, int offset_count, bool has_distance, uint64_t seed, gbt_error *err)
{
    memset(d, 0, sizeof *d);
    if (offset_count < 1 || offset_count > ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_ARGUMENT, "decoder: offset_count %d (wanted 1 to %d)", offset_count,
                         ANCHOR_MAX_OFFSETS);
    const size_t in = input_dim(has_distance);
    size_t param_count = 0;
    for (int i = 0; i < DECODER_NETWORKS; i++)
        param_count += network_size(i, (size_t)offset_count, in);
    float *params = mem_alloc(param_count, sizeof *params, "decoder", err);
    if (params == NULL)
        return GBT_ERR_NO_MEMORY;
    *d = (decoder){.offset_count = offset_count,
                   .has_distance = has_distance,
                   .distance_scale = 1.0f,
                   .distance_min = 0.0f,
                   .distance_max = INFINITY,
                   .param_count = param_count,
                   .params = params};
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(d, networks);
    for (int i = 0; i < DECODER_NETWORKS; i++) {
        const size_t first_layer = ANCHOR_HIDDEN_DIM * (in + 1);
        for (size_t p = 0; p < networks[i].end - networks[i].begin; p++) {
            const double bound = 1.0 / sqrt(p < first_layer ? (double)in : (double)ANCHOR_HIDDEN_DIM);
            const double u = (double)rng_uniform(seed, (uint64_t)i, p);
            params[networks[i].begin + p] = (float)((2.0 * u - 1.0) * bound);
        }
    }
    return GBT_OK;
}

void decoder_free(decoder *d)
{
    mem_free(d->params);
    memset(d, 0, sizeof *d);
}

void decoder_networks(const decoder *d, decoder_network networks[DECODER_NETWORKS])
{
    size_t begin = 0;
    for (int i = 0; i < DECODER_NETWORKS; i++) {
        const size_t size = network_size(i, (size_t)d->offset_count, input_dim(d->has_distance));
        networks[i] = (decoder_network){network_list[i].label, network_list[i].outputs, begin, begin + size};
        begin += size;
    }
}
