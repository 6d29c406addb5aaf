/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/texture.c -- procedural patterns. */
#include "scenes/texture.h"

#include <math.h>
#include <string.h>

float texture_hash(int x, int y, int z)
{
    uint32_t h = (uint32_t)x * 0x8DA6B343u ^ (uint32_t)y * 0xD8163841u ^ (uint32_t)z * 0xCB1AB31Fu;
    h ^= h >> 16;
    h *= 0x7FEB352Du;
    h ^= h >> 15;
    h *= 0x846CA68Bu;
    h ^= h >> 16;
    return (float)(h >> 8) * 0x1p-24f;
}

static float lerp(float a, float b, float t) { return a + t * (b - a); }

float texture_noise(float x, float y, float z)
{
    const float fx = floorf(x), fy = floorf(y), fz = floorf(z);
    const int i = (int)fx, j = (int)fy, k = (int)fz;
    float u = x - fx, v = y - fy, w = z - fz;
    u = u * u * (3 - 2 * u);
    v = v * v * (3 - 2 * v);
    w = w * w * (3 - 2 * w);
    const float near = lerp(lerp(texture_hash(i, j, k), texture_hash(i + 1, j, k), u),
                            lerp(texture_hash(i, j + 1, k), texture_hash(i + 1, j + 1, k), u), v);
    const float far = lerp(lerp(texture_hash(i, j, k + 1), texture_hash(i + 1, j, k + 1), u),
                           lerp(texture_hash(i, j + 1, k + 1), texture_hash(i + 1, j + 1, k + 1), u), v);
    return 2 * lerp(near, far, w) - 1;
}

float texture_fbm(float x, float y, float z, int octaves)
{
    float sum = 0, weight = 1, total = 0;
    for (int i = 0; i < octaves; i++) {
        sum += weight * texture_noise(x, y, z);
        total += weight;
        /* The shift keeps the lattices of the octaves from coinciding at the origin. */
        x = 2 * x + 17.3f;
        y = 2 * y - 5.1f;
        z = 2 * z + 3.7f;
        weight *= 0.5f;
    }
    return total > 0 ? sum / total : 0;
}

float texture_step(float low, float high, float x)
{
    float t = (x - low) / (high - low);
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

void texture_mix(float out[3], const float a[3], const float b[3], float t)
{
    for (int c = 0; c < 3; c++)
        out[c] = lerp(a[c], b[c], t);
}

void texture_scale(float color[3], float factor)
{
    for (int c = 0; c < 3; c++)
        color[c] *= factor;
}

float texture_brick(float u, float v, float width, float height, int id[2])
{
    const float row = floorf(v / height);
    const float shifted = u / width + (((int)row & 1) != 0 ? 0.5f : 0.0f);
    const float column = floorf(shifted);
    id[0] = (int)row;
    id[1] = (int)column;
    const float in_u = (shifted - column) * width, in_v = v - row * height;
    return fminf(fminf(in_u, width - in_u), fminf(in_v, height - in_v));
}

float texture_wood(float x, float y, float z)
{
    const float bend = 0.35f * texture_fbm(0.6f * x, 2 * y, 2 * z, 2);
    const float ring = 6 * (sqrtf(y * y + z * z) + bend);
    const float t = ring - floorf(ring);
    const float grain = 0.5f + 0.5f * texture_noise(3 * x, 30 * y, 30 * z);
    return 0.75f * (t < 0.8f ? t / 0.8f : (1 - t) / 0.2f) + 0.25f * grain;
}

bool texture_glyph(char character, float u, float v)
{
    static const struct {
        char character;
        unsigned char rows[7]; /* top row first, bit 4 is the left column */
    } font[] = {
        {'A', {0x0E, 0x11, 0x11, 0x1F, 0x11, 0x11, 0x11}}, {'B', {0x1E, 0x11, 0x11, 0x1E, 0x11, 0x11, 0x1E}},
        {'C', {0x0E, 0x11, 0x10, 0x10, 0x10, 0x11, 0x0E}}, {'E', {0x1F, 0x10, 0x10, 0x1E, 0x10, 0x10, 0x1F}},
        {'G', {0x0E, 0x11, 0x10, 0x17, 0x11, 0x11, 0x0E}}, {'L', {0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x1F}},
        {'O', {0x0E, 0x11, 0x11, 0x11, 0x11, 0x11, 0x0E}}, {'R', {0x1E, 0x11, 0x11, 0x1E, 0x14, 0x12, 0x11}},
        {'S', {0x0F, 0x10, 0x10, 0x0E, 0x01, 0x01, 0x1E}}, {'T', {0x1F, 0x04, 0x04, 0x04, 0x04, 0x04, 0x04}},
        {'Y', {0x11, 0x11, 0x0A, 0x04, 0x04, 0x04, 0x04}}, {'3', {0x1F, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0E}},
        {'4', {0x02, 0x06, 0x0A, 0x12, 0x1F, 0x02, 0x02}}, {'7', {0x1F, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08}},
    };
    if (!(u >= 0 && u < 1 && v >= 0 && v < 1))
        return false;
    const int column = (int)(5 * u), row = 6 - (int)(7 * v);
    for (size_t i = 0; i < sizeof font / sizeof font[0]; i++)
        if (font[i].character == character)
            return (font[i].rows[row] >> (4 - column) & 1) != 0;
    return false;
}
