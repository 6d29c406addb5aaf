/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/texture.h -- procedural patterns: noise, bricks, tiles, letters. Pure functions of their
   arguments. */
#ifndef GBT_SCENES_TEXTURE_H
#define GBT_SCENES_TEXTURE_H

#include <stdbool.h>
#include <stdint.h>

/** Uniform in [0, 1), a function of three integers. */
float texture_hash(int x, int y, int z);

/** Smooth value noise in [-1, 1], features of size 1. */
float texture_noise(float x, float y, float z);

/** `octaves` of noise, each half as strong and twice as fine; in [-1, 1]. */
float texture_fbm(float x, float y, float z, int octaves);

/** 0 below `low`, 1 above `high`, smooth between. */
float texture_step(float low, float high, float x);

/** out = a + t (b - a); `out` may be `a`. */
void texture_mix(float out[3], const float a[3], const float b[3], float t);

/** out *= factor. */
void texture_scale(float color[3], float factor);

/**
 * Running bond of bricks, every other row shifted by half a brick.
 *
 * @param id [out] row and column of the brick at (u, v)
 * @return distance to the nearest edge of the brick, in units of u and v
 */
float texture_brick(float u, float v, float width, float height, int id[2]);

/** Wood: growth rings around the x axis, disturbed by noise; [0, 1]. */
float texture_wood(float x, float y, float z);

/** Is (u, v) in [0, 1]^2, v up, on the stroke of a 5 x 7 capital letter or digit? Unknown characters are
    blank. */
bool texture_glyph(char character, float u, float v);

#endif
