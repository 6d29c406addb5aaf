/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/shapes.c -- turns shapes into triangles. Light and rays are in world.c. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "scenes/texture.h"
#include "scenes/world.h"

enum { MAX_PROFILE = 256, MAX_CELLS = 1024 };

static const float turn = 6.28318530718f;

/** Make room for one more element of `size` bytes in one of the world's arrays. */
static bool reserve(world *w, void *array, int slot, size_t used, size_t size)
{
    if (w->status == GBT_OK)
        w->status =
            mem_reserve((void **)array, &w->capacity[slot], used, used + 1, size, "scene mesh", w->err);
    return w->status == GBT_OK;
}

void world_place(world *w, float x, float y, float z, float turn_rad)
{
    w->place[0] = x;
    w->place[1] = y;
    w->place[2] = z;
    w->place[3] = turn_rad;
}

uint32_t world_vertex(world *w, const float position[3], const float normal[3], float u, float v)
{
    const size_t n = w->vertex_count;
    if (!reserve(w, &w->position, 0, n, 3 * sizeof *w->position) ||
        !reserve(w, &w->normal, 1, n, 3 * sizeof *w->normal) || !reserve(w, &w->uv, 2, n, 2 * sizeof *w->uv))
        return 0;
    const float c = cosf(w->place[3]), s = sinf(w->place[3]);
    float *p = w->position + 3 * n, *m = w->normal + 3 * n;
    p[0] = w->place[0] + c * position[0] - s * position[1];
    p[1] = w->place[1] + s * position[0] + c * position[1];
    p[2] = w->place[2] + position[2];
    const float length = sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const float scale = length > 0 ? 1 / length : 0;
    m[0] = scale * (c * normal[0] - s * normal[1]);
    m[1] = scale * (s * normal[0] + c * normal[1]);
    m[2] = length > 0 ? scale * normal[2] : 1;
    w->uv[2 * n] = u;
    w->uv[2 * n + 1] = v;
    w->vertex_count = n + 1;
    return (uint32_t)n;
}

void world_triangle(world *w, int material, int variant, uint32_t a, uint32_t b, uint32_t c)
{
    const size_t n = w->triangle_count;
    if (!reserve(w, &w->triangle, 3, n, 3 * sizeof *w->triangle) ||
        !reserve(w, &w->material, 4, n, sizeof *w->material) ||
        !reserve(w, &w->variant, 5, n, sizeof *w->variant))
        return;
    w->triangle[3 * n] = a;
    w->triangle[3 * n + 1] = b;
    w->triangle[3 * n + 2] = c;
    w->material[n] = (uint16_t)material;
    w->variant[n] = (uint16_t)variant;
    w->triangle_count = n + 1;
}

/** Add the two triangles of each cell of a grid of vertices, which starts at `first` and has rows of
    `columns` + 1. */
static void stitch(world *w, int material, int variant, uint32_t first, int columns, int rows)
{
    const uint32_t stride = (uint32_t)columns + 1;
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++) {
            const uint32_t a = first + (uint32_t)j * stride + (uint32_t)i;
            world_triangle(w, material, variant, a, a + 1, a + stride + 1);
            world_triangle(w, material, variant, a, a + stride + 1, a + stride);
        }
}

static int cell_count(float length, float cell)
{
    const float count = ceilf(length / cell);
    return count < 1 ? 1 : count > (float)MAX_CELLS ? MAX_CELLS : (int)count;
}

void world_sheet(world *w, int material, int variant, const float corner[3], const float a[3],
                 const float b[3], float cell)
{
    const float length_a = sqrtf(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]),
                length_b = sqrtf(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    const float normal[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const int columns = cell_count(length_a, cell), rows = cell_count(length_b, cell);
    const uint32_t first = (uint32_t)w->vertex_count;
    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= columns; i++) {
            const float s = (float)i / (float)columns, t = (float)j / (float)rows;
            const float p[3] = {corner[0] + s * a[0] + t * b[0], corner[1] + s * a[1] + t * b[1],
                                corner[2] + s * a[2] + t * b[2]};
            world_vertex(w, p, normal, (s - 0.5f) * length_a, (t - 0.5f) * length_b);
        }
    stitch(w, material, variant, first, columns, rows);
}

void world_box(world *w, int material, int variant, const float center[3], const float half[3], float cell)
{
    /* Per face: its outward axis and sign, and the axes of uv, chosen so that v is up on the four sides. */
    static const struct {
        int axis, sign, u, u_sign, v;
    } faces[6] = {{0, 1, 1, 1, 2},  {0, -1, 1, -1, 2}, {1, 1, 0, -1, 2},
                  {1, -1, 0, 1, 2}, {2, 1, 0, 1, 1},   {2, -1, 0, -1, 1}};
    for (int f = 0; f < 6; f++) {
        float corner[3], a[3] = {0}, b[3] = {0};
        memcpy(corner, center, sizeof corner);
        corner[faces[f].axis] += (float)faces[f].sign * half[faces[f].axis];
        a[faces[f].u] = 2 * (float)faces[f].u_sign * half[faces[f].u];
        b[faces[f].v] = 2 * half[faces[f].v];
        for (int k = 0; k < 3; k++)
            corner[k] -= 0.5f * (a[k] + b[k]);
        world_sheet(w, material, variant, corner, a, b, cell);
    }
}

void world_revolve(world *w, int material, int variant, const float profile[][2], int count, int segments)
{
    float along = 0;
    uint32_t first = (uint32_t)w->vertex_count;
    for (int i = 0; i < count; i++) {
        const bool joins_last =
            i > 0 && (profile[i][0] != profile[i - 1][0] || profile[i][1] != profile[i - 1][1]);
        const bool joins_next =
            i + 1 < count && (profile[i][0] != profile[i + 1][0] || profile[i][1] != profile[i + 1][1]);
        const float *from = profile[joins_last ? i - 1 : i], *to = profile[joins_next ? i + 1 : i];
        const float d_radius = to[0] - from[0], d_height = to[1] - from[1];
        if (joins_last)
            along += hypotf(profile[i][0] - profile[i - 1][0], profile[i][1] - profile[i - 1][1]);
        const uint32_t row = (uint32_t)w->vertex_count;
        for (int j = 0; j <= segments; j++) {
            const float angle = turn * (float)j / (float)segments, c = cosf(angle), s = sinf(angle);
            const float p[3] = {profile[i][0] * c, profile[i][0] * s, profile[i][1]};
            const float normal[3] = {d_height * c, d_height * s, -d_radius};
            world_vertex(w, p, normal, (float)j / (float)segments, along);
        }
        if (joins_last)
            stitch(w, material, variant, first, segments, 1);
        first = row;
    }
}

void world_ball(world *w, int material, int variant, const float center[3], float radius, int segments)
{
    world_blob(w, material, variant, center, radius, 1, 0, 1, segments);
}

/** Set the normals of the vertices from `first` on to the area-weighted mean of the triangles around them;
   for shapes that were deformed by noise. */
static void smooth_normals(world *w, uint32_t first, size_t first_triangle)
{
    if (w->status != GBT_OK)
        return;
    memset(w->normal + 3 * (size_t)first, 0, 3 * (w->vertex_count - first) * sizeof *w->normal);
    for (size_t t = first_triangle; t < w->triangle_count; t++) {
        const uint32_t *v = w->triangle + 3 * t;
        float e[2][3];
        for (int k = 0; k < 3; k++)
            e[0][k] = w->position[3 * v[1] + (size_t)k] - w->position[3 * v[0] + (size_t)k],
            e[1][k] = w->position[3 * v[2] + (size_t)k] - w->position[3 * v[0] + (size_t)k];
        for (int corner = 0; corner < 3; corner++)
            for (int k = 0; k < 3; k++)
                w->normal[3 * v[corner] + (size_t)k] +=
                    e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
    }
    for (size_t i = first; i < w->vertex_count; i++) {
        float *n = w->normal + 3 * i;
        const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (length > 0) {
            n[0] /= length;
            n[1] /= length;
            n[2] /= length;
        } else
            n[2] = 1; /* the triangles at the two poles have no area */
    }
}

void world_blob(world *w, int material, int variant, const float center[3], float radius, float flat,
                float amount, float detail, int segments)
{
    const int rows = segments / 2 < 2 ? 2 : segments / 2;
    const uint32_t first = (uint32_t)w->vertex_count;
    const size_t first_triangle = w->triangle_count;
    for (int j = 0; j <= rows; j++)
        for (int i = 0; i <= segments; i++) {
            const float latitude = turn * (-0.25f + 0.5f * (float)j / (float)rows);
            const float longitude = turn * (float)(i % segments) / (float)segments;
            const float n[3] = {cosf(latitude) * cosf(longitude), cosf(latitude) * sinf(longitude),
                                sinf(latitude)};
            float r = radius;
            if (amount > 0)
                r *= 1 + amount * texture_fbm(detail * n[0] + center[0] + (float)variant,
                                              detail * n[1] + center[1], detail * n[2] + center[2], 3);
            const float p[3] = {center[0] + r * n[0], center[1] + r * n[1], center[2] + flat * r * n[2]};
            const float normal[3] = {n[0], n[1], n[2] / flat};
            world_vertex(w, p, normal, (float)i / (float)segments, radius * (latitude + 0.25f * turn));
        }
    stitch(w, material, variant, first, segments, rows);
    if (amount > 0)
        smooth_normals(w, first, first_triangle);
}

void world_torus(world *w, int material, const float center[3], float ring_radius, float tube_radius,
                 int segments, int sides)
{
    float profile[MAX_PROFILE][2];
    if (sides > MAX_PROFILE - 1)
        sides = MAX_PROFILE - 1;
    if (sides < 3)
        sides = 3;
    for (int i = 0; i <= sides; i++) {
        /* The seam is inside the ring, where its one-sided normals do not show. */
        const float angle = turn * (-0.5f + (float)i / (float)sides);
        profile[i][0] = ring_radius + tube_radius * cosf(angle);
        profile[i][1] = tube_radius * sinf(angle);
    }
    const float keep[4] = {w->place[0], w->place[1], w->place[2], w->place[3]};
    const float c = cosf(keep[3]), s = sinf(keep[3]);
    world_place(w, keep[0] + c * center[0] - s * center[1], keep[1] + s * center[0] + c * center[1],
                keep[2] + center[2], keep[3]);
    world_revolve(w, material, 0, (const float(*)[2])profile, sides + 1, segments);
    memcpy(w->place, keep, sizeof keep);
}

void world_tube(world *w, int material, const float a[3], const float b[3], float radius, int sides)
{
    float axis[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const float length = sqrtf(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    if (!(length > 0))
        return;
    for (int k = 0; k < 3; k++)
        axis[k] /= length;
    /* Any direction perpendicular to the axis will do; start from the coordinate in which the axis is
       smallest. */
    float across[3] = {0};
    across[fabsf(axis[0]) < 0.6f ? 0 : fabsf(axis[1]) < 0.6f ? 1 : 2] = 1;
    const float along = across[0] * axis[0] + across[1] * axis[1] + across[2] * axis[2];
    for (int k = 0; k < 3; k++)
        across[k] -= along * axis[k];
    const float norm = sqrtf(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
    for (int k = 0; k < 3; k++)
        across[k] /= norm;
    const float third[3] = {axis[1] * across[2] - axis[2] * across[1],
                            axis[2] * across[0] - axis[0] * across[2],
                            axis[0] * across[1] - axis[1] * across[0]};
    const uint32_t first = (uint32_t)w->vertex_count;
    for (int end = 0; end < 2; end++)
        for (int i = 0; i <= sides; i++) {
            const float angle = turn * (float)(i % sides) / (float)sides, c = cosf(angle), s = sinf(angle);
            const float *from = end == 0 ? a : b;
            const float n[3] = {c * across[0] + s * third[0], c * across[1] + s * third[1],
                                c * across[2] + s * third[2]};
            const float p[3] = {from[0] + radius * n[0], from[1] + radius * n[1], from[2] + radius * n[2]};
            world_vertex(w, p, n, (float)i / (float)sides, end == 0 ? 0 : length);
        }
    stitch(w, material, 0, first, sides, 1);
}

void world_field(world *w, int material, const float low[2], const float high[2], int cells,
                 height_fn *height)
{
    const uint32_t first = (uint32_t)w->vertex_count;
    const float step_x = (high[0] - low[0]) / (float)cells, step_y = (high[1] - low[1]) / (float)cells;
    for (int j = 0; j <= cells; j++)
        for (int i = 0; i <= cells; i++) {
            const float x = low[0] + step_x * (float)i, y = low[1] + step_y * (float)j;
            const float p[3] = {x, y, height(x, y)};
            const float normal[3] = {(height(x - step_x, y) - height(x + step_x, y)) / (2 * step_x),
                                     (height(x, y - step_y) - height(x, y + step_y)) / (2 * step_y), 1};
            world_vertex(w, p, normal, x, y);
        }
    stitch(w, material, 0, first, cells, cells);
}
