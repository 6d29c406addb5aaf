/* SPDX-License-Identifier: Apache-2.0 */
/* data/mesh_file.h -- reads positions and triangles from Wavefront OBJ and PLY files. */
#ifndef GBT_DATA_MESH_FILE_H
#define GBT_DATA_MESH_FILE_H

#include "data/bytes.h"

typedef struct mesh_data {
    size_t vertex_count, vertex_capacity, triangle_count, triangle_capacity;
    double *position;    /* [vertex_count][3], finite, within RAW_COORDINATE_LIMIT; owned */
    uint32_t *triangles; /* [triangle_count][3], each < vertex_count; owned */
} mesh_data;

/**
 * Read a mesh file: PLY if it begins with "ply", else OBJ. Polygons become fans of triangles around their
 * first corner.
 *
 * OBJ: `v` (what follows the first three numbers is not used) and `f` (corners as 1, 1/2, 1//3 or 1/2/3;
 * negative numbers count back from the last vertex so far); texture coordinates, normals, groups, materials,
 * lines and points are ignored; curves, surfaces and anything else are an error. A byte order mark may come
 * first, and a line that ends in a backslash continues on the next one. PLY: x y z of element vertex, and the
 * list vertex_indices or vertex_index of element face.
 *
 * @param out [out] free with mesh_data_free() after success or failure; at least one triangle
 * @return GBT_OK, GBT_ERR_IO, GBT_ERR_FORMAT ("FILE:LINE: what was wrong"), GBT_ERR_NO_MEMORY
 * Threads: any, with distinct `out`.
 */
gbt_status mesh_file_read(const char *path, mesh_data *out, gbt_error *err);

/** mesh_file_read() for a file in memory; the caller zeroes `out`. */
gbt_status mesh_file_parse(const source_file *file, mesh_data *out, gbt_error *err);

void mesh_data_free(mesh_data *mesh); /* zeroes the struct */

#endif
