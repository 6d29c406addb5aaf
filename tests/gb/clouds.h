/* SPDX-License-Identifier: Apache-2.0 */
/* tests/gb/clouds.h -- clouds for the tests of this room: random ones, and the real one from its PLY. */
#ifndef GBT_TESTS_GB_CLOUDS_H
#define GBT_TESTS_GB_CLOUDS_H

#include "base/rng.h"
#include "test_support.h"

typedef struct cloud {
    size_t count;
    float *position; /* [count][3] */
    float *color;    /* [count][3] */
} cloud;

static inline cloud cloud_alloc(size_t count)
{
    cloud c = {count, malloc((3 * count + 1) * sizeof(float)), malloc((3 * count + 1) * sizeof(float))};
    assert_non_null(c.position);
    assert_non_null(c.color);
    return c;
}

static inline void cloud_free(cloud *c)
{
    free(c->position);
    free(c->color);
    *c = (cloud){0};
}

/** Normal with standard deviations 3, 2, 1 along x, y, z about `center`; colours uniform. */
static inline cloud cloud_random(size_t count, uint64_t seed, double center, double size)
{
    static const double spread[3] = {3, 2, 1};
    cloud c = cloud_alloc(count);
    for (size_t i = 0; i < 3 * count; i++) {
        c.position[i] = (float)(center + size * spread[i % 3] * rng_normal(seed, 0, i));
        c.color[i] = rng_uniform(seed, 1, i);
    }
    return c;
}

/** A copy in another order; the map from its indices to those of `c`, to be freed. */
static inline uint32_t *cloud_shuffle(const cloud *c, uint64_t seed, cloud *out)
{
    const size_t n = c->count;
    uint32_t *to = malloc((n + 1) * sizeof *to);
    assert_non_null(to);
    for (size_t i = 0; i < n; i++)
        to[i] = (uint32_t)i;
    for (size_t i = n; i-- > 1;) {
        uint32_t words[4];
        rng_philox(seed, 9, i, words);
        const size_t j = words[0] % (i + 1);
        const uint32_t keep = to[i];
        to[i] = to[j];
        to[j] = keep;
    }
    *out = cloud_alloc(n);
    for (size_t i = 0; i < n; i++) {
        memcpy(out->position + 3 * i, c->position + 3 * to[i], 3 * sizeof(float));
        memcpy(out->color + 3 * i, c->color + 3 * to[i], 3 * sizeof(float));
    }
    return to;
}

/** The garden points: binary PLY, float x y z, uchar red green blue. NULL position when the file is not
    there. */
static inline cloud cloud_garden(void)
{
    static const char header[] = "ply\nformat binary_little_endian 1.0\n";
    static const char columns[] =
        "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nend_header\n";
    const char *path = shared_path("data/garden_points/points.ply");
    if (path == NULL)
        return (cloud){0};
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char text[1024] = {0};
    const size_t got = fread(text, 1, sizeof text - 1, file);
    assert_true(got > sizeof header && memcmp(text, header, strlen(header)) == 0);
    const char *begin = strstr(text, columns), *element = strstr(text, "element vertex ");
    assert_non_null(begin);
    assert_non_null(element);
    cloud c = cloud_alloc((size_t)strtoul(element + strlen("element vertex "), NULL, 10));
    assert_int_equal(fseek(file, (long)(begin - text) + (long)strlen(columns), SEEK_SET), 0);
    for (size_t i = 0; i < c.count; i++) {
        unsigned char rgb[3];
        assert_int_equal(fread(c.position + 3 * i, sizeof(float), 3, file), 3);
        assert_int_equal(fread(rgb, 1, 3, file), 3);
        for (int k = 0; k < 3; k++)
            c.color[3 * i + k] = (float)rgb[k] / 255.0f;
    }
    assert_int_equal(fgetc(file), EOF);
    fclose(file);
    return c;
}

#endif
