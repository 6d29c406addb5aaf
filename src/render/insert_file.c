/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert_file.c -- read an insert file: JSON that names meshes to put into a scene, and a lamp. */
#include "render/insert_file.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/vec.h"
#include "data/json_fields.h"
#include "data/mesh_file.h"

enum { OBJECTS_MAX = 1000 };

static gbt_status take_lamp(const json_fields *all, const double origin[3], insert_scene *out)
{
    const json_t *light = json_object_get(all->object, "light");
    out->ambient = 1;
    if (light == NULL)
        return GBT_OK;
    if (!json_is_object(light))
        return json_field_fail(all, "light", "wanted an object with position or towards");
    const json_fields r = {all->path, "light.", light, all->err};
    double ambient = 0.4;
    GBT_TRY(json_field_names(&r, " position towards radius ambient "));
    GBT_TRY(json_field_number(&r, "ambient", 0, true, 1, &ambient));
    out->ambient = (float)ambient;
    if (json_field_given(&r, "position") == json_field_given(&r, "towards"))
        return json_field_fail(all, "light", "wanted either position or towards");
    out->lamp = json_field_given(&r, "position") ? INSERT_LAMP_POINT : INSERT_LAMP_DISTANT;
    GBT_TRY(json_field_vector(&r, "position", false, out->lamp_at));
    GBT_TRY(json_field_vector(&r, "towards", false, out->lamp_at));
    GBT_TRY(json_field_number(&r, "radius", 0, true, JSON_VALUE_MAX, &out->lamp_radius));
    if (out->lamp == INSERT_LAMP_DISTANT && json_field_given(&r, "radius"))
        return json_field_fail(&r, "radius", "only with position (a distant lamp has no radius)");
    if (out->lamp == INSERT_LAMP_DISTANT)
        dvec_normalize(out->lamp_at);
    if (out->lamp == INSERT_LAMP_DISTANT && !(dvec_length(out->lamp_at) > 0.5))
        return json_field_fail(&r, "towards", "is 0 (wanted a direction)");
    for (int k = 0; k < 3 && out->lamp == INSERT_LAMP_POINT; k++)
        out->lamp_at[k] -= origin[k];
    return GBT_OK;
}

/* From the mesh's coordinates to scene-local ones: x -> turn (scale x) + position. */
typedef struct placement {
    double scale, turn[9], position[3];
} placement;

static gbt_status take_placement(const json_fields *r, const double origin[3], placement *out)
{
    double axis[3] = {0, 0, 0}, angle_deg = 0;
    *out = (placement){.scale = 1};
    GBT_TRY(json_field_number(r, "scale", 0, false, JSON_VALUE_MAX, &out->scale));
    GBT_TRY(json_field_vector(r, "position", false, out->position));
    GBT_TRY(json_field_vector(r, "axis", false, axis));
    GBT_TRY(json_field_number(r, "angle_deg", -360, true, 360, &angle_deg));
    if (json_field_given(r, "axis") != json_field_given(r, "angle_deg"))
        return json_field_fail(r, json_field_given(r, "axis") ? "angle_deg" : "axis",
                               "missing (a rotation needs axis and angle_deg)");
    dvec_normalize(axis);
    if (json_field_given(r, "axis") && !(dvec_length(axis) > 0.5))
        return json_field_fail(r, "axis", "is 0 (wanted a direction)");
    const double half = angle_deg * PI / 360,
                 q[4] = {cos(half), sin(half) * axis[0], sin(half) * axis[1], sin(half) * axis[2]};
    dquat_to_matrix(q, out->turn);
    for (int k = 0; k < 3; k++)
        out->position[k] -= origin[k];
    return GBT_OK;
}

static gbt_status take_look(const json_fields *r, insert_object *out)
{
    static const char *const materials[] = {"matt", "mirror"};
    int material;
    double color[3] = {0.8, 0.8, 0.8};
    GBT_TRY(json_field_choice(r, "material", materials, 2, &material));
    GBT_TRY(json_field_vector(r, "color", false, color));
    GBT_TRY(json_field_bool(r, "smooth", &out->smooth));
    out->material = material == 0 ? INSERT_MATT : INSERT_MIRROR;
    for (int k = 0; k < 3; k++) {
        if (!(color[k] >= 0 && color[k] <= 1))
            return json_field_fail(r, "color", "wanted 3 numbers in [0, 1]");
        out->color[k] = (float)color[k];
    }
    return GBT_OK;
}

static gbt_status add_placed(const json_fields *r, const insert_object *object, const placement *place,
                             const mesh_data *mesh, insert_scene *out)
{
    float *vertices = mem_alloc(mesh->vertex_count, 3 * sizeof *vertices, "mesh", r->err);
    gbt_status status = vertices == NULL ? GBT_ERR_NO_MEMORY : GBT_OK;
    for (size_t i = 0; status == GBT_OK && i < mesh->vertex_count; i++) {
        double x[3];
        dmat_apply(place->turn, mesh->position + 3 * i, x);
        for (size_t k = 0; k < 3; k++) {
            x[k] = place->scale * x[k] + place->position[k];
            vertices[3 * i + k] = (float)x[k];
            if (!(fabsf(vertices[3 * i + k]) <= MESH_COORDINATE_LIMIT))
                status = base_fail(r->err, GBT_ERR_FORMAT, "%s: %smesh: vertex %zu lies beyond %g", r->path,
                                   r->prefix, i, (double)MESH_COORDINATE_LIMIT);
        }
    }
    if (status == GBT_OK)
        status = insert_add(out, object, vertices, mesh->vertex_count, mesh->triangles, mesh->triangle_count,
                            r->err);
    mem_free(vertices);
    return status;
}

static gbt_status take_object(const json_fields *r, const double origin[3], insert_scene *out)
{
    char path[JSON_PATH_SIZE];
    insert_object object = {0};
    placement place;
    mesh_data mesh;
    GBT_TRY(json_field_names(r, " mesh material color smooth position scale axis angle_deg "));
    GBT_TRY(json_field_file(r, "mesh", "an OBJ or PLY file", path));
    GBT_TRY(take_look(r, &object));
    GBT_TRY(take_placement(r, origin, &place));
    gbt_status status = mesh_file_read(path, &mesh, r->err);
    if (status == GBT_OK)
        status = add_placed(r, &object, &place, &mesh, out);
    mesh_data_free(&mesh);
    return status;
}

static gbt_status take_all(const json_fields *all, const double origin[3], insert_scene *out)
{
    const json_t *objects = json_object_get(all->object, "objects");
    GBT_TRY(json_field_names(all, " objects light "));
    GBT_TRY(take_lamp(all, origin, out));
    const size_t count = json_array_size(objects); /* 0 if it is not an array */
    if (count == 0 || count > OBJECTS_MAX)
        return base_fail(all->err, GBT_ERR_FORMAT, "%s: objects: wanted a list of 1 to %d objects", all->path,
                         OBJECTS_MAX);
    for (size_t i = 0; i < count; i++) {
        char prefix[32];
        const json_fields r = {all->path, prefix, json_array_get(objects, i), all->err};
        snprintf(prefix, sizeof prefix, "objects[%zu].", i);
        if (!json_is_object(r.object))
            return json_field_fail(&r, "mesh", "missing (wanted an object with a mesh)");
        GBT_TRY(take_object(&r, origin, out));
    }
    return insert_finish(out, all->err);
}

gbt_status insert_file_read(const char *path, const double origin[3], insert_scene *out, gbt_error *err)
{
    json_t *root;
    memset(out, 0, sizeof *out);
    GBT_TRY(json_read(path, &root, err));
    const json_fields r = {path, "", root, err};
    const gbt_status status = take_all(&r, origin, out);
    json_decref(root);
    return status;
}
