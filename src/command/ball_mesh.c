/* SPDX-License-Identifier: Apache-2.0 */
/* command/ball_mesh.c -- balls as icospheres: an icosahedron subdivided once, with its 12 corners and 30 edge
   midpoints as vertices and 80 triangles. */
#include "command/ball_mesh.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"

enum { CORNERS = 12, SIDES = 20 };

typedef struct icosphere {
    float vertex[ICOSPHERE_VERTICES][3]; /* unit length */
    uint32_t face[ICOSPHERE_FACES][3];
} icosphere;

static void set_unit(float out[3], double x, double y, double z)
{
    const double length = sqrt(x * x + y * y + z * z);
    out[0] = (float)(x / length);
    out[1] = (float)(y / length);
    out[2] = (float)(z / length);
}

/** Index of the midpoint of edge ab; created on first use. */
static uint32_t middle_of(icosphere *ico, uint32_t middle[CORNERS][CORNERS], uint32_t *count, uint32_t a,
                          uint32_t b)
{
    if (middle[a][b] == 0) {
        const float *p = ico->vertex[a], *q = ico->vertex[b];
        set_unit(ico->vertex[*count], (double)p[0] + (double)q[0], (double)p[1] + (double)q[1],
                 (double)p[2] + (double)q[2]);
        middle[a][b] = middle[b][a] = (*count)++;
    }
    return middle[a][b];
}

/** The corners are the cyclic permutations of (0, +-1, +-phi). Three of them form a face if all their
    distances are the edge length, 2. */
static void make_icosphere(icosphere *ico)
{
    const double phi = (1 + sqrt(5.0)) / 2;
    double corner[CORNERS][3];
    uint32_t middle[CORNERS][CORNERS] = {{0}}, count = CORNERS, face_count = 0;
    for (int i = 0; i < CORNERS; i++) {
        const int axis = i / 4;
        corner[i][axis] = 0;
        corner[i][(axis + 1) % 3] = i & 1 ? 1 : -1;
        corner[i][(axis + 2) % 3] = i & 2 ? phi : -phi;
        set_unit(ico->vertex[i], corner[i][0], corner[i][1], corner[i][2]);
    }
    for (uint32_t a = 0; a < CORNERS; a++)
        for (uint32_t b = a + 1; b < CORNERS; b++)
            for (uint32_t c = b + 1; c < CORNERS; c++) {
                double ab = 0, bc = 0, ca = 0;
                for (int k = 0; k < 3; k++) {
                    ab += (corner[a][k] - corner[b][k]) * (corner[a][k] - corner[b][k]);
                    bc += (corner[b][k] - corner[c][k]) * (corner[b][k] - corner[c][k]);
                    ca += (corner[c][k] - corner[a][k]) * (corner[c][k] - corner[a][k]);
                }
                if (fmax(ab, fmax(bc, ca)) > 4.1) /* squared: an edge is 4, the next larger distance 10.5 */
                    continue;
                const double *p = corner[a], *q = corner[b], *r = corner[c];
                const double volume = p[0] * (q[1] * r[2] - q[2] * r[1]) +
                                      p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0]);
                const uint32_t x = a, y = volume > 0 ? b : c, z = volume > 0 ? c : b;
                const uint32_t xy = middle_of(ico, middle, &count, x, y),
                               yz = middle_of(ico, middle, &count, y, z),
                               zx = middle_of(ico, middle, &count, z, x);
                const uint32_t split[4][3] = {{x, xy, zx}, {y, yz, xy}, {z, zx, yz}, {xy, yz, zx}};
                memcpy(ico->face[face_count], split, sizeof split);
                face_count += 4;
            }
}

gbt_status ball_mesh_build(const float *center, const float *radius, const float *color, size_t count,
                           ball_mesh *out, gbt_error *err)
{
    memset(out, 0, sizeof *out);
    if (count > UINT32_MAX / ICOSPHERE_VERTICES)
        return base_fail(err, GBT_ERR_NO_MEMORY, "mesh: %zu balls are too many (at most %u)", count,
                         UINT32_MAX / ICOSPHERE_VERTICES);
    ball_mesh mesh = {.vertex_count = count * ICOSPHERE_VERTICES, .face_count = count * ICOSPHERE_FACES};
    mesh.position = mem_alloc(mesh.vertex_count, 3 * sizeof *mesh.position, "mesh", err);
    mesh.color = mem_alloc(mesh.vertex_count, 3 * sizeof *mesh.color, "mesh", err);
    mesh.faces = mem_alloc(mesh.face_count, 3 * sizeof *mesh.faces, "mesh", err);
    if (mesh.position == NULL || mesh.color == NULL || mesh.faces == NULL) {
        ball_mesh_free(&mesh);
        return GBT_ERR_NO_MEMORY;
    }
    icosphere ico;
    make_icosphere(&ico);
    for (size_t i = 0; i < count; i++) {
        float *position = mesh.position + i * ICOSPHERE_VERTICES * 3;
        for (size_t v = 0; v < ICOSPHERE_VERTICES; v++)
            for (size_t k = 0; k < 3; k++)
                position[3 * v + k] = center[3 * i + k] + radius[i] * ico.vertex[v][k];
        for (size_t v = 0; v < ICOSPHERE_VERTICES; v++)
            memcpy(mesh.color + (i * ICOSPHERE_VERTICES + v) * 3, color + 3 * i, 3 * sizeof *color);
        for (size_t f = 0; f < ICOSPHERE_FACES; f++)
            for (size_t k = 0; k < 3; k++)
                mesh.faces[(i * ICOSPHERE_FACES + f) * 3 + k] =
                    (uint32_t)(i * ICOSPHERE_VERTICES) + ico.face[f][k];
    }
    *out = mesh;
    return GBT_OK;
}

void ball_mesh_free(ball_mesh *mesh)
{
    mem_free(mesh->position);
    mem_free(mesh->color);
    mem_free(mesh->faces);
    memset(mesh, 0, sizeof *mesh);
}
