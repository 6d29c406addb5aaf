/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert_surface.h -- the surface that a ray meets among inserted objects, and the directions of
   secondary rays. */
#ifndef GBT_RENDER_INSERT_SURFACE_H
#define GBT_RENDER_INSERT_SURFACE_H

#include "render/insert.h"

#define NO_OBJECT UINT32_MAX

/** Secondary rays start this far from the surface, relative to the point's largest coordinate: well above the
    rounding error of float32, 2^-24. */
#define INSERT_OFFSET_SHARE 0x1p-18f

/** Normals are unit length and on the side from which the ray came. */
typedef struct insert_surface {
    uint32_t object;          /* or NO_OBJECT */
    float point[3];           /* moved off the surface by the offset */
    float flat[3], normal[3]; /* flat: normal of the triangle; normal: for shading */
} insert_surface;

/** The surface at a hit of a ray with direction `dir`. */
void insert_surface_at(const insert_scene *in, const mesh_hit *hit, const float dir[3], insert_surface *out);

/** Shadow rays per surface point: 0 without a lamp, 1 for a point or distant lamp. */
int insert_lamp_samples(const insert_scene *in);

/** From a point towards sample `sample` of the lamp: unit direction and distance. False if the point is the
    lamp's own position. `ray`: index of the ray, which seeds the rotation of the samples. */
bool insert_towards_lamp(const insert_scene *in, const float point[3], int sample, size_t ray, float dir[3],
                         float *far);

/** The direction into which a mirror reflects a ray of direction `dir`; unit length. */
void insert_reflect(const insert_surface *s, const float dir[3], float out[3]);

#endif
