/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert_scene.c -- collect the inserted objects: all triangles in one tree, and vertex normals. */
#include "render/insert_surface.h"

#include <math.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"

static void add_normals(insert_scene *in, size_t first)
{
    for (size_t i = first; i < in->triangle_count; i++) {
        const uint32_t *corner = in->triangles + 3 * i;
        double ab[3], ac[3], normal[3];
        for (size_t k = 0; k < 3; k++) {
            const double a = (double)in->vertices[3 * (size_t)corner[0] + k];
            ab[k] = (double)in->vertices[3 * (size_t)corner[1] + k] - a;
            ac[k] = (double)in->vertices[3 * (size_t)corner[2] + k] - a;
        }
        dvec_cross(ab, ac, normal);
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < 3; k++)
                in->normals[3 * (size_t)corner[c] + k] += normal[k];
    }
}

gbt_status insert_add(insert_scene *in, const insert_object *object, const float *vertices,
                      size_t vertex_count, const uint32_t *triangles, size_t triangle_count, gbt_error *err)
{
    const size_t vertex_first = in->vertex_count, triangle_first = in->triangle_count;
    if (vertex_first + vertex_count >= UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "mesh: %zu vertices (wanted fewer than 2^32 - 1)",
                         vertex_first + vertex_count);
    GBT_TRY(mesh_check_triangles(triangles, triangle_count, vertex_count, err));
    GBT_TRY(mem_reserve((void **)&in->objects, &in->object_capacity, in->object_count, in->object_count + 1,
                        sizeof *in->objects, "objects", err));
    GBT_TRY(mem_reserve((void **)&in->normals, &in->normal_capacity, vertex_first,
                        vertex_first + vertex_count, 3 * sizeof *in->normals, "mesh", err));
    GBT_TRY(mem_reserve((void **)&in->vertices, &in->vertex_capacity, vertex_first,
                        vertex_first + vertex_count, 3 * sizeof *in->vertices, "mesh", err));
    GBT_TRY(mem_reserve((void **)&in->triangles, &in->triangle_capacity, triangle_first,
                        triangle_first + triangle_count, 3 * sizeof *in->triangles, "mesh", err));
    for (size_t i = 0; i < 3 * vertex_count; i++) {
        in->vertices[3 * vertex_first + i] = vertices[i];
        in->normals[3 * vertex_first + i] = 0;
    }
    for (size_t i = 0; i < 3 * triangle_count; i++)
        in->triangles[3 * triangle_first + i] = (uint32_t)vertex_first + triangles[i];
    in->vertex_count += vertex_count;
    in->triangle_count += triangle_count;
    insert_object *added = &in->objects[in->object_count++];
    *added = *object;
    added->triangle_end = in->triangle_count;
    if (object->smooth)
        add_normals(in, triangle_first);
    return GBT_OK;
}

gbt_status insert_finish(insert_scene *in, gbt_error *err)
{
    float largest = 0;
    for (size_t i = 0; i < 3 * in->vertex_count; i++)
        largest = fmaxf(largest, fabsf(in->vertices[i]));
    in->offset_min = largest * 0x1p-40f; /* for points near 0, where the relative offset vanishes; hit points
                                            are exact to about 2^-50 of the mesh's size */
    in->reach = largest * (1 + 2 * INSERT_OFFSET_SHARE);
    return mesh_tree_build(in->vertices, in->vertex_count, in->triangles, in->triangle_count, &in->tree, err);
}

void insert_scene_free(insert_scene *in)
{
    mesh_tree_free(in->tree);
    mem_free(in->objects);
    mem_free(in->vertices);
    mem_free(in->triangles);
    mem_free(in->normals);
    memset(in, 0, sizeof *in);
}
