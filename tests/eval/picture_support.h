/* SPDX-License-Identifier: Apache-2.0 */
/* tests/eval/picture_support.h -- pictures of noise. */
#ifndef GBT_TESTS_PICTURE_SUPPORT_H
#define GBT_TESTS_PICTURE_SUPPORT_H

#include "folder.h"

#include "base/image.h"
#include "base/rng.h"

/* Noise on an even grid of levels, so that a PNG keeps it. */
static inline image noise(int width, int height, int channels, uint64_t seed)
{
    image im;
    assert_ok(image_alloc(&im, width, height, channels, NULL));
    for (int i = 0; i < width * height * channels; i++)
        im.pixels[i] = floorf(rng_uniform(seed, 0, (uint64_t)i) * 255.0f) / 255.0f;
    return im;
}

#endif
