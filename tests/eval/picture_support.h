/* SPDX-License-Identifier: Apache-2.0 */
/* tests/eval/picture_support.h -- a folder for pictures, and pictures of noise. */
#ifndef GBT_TESTS_PICTURE_SUPPORT_H
#define GBT_TESTS_PICTURE_SUPPORT_H

#include "test_support.h"

#include <unistd.h>

#include "base/image.h"
#include "base/rng.h"

static char folder[] = "/tmp/gbt_pictures_XXXXXX"; /* for mkdtemp() */

static inline const char *in_folder(const char *name)
{
    static char paths[4][128];
    static int next = 0;
    char *path = paths[next = (next + 1) % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

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
