/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert.h -- meshes inserted among the Gaussians, and what a ray sees then. Defined in
   docs/inserting.md. */
#ifndef GBT_RENDER_INSERT_H
#define GBT_RENDER_INSERT_H

#include "bvh/mesh.h"
#include "trace/trace.h"

typedef enum insert_material { INSERT_MATT, INSERT_MIRROR } insert_material;

typedef struct insert_object {
    insert_material material;
    bool smooth;         /* normals are interpolated between vertices; else each triangle is flat */
    float color[3];      /* albedo: the share of the light that it reflects, [0, 1] */
    size_t triangle_end; /* its triangles reach from the end of the previous object to here */
} insert_object;

typedef enum insert_lamp { INSERT_NO_LAMP, INSERT_LAMP_POINT, INSERT_LAMP_DISTANT } insert_lamp;

enum { INSERT_LAMP_SAMPLES = 32 }; /* points on a lamp that has a radius */

/** Start from {0}; fill the light, insert_add() the objects, insert_finish(); free with insert_scene_free().
    Lengths: scene-local units. */
typedef struct insert_scene {
    insert_lamp lamp;
    double lamp_at[3];  /* position of the lamp's centre; for a distant lamp the unit vector towards it */
    double lamp_radius; /* of a point lamp: makes it a ball with soft shadows; >= 0 */
    float ambient;      /* light on every surface, [0, 1]; the lamp adds 1 - ambient where it is visible */
    size_t object_count, object_capacity;
    insert_object *objects;
    size_t vertex_count, vertex_capacity, normal_capacity, triangle_count, triangle_capacity;
    float *vertices;     /* [vertex_count][3] */
    uint32_t *triangles; /* [triangle_count][3] */
    double *normals;     /* [vertex_count][3], of smooth objects only; not normalized */
    mesh_tree *tree;
    float reach;      /* largest |coordinate| of the origins of secondary rays */
    float offset_min; /* internal: the least distance from a surface at which they start */
} insert_scene;

/**
 * Add an object; its triangle_end is set here.
 *
 * @param vertices  [in] [vertex_count][3], |x| <= MESH_COORDINATE_LIMIT; copied
 * @param triangles [in] [triangle_count][3], each < vertex_count; copied
 */
gbt_status insert_add(insert_scene *in, const insert_object *object, const float *vertices,
                      size_t vertex_count, const uint32_t *triangles, size_t triangle_count, gbt_error *err);

/** Build the tree over all objects: no more can be added. As mesh_tree_build(). */
gbt_status insert_finish(insert_scene *in, gbt_error *err);

/**
 * Trace rays among Gaussians and objects.
 *
 * @param context [in]     the insert_scene, finished; the type is that of frame_tracer.trace
 * @param scene   [in,out] built by trace_build() for origins within in->reach too; not a TRACE_EMBREE one
 * @param rgb     [out]    allocated, 3 channels, size of the rays
 * @return as trace_forward()
 * Threads: uses all; same bits for every thread count.
 * Cost: the rays themselves; for each that ends on a matt surface one shadow ray, INSERT_LAMP_SAMPLES for a
 * lamp with a radius; for each that ends on a mirror, the cost of another ray.
 */
gbt_status insert_trace(void *context, trace_scene *scene, const ray_image *rays, image *rgb, gbt_error *err);

void insert_scene_free(insert_scene *in); /* zeroes the struct */

#endif
