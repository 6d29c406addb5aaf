/* SPDX-License-Identifier: Apache-2.0 */
/* train/loss.c -- the terms of the training loss and their weights (Yang 2026, eq 35; Lu 2024 has the same
   three). */
#include "train/loss.h"

#include <math.h>

#include "base/parallel.h"

static const float dssim_weight = (float)IMAGE_DSSIM_WEIGHT;
static const double volume_weight_at_6 = 0.01; /* for scenes whose cameras are 6 units from what they see */

/* ---- of the picture ---- */

gbt_status loss_of_image(const image *shown, const image *photo, const unsigned char *valid,
                         loss_scratch *scratch, image *d_image, image_loss_result *out, gbt_error *err)
{
    return image_loss(shown, photo, valid, (double)dssim_weight, scratch, d_image, out, err);
}

double loss_of_value(double shown, double photo, double ssim)
{
    const double w = (double)dssim_weight;
    return (1 - w) * fabs(shown - photo) + w * (1 - ssim);
}

/* ---- of the Gaussians ---- */

enum { GAUSSIAN_BLOCK = 4096, GAUSSIAN_BLOCKS = 64 };

double loss_volume_weight(const train_rules *rules, const decoder *d)
{
    if (!rules->distance_by_median)
        return volume_weight_at_6;
    const double unit = 6 * (double)d->distance_scale;
    return volume_weight_at_6 * (unit * unit * unit);
}

typedef struct volume_job {
    const gaussians *g;
    gaussians *d;
    double weight;
    double sum[GAUSSIAN_BLOCKS]; /* added in their order */
} volume_job;

static void sum_volumes(size_t block, size_t begin, size_t end, void *context)
{
    volume_job *job = context;
    const gaussians *g = job->g;
    double volume = 0;
    for (size_t i = begin; i < end; i++)
        volume += (double)g->scale_x[i] * (double)g->scale_y[i] * (double)g->scale_z[i];
    job->sum[block] = volume;
}

double loss_of_gaussians(const gaussians *g, double volume_weight)
{
    volume_job job = {.g = g};
    const size_t share = parallel_block_count(g->count, GAUSSIAN_BLOCKS),
                 grain = share > GAUSSIAN_BLOCK ? share : GAUSSIAN_BLOCK;
    parallel_blocks(g->count, grain, sum_volumes, &job);
    double volume = 0;
    for (size_t i = 0; i < parallel_block_count(g->count, grain); i++)
        volume += job.sum[i];
    return g->count > 0 ? volume_weight * (volume / (double)g->count) : 0;
}

static void add_volume_gradient(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const volume_job *job = context;
    const gaussians *g = job->g;
    gaussians *d = job->d;
    const float share = (float)job->weight / (float)g->count;
    for (size_t i = begin; i < end; i++) {
        d->scale_x[i] += share * g->scale_y[i] * g->scale_z[i];
        d->scale_y[i] += share * g->scale_x[i] * g->scale_z[i];
        d->scale_z[i] += share * g->scale_x[i] * g->scale_y[i];
    }
}

void loss_add_gradient(const gaussians *g, double volume_weight, gaussians *d)
{
    volume_job job = {.g = g, .d = d, .weight = volume_weight};
    parallel_blocks(g->count, GAUSSIAN_BLOCK, add_volume_gradient, &job);
}

double loss_of_gaussian(const double field[GAUSSIANS_FIELD_COUNT], double volume_weight)
{
    enum { SCALE = 3 }; /* of the fields: means come first */
    return volume_weight * (field[SCALE] * field[SCALE + 1] * field[SCALE + 2]);
}
