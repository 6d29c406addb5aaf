/* SPDX-License-Identifier: Apache-2.0 */
/* command/ball_mesh.h -- balls as triangles: one icosphere each, for mesh viewers. */
#ifndef GBT_COMMAND_BALL_MESH_H
#define GBT_COMMAND_BALL_MESH_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/status.h"

enum { ICOSPHERE_VERTICES = 42, ICOSPHERE_FACES = 80 };

typedef struct ball_mesh {
    size_t vertex_count, face_count;
    float *position; /* [vertex_count][3] */
    float *color;    /* [vertex_count][3] */
    uint32_t *faces; /* [face_count][3], counter-clockwise seen from outside */
} ball_mesh;

/**
 * One icosphere per ball: an icosahedron subdivided once, with all vertices on the sphere.
 *
 * @param center, color [in] [count][3]
 * @param radius        [in] [count]
 * @param out           [out] free with ball_mesh_free(); zeroed on failure
 * @return GBT_OK, GBT_ERR_NO_MEMORY (also when the vertices exceed 32-bit indices)
 */
gbt_status ball_mesh_build(const float *center, const float *radius, const float *color, size_t count,
                           ball_mesh *out, gbt_error *err);
void ball_mesh_free(ball_mesh *mesh);

#endif
