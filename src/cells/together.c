/* SPDX-License-Identifier: Apache-2.0 */
/* cells/together.c -- one picture by all processes of the cluster.

     each process: its share of the cells --> a layer of all pixels
          --> strip k of it goes to process k, which blends the strips of all layers
          --> rays that end in a share because of what is in front of it: drawn in it again, added
          --> all processes get all strips */
#include "base/memory.h"
#include "cells/view.h"
#include "cluster/cluster.h"

/* Strips are equal parts of the pixels. Counts are of floats. */
typedef struct strips {
    int size;
    size_t pixels, mine;      /* of the picture, of the own strip */
    float *layer;             /* [pixels][CELL_LAYER_FLOATS] of the own share */
    float *layers;            /* [size][mine][CELL_LAYER_FLOATS] of all shares, in the own strip */
    float *sum;               /* [mine][CELL_LAYER_FLOATS]; then [mine][3] */
    float *share_T_front;     /* [size][mine] */
    float *own_share_T_front; /* [pixels] of the own share */
    size_t whole[CLUSTER_SIZE_MAX], part[CLUSTER_SIZE_MAX]; /* of each strip; of the own strip */
    const float *layer_of[CLUSTER_SIZE_MAX];
} strips;

static size_t strip_pixels(const strips *s, int strip)
{
    const size_t size = (size_t)s->size, k = (size_t)strip;
    return s->pixels * (k + 1) / size - s->pixels * k / size;
}

static void free_strips(strips *s)
{
    if (s == NULL)
        return;
    mem_free(s->layer);
    mem_free(s->layers);
    mem_free(s->sum);
    mem_free(s->share_T_front);
    mem_free(s->own_share_T_front);
    mem_free(s);
}

static gbt_status make_strips(size_t pixels, strips **out, gbt_error *err)
{
    static const char what[] = "layers of the picture";
    enum { LAYER = CELL_LAYER_FLOATS * sizeof(float) };
    strips *s = *out = mem_calloc(1, sizeof *s, what, err);
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    s->size = gbt_cluster_size();
    s->pixels = pixels;
    s->mine = strip_pixels(s, gbt_cluster_rank());
    const size_t all = s->mine * (size_t)s->size + 1; /* a strip may be empty */
    s->layer = mem_alloc(pixels, LAYER, what, err);
    s->layers = mem_alloc(all, LAYER, what, err);
    s->sum = mem_alloc(s->mine + 1, LAYER, what, err);
    s->share_T_front = mem_alloc(all, sizeof *s->share_T_front, what, err);
    s->own_share_T_front = mem_alloc(pixels, sizeof *s->own_share_T_front, what, err);
    const bool have = s->layer && s->layers && s->sum && s->share_T_front && s->own_share_T_front;
    return have ? GBT_OK : GBT_ERR_NO_MEMORY;
}

static void count_floats(strips *s, size_t of_pixel)
{
    for (int k = 0; k < s->size; k++) {
        s->whole[k] = strip_pixels(s, k) * of_pixel;
        s->part[k] = s->mine * of_pixel;
        s->layer_of[k] = s->layers + (size_t)k * s->mine * CELL_LAYER_FLOATS;
    }
}

static void exchange_layers(strips *s, const cell_drawer *d, const image *drawn)
{
    cell_layer_make(d, drawn, s->layer);
    count_floats(s, CELL_LAYER_FLOATS);
    cluster_exchange(s->layer, s->whole, s->layers, s->part);
}

/* @return whether any process has to draw anything again; the same for all */
static bool exchange_share_T_front(strips *s)
{
    count_floats(s, 1);
    cluster_exchange(s->share_T_front, s->part, s->own_share_T_front, s->whole);
    int32_t own = 0, all[CLUSTER_SIZE_MAX], any = 0;
    for (size_t i = 0; i < s->pixels; i++)
        own |= s->own_share_T_front[i] > 0;
    size_t ones[CLUSTER_SIZE_MAX];
    for (int k = 0; k < s->size; k++)
        ones[k] = 1;
    cluster_gather(&own, ones, all);
    for (int k = 0; k < s->size; k++)
        any |= all[k];
    return any != 0;
}

static void gather_picture(strips *s, const float background[3], image *out)
{
    for (size_t i = 0; i < s->mine; i++)
        for (size_t c = 0; c < 3; c++)
            s->sum[3 * i + c] =
                s->sum[i * CELL_LAYER_FLOATS + c] + s->sum[i * CELL_LAYER_FLOATS + 3] * background[c];
    count_floats(s, 3);
    cluster_gather(s->sum, s->whole, out->pixels);
}

gbt_status cell_draw_together(cell_drawer *d, const cell_store *store, const ray_shot *shot,
                              const trace_settings *settings, float variance, size_t memory, image *out,
                              gbt_error *err)
{
    d->share = (cell_share){gbt_cluster_rank(), gbt_cluster_size()};
    gbt_status status = cell_draw(d, store, shot, settings, variance, memory, out, err);
    if (d->share.count == 1)
        return status;
    strips *s = NULL;
    if (status == GBT_OK)
        status = make_strips(ray_image_count(&d->rays), &s, err);
    status = cluster_agree(status, err);
    if (status == GBT_OK) {
        exchange_layers(s, d, out);
        cell_layers_blend(s->layer_of, s->size, s->mine, settings->transmittance_min, s->sum,
                          s->share_T_front);
        if (exchange_share_T_front(s)) {
            d->share_T_front = s->own_share_T_front;
            status = cluster_agree(cell_draw(d, store, shot, settings, variance, memory, out, err), err);
            d->share_T_front = NULL;
            if (status == GBT_OK) {
                exchange_layers(s, d, out);
                cell_layers_add(s->layer_of, s->size, s->mine, s->share_T_front, s->sum);
            }
        }
    }
    if (status == GBT_OK)
        gather_picture(s, settings->background, out);
    free_strips(s);
    return status;
}
