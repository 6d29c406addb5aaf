/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert_surface.h -- the surface that a ray meets among inserted objects, and where rays go from
 * there. */
#ifndef GBT_RENDER_INSERT_SURFACE_H
#define GBT_RENDER_INSERT_SURFACE_H

#include "render/insert.h"

#define NO_OBJECT UINT32_MAX

/** Points are rounded to a relative error of 2^-24; rays that leave a surface start some of these away from
    it. */
#define INSERT_OFFSET_SHARE 0x1p-18f

/** Normals are unit and on the side that the ray came from. */
typedef struct insert_surface {
    uint32_t object;          /* or NO_OBJECT */
    float point[3];           /* a little above the surface */
    float flat[3], normal[3]; /* of the triangle; for shading */
} insert_surface;

/** The surface at a hit of a ray with this direction. */
void insert_surface_at(const insert_scene *in, const mesh_hit *hit, const float dir[3], insert_surface *out);

/** How many rays ask whether a point sees the lamp: none without one, 1 for a point. */
int insert_lamp_samples(const insert_scene *in);

/** From a point to sample `sample` of the lamp: unit direction, and how far it is. False for a point in the
    lamp itself. `ray`: its number, which turns the samples. */
bool insert_towards_lamp(const insert_scene *in, const float point[3], int sample, size_t ray, float dir[3],
                         float *far);

/** The direction in which a mirror sends a ray that came along `dir`; unit. */
void insert_reflect(const insert_surface *s, const float dir[3], float out[3]);

#endif
