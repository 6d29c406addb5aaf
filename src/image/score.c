/* SPDX-License-Identifier: Apache-2.0 */
/* image/score.c -- PSNR, SSIM and FLIP of a render against a photo, over the valid pixels. */
#include "image/metrics.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "image/affine.h"

static gbt_status copy_masked(const image *in, const unsigned char *valid, image *out, gbt_error *err)
{
    GBT_TRY(image_alloc(out, in->width, in->height, in->channels, err));
    const size_t channels = (size_t)in->channels;
    for (size_t i = 0; i < (size_t)in->width * (size_t)in->height; i++)
        for (size_t c = 0; c < channels; c++)
            out->pixels[channels * i + c] = valid[i] ? in->pixels[channels * i + c] : 0;
    return GBT_OK;
}

/* Mean of the map over valid pixels. Elsewhere the map is set to 0: values that filters spread there are not
   errors. */
static double masked_mean(image *map, const unsigned char *valid)
{
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < (size_t)map->width * (size_t)map->height; i++) {
        count += valid[i] != 0;
        sum += valid[i] ? (double)map->pixels[i] : 0;
        if (!valid[i])
            map->pixels[i] = 0;
    }
    return sum / (double)count;
}

static gbt_status score_masked(const image *a, const image *photo, const unsigned char *valid,
                               image *flip_map, image_scores *out, gbt_error *err)
{
    image seen[2] = {{0}}, map = {0}, gradient = {0};
    loss_scratch scratch = {0};
    image_loss_result loss;
    gbt_status status = copy_masked(a, valid, &seen[0], err);
    if (status == GBT_OK)
        status = copy_masked(photo, valid, &seen[1], err);
    if (status == GBT_OK)
        status = image_alloc(&gradient, a->width, a->height, 3, err);
    if (status == GBT_OK)
        status = image_loss(a, photo, valid, 1, &scratch, &gradient, &loss,
                            err); /* image_loss() can exclude pixels from SSIM's windows */
    if (status == GBT_OK && flip_map == NULL)
        status = image_alloc(&map, a->width, a->height, 1, err);
    image *const used = flip_map != NULL ? flip_map : &map;
    if (status == GBT_OK)
        status = metric_flip(&seen[0], &seen[1], &out->flip, used, err);
    if (status == GBT_OK) {
        out->psnr = metric_psnr_valid(a, photo, valid);
        out->ssim = isfinite(out->psnr) ? loss.ssim : (double)NAN;
        out->flip = masked_mean(used, valid);
    }
    loss_scratch_free(&scratch);
    image *const all[] = {&seen[0], &seen[1], &map, &gradient};
    for (int i = 0; i < 4; i++)
        image_free(all[i]);
    return status;
}

gbt_status image_score(const image *a, const image *photo, const unsigned char *valid, image *flip_map,
                       image_scores *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (valid != NULL)
        return score_masked(a, photo, valid, flip_map, out, err);
    out->psnr = metric_psnr(a, photo);
    GBT_TRY(metric_ssim(a, photo, &out->ssim, err));
    return metric_flip(a, photo, &out->flip, flip_map, err);
}

gbt_status image_score_photo(image *render, image *photo, const unsigned char *valid, bool exposure,
                             image *flip_map, image_scores *out, gbt_error *err)
{
    image_scores whole;
    if (exposure) {
        affine_half right;
        GBT_TRY(affine_split(render, photo, valid, &right, err));
        image_quantize(&right.render);
        image_quantize(&right.photo);
        const gbt_status status = image_score(&right.render, &right.photo, right.valid, NULL, out, err);
        affine_half_free(&right);
        GBT_TRY(status);
    }
    image_quantize(render);
    image_quantize(photo);
    return exposure && flip_map == NULL
               ? GBT_OK
               : image_score(render, photo, valid, flip_map, exposure ? &whole : out, err);
}

gbt_status image_psnr_fitted(const image *render, const image *photo, const unsigned char *valid,
                             int first_column, double *psnr, gbt_error *err)
{
    image fitted = {0};
    float matrix[AFFINE_NUMBERS];
    const size_t width = (size_t)render->width, pixels = width * (size_t)render->height;
    unsigned char *counted = mem_alloc(pixels, 1, "pixels that count", err);
    gbt_status status =
        counted == NULL ? GBT_ERR_NO_MEMORY : image_alloc(&fitted, render->width, render->height, 3, err);
    if (status == GBT_OK) {
        for (size_t i = 0; i < pixels; i++)
            counted[i] = i % width >= (size_t)first_column && (valid == NULL || valid[i] != 0);
        affine_fit(render, photo, counted, first_column, render->width, matrix);
        affine_apply(matrix, render, &fitted);
        image_quantize(&fitted);
        *psnr = metric_psnr_valid(&fitted, photo, counted);
    }
    image_free(&fitted);
    mem_free(counted);
    return status;
}
