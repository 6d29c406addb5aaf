/* SPDX-License-Identifier: Apache-2.0 */
/* eval/compare_images.c -- scores of one image against another (bench/versus_metrics compares them with other
   programs). */
#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/image.h"
#include "base/memory.h"
#include "eval/lpips.h"
#include "gbtrace/evaluate.h"
#include "image/metrics.h"

/* Rounding would make a number of what is none, and two pictures equal that are not. */
static gbt_status check_valid(const char *path, const unsigned char *valid, size_t width, gbt_error *err)
{
    size_t at = 0;
    if (valid == NULL)
        return GBT_OK;
    while (valid[at])
        at++;
    return base_fail(err, GBT_ERR_FORMAT,
                     "%s: a value that is not finite at pixel %zu, %zu (wanted finite values)", path,
                     at % width, at / width);
}

/* Read an image as three channels, rounded to 8 bit. */
static gbt_status read_colors(const char *path, image *out, gbt_error *err)
{
    unsigned char *valid;
    GBT_TRY(image_read_valid(path, out, &valid, err));
    const gbt_status status = check_valid(path, valid, (size_t)out->width, err);
    mem_free(valid);
    GBT_TRY(status);
    const size_t pixels = (size_t)out->width * (size_t)out->height, stored = (size_t)out->channels;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            out->pixels[3 * i + c] = out->pixels[stored * i + c];
    out->channels = 3;
    image_quantize(out);
    return GBT_OK;
}

/* All scores of two images that are already rounded. */
static gbt_status compare(const image *a, const image *b, gbt_comparison *out, gbt_error *err)
{
    *out = (gbt_comparison){
        .width = a->width, .height = a->height, .psnr = metric_psnr(a, b), .lpips = NAN, .lpips_01 = NAN};
    GBT_TRY(metric_ssim(a, b, &out->ssim, err));
    GBT_TRY(metric_ssim_interior(a, b, &out->ssim_interior, err));
    return metric_flip(a, b, &out->flip, NULL, err);
}

/* Read both images; the caller frees them, also after a failure. */
static gbt_status read_pair(const char *path, const char *reference, image *a, image *b, gbt_error *err)
{
    GBT_TRY(read_colors(path, a, err));
    GBT_TRY(read_colors(reference, b, err));
    if (a->width != b->width || a->height != b->height)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %d x %d pixels (wanted %d x %d as %s)", path, a->width,
                         a->height, b->width, b->height, reference);
    return GBT_OK;
}

static gbt_status compare_lpips(const image *a, const image *b, const char *network, gbt_comparison *out,
                                gbt_error *err)
{
    lpips *net;
    lpips_scores scores = {0};
    GBT_TRY(lpips_open(network, &net, err));
    const gbt_status status = lpips_compare(net, a, b, NULL, 0, &scores, err);
    out->lpips = scores.lpips;
    out->lpips_01 = scores.lpips_01;
    lpips_close(net);
    return status;
}

gbt_status gbt_compare_images(const char *path, const char *reference, const char *network,
                              gbt_comparison *out, gbt_error *err)
{
    image a = {0}, b = {0};
    *out = (gbt_comparison){0};
    gbt_status status = read_pair(path, reference, &a, &b, err);
    if (status == GBT_OK)
        status = compare(&a, &b, out, err);
    if (status == GBT_OK && network != NULL)
        status = compare_lpips(&a, &b, network, out, err);
    image_free(&a);
    image_free(&b);
    return status;
}

static gbt_status check_finite(const float *const pictures[2], int width, int height, gbt_error *err)
{
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k < 3 * (size_t)width * (size_t)height; k++)
            if (!isfinite(pictures[i][k]))
                return base_fail(err, GBT_ERR_ARGUMENT, "%s: %g at pixel %zu, %zu (wanted finite values)",
                                 i == 0 ? "picture" : "reference", (double)pictures[i][k],
                                 k / 3 % (size_t)width, k / 3 / (size_t)width);
    return GBT_OK;
}

gbt_status gbt_compare_pictures(const float *picture, const float *reference, int width, int height,
                                gbt_comparison *out, gbt_error *err)
{
    const float *const from[2] = {picture, reference};
    image copies[2] = {{0}, {0}};
    *out = (gbt_comparison){0};
    if (width < 1 || height < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "pictures: %d x %d pixels (wanted both >= 1)", width, height);
    GBT_TRY(check_finite(from, width, height, err));
    gbt_status status = GBT_OK;
    for (int i = 0; i < 2 && status == GBT_OK; i++) {
        status = image_alloc(&copies[i], width, height, 3, err);
        if (status == GBT_OK) {
            memcpy(copies[i].pixels, from[i], 3 * (size_t)width * (size_t)height * sizeof(float));
            image_quantize(&copies[i]);
        }
    }
    if (status == GBT_OK)
        status = compare(&copies[0], &copies[1], out, err);
    image_free(&copies[0]);
    image_free(&copies[1]);
    return status;
}
