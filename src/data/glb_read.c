/* SPDX-License-Identifier: Apache-2.0 */
/* data/glb_read.c -- reads .glb: the first primitive with Gaussians, from the JSON chunk and the binary
   chunk. */
#include "data/glb.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>

#include "base/log.h"
#include "data/json_fields.h"

typedef struct reading {
    const source_file *file;
    json_t *root;
    const json_t *attributes;
    cursor data; /* covers the whole file and stands at the first byte of the binary chunk */
    size_t data_size, count;
} reading;

static gbt_status wrong(const reading *r, const char *what, gbt_error *err)
{
    return base_fail(err, GBT_ERR_FORMAT, "%s: glTF: %s", r->file->name, what);
}

static gbt_status read_chunks(reading *r, gbt_error *err)
{
    cursor c = {.file = r->file};
    GBT_TRY(cursor_need(&c, 20, "the header of glTF", err));
    const uint32_t magic = cursor_u32(&c), version = cursor_u32(&c);
    if (magic != GLB_MAGIC || version != 2)
        return wrong(r, "not binary glTF 2.0", err);
    cursor_u32(&c); /* skip the total length */
    const uint32_t json_size = cursor_u32(&c);
    if (cursor_u32(&c) != GLB_JSON)
        return wrong(r, "the first chunk is not JSON", err);
    GBT_TRY(cursor_need(&c, json_size, "the JSON of glTF", err));
    char name[JSON_PATH_SIZE];
    snprintf(name, sizeof name, "%s: glTF", r->file->name);
    GBT_TRY(json_read_text((const char *)r->file->bytes + c.at, json_size, name, &r->root, err));
    cursor_skip(&c, json_size);
    GBT_TRY(cursor_need(&c, 8, "the binary chunk of glTF", err));
    r->data_size = cursor_u32(&c);
    if (cursor_u32(&c) != GLB_BINARY)
        return wrong(r, "the second chunk is not binary", err);
    GBT_TRY(cursor_need(&c, r->data_size, "the binary chunk of glTF", err));
    r->data = c;
    return GBT_OK;
}

/* ---- finding the Gaussians ---- */

/* The mesh with the first such primitive, and the attributes of that primitive. */
static gbt_status find_primitive(reading *r, size_t *mesh_index, gbt_error *err)
{
    const json_t *mesh, *primitive;
    size_t i, k, count = 0;
    json_array_foreach(json_object_get(r->root, "meshes"), i, mesh)
    {
        json_array_foreach(json_object_get(mesh, "primitives"), k, primitive)
        {
            const json_t *own =
                json_object_get(json_object_get(primitive, "extensions"), "KHR_gaussian_splatting");
            if (own == NULL || count++ > 0)
                continue;
            const json_t *space = json_object_get(own, "colorSpace");
            if (json_is_string(space) && strcmp(json_string_value(space), "srgb_rec709_display") != 0)
                return wrong(r, "colours of another space (wanted srgb_rec709_display)", err);
            if (json_object_size(json_object_get(own, "extensions")) > 0)
                return wrong(r, "compressed Gaussians are not read", err);
            r->attributes = json_object_get(primitive, "attributes");
            *mesh_index = i;
        }
    }
    if (count > 1)
        log_warn("%s: only the first of %zu primitives of Gaussians is read", r->file->name, count);
    return count > 0 ? GBT_OK : wrong(r, "no primitive has KHR_gaussian_splatting", err);
}

/* Whether the node has this array of numbers, with values other than `wanted`. */
static bool differs(const json_t *node, const char *key, const double *wanted, size_t count)
{
    const json_t *numbers = json_object_get(node, key);
    for (size_t k = 0; numbers != NULL && k < count; k++)
        if (json_number_value(json_array_get(numbers, k)) != wanted[k])
            return true;
    return false;
}

/* Whether the node has a transformation other than a translation. */
static bool is_rotated_or_scaled(const json_t *node)
{
    static const double matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                        rotation[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
    return differs(node, "matrix", matrix, 16) || differs(node, "rotation", rotation, 4) ||
           differs(node, "scale", scale, 3);
}

static bool has_mesh(const json_t *node, size_t mesh_index)
{
    const json_t *mesh = json_object_get(node, "mesh");
    return json_is_integer(mesh) && json_integer_value(mesh) == (json_int_t)mesh_index;
}

/* Mark the first node of the mesh, and all its ancestors, in `holds_mesh`. `parent` starts as [count] zeros.
   Returns that node's index, or `count` if there is none. */
static size_t find_node(const reading *r, const json_t *nodes, size_t mesh_index, size_t *parent,
                        bool *holds_mesh)
{
    const size_t count = json_array_size(nodes);
    size_t first = count, own = 0;
    const json_t *node, *child;
    size_t i, k;
    json_array_foreach(nodes, i, node)
    {
        json_array_foreach(json_object_get(node, "children"), k, child)
        {
            const json_int_t index = json_is_integer(child) ? json_integer_value(child) : -1;
            if (index >= 0 && (uint64_t)index < count)
                parent[index] = i + 1; /* one more than the index; 0: no parent */
        }
    }
    json_array_foreach(nodes, i, node)
    {
        if (has_mesh(node, mesh_index) && own++ == 0)
            first = i;
    }
    for (k = own > 0 ? first + 1 : 0; k != 0 && !holds_mesh[k - 1]; k = parent[k - 1])
        holds_mesh[k - 1] = true;
    if (own > 1)
        log_warn("%s: only the first of %zu nodes of the Gaussians' mesh is read", r->file->name, own);
    return first;
}

/* The translation of the mesh's node becomes the cloud's origin. Any other transformation of that node or its
   ancestors is an error; other nodes (cameras, lights and so on) are ignored. */
static gbt_status place_of(const reading *r, const json_t *nodes, const bool *holds_mesh, size_t own_node,
                           double place[3], gbt_error *err)
{
    static const double nowhere[3] = {0, 0, 0};
    const json_t *node;
    size_t i;
    json_array_foreach(nodes, i, node)
    {
        const json_t *translation = json_object_get(node, "translation");
        const bool own = i == own_node;
        if (holds_mesh[i] &&
            (is_rotated_or_scaled(node) || (!own && differs(node, "translation", nowhere, 3))))
            return wrong(r,
                         "the Gaussians' node or a parent has a matrix, rotation or scale, or a parent a "
                         "translation (not supported)",
                         err);
        for (size_t k = 0; own && k < 3; k++)
            place[k] = json_number_value(json_array_get(translation, k));
        if (own && !(fabs(place[0]) < 1e12 && fabs(place[1]) < 1e12 && fabs(place[2]) < 1e12))
            return wrong(r, "the node is too far away", err);
    }
    return GBT_OK;
}

static gbt_status read_place(const reading *r, size_t mesh_index, double place[3], gbt_error *err)
{
    const json_t *nodes = json_object_get(r->root, "nodes");
    const size_t count = json_array_size(nodes);
    size_t *parent = mem_calloc(count, sizeof *parent, "nodes", err);
    bool *holds_mesh = mem_calloc(count, sizeof *holds_mesh, "nodes", err);
    gbt_status status = parent != NULL && holds_mesh != NULL ? GBT_OK : GBT_ERR_NO_MEMORY;
    if (status == GBT_OK) {
        const size_t own_node = find_node(r, nodes, mesh_index, parent, holds_mesh);
        status = place_of(r, nodes, holds_mesh, own_node, place, err);
    }
    mem_free(parent);
    mem_free(holds_mesh);
    return status;
}

/* ---- attributes ---- */

typedef struct column {
    size_t from, stride; /* bytes; `from` is an offset in the binary chunk */
    size_t width;        /* bytes of one component */
    int type;            /* glTF's componentType */
} column;

static size_t width_of(int type)
{
    switch (type) {
    case GLB_BYTE:
    case GLB_UBYTE:
        return 1;
    case GLB_SHORT:
    case GLB_USHORT:
        return 2;
    case GLB_FLOAT:
        return 4;
    default:
        return 0;
    }
}

/* An integer field in [0, 2^40]; `missing` when it is absent, SIZE_MAX when it is anything else. */
static size_t whole(const json_t *object, const char *key, size_t missing)
{
    const json_t *value = json_object_get(object, key);
    if (value == NULL)
        return missing;
    const json_int_t number = json_is_integer(value) ? json_integer_value(value) : -1;
    return number >= 0 && number <= (json_int_t)1 << 40 ? (size_t)number : SIZE_MAX;
}

static gbt_status find_column(reading *r, const char *name, const char *kind, size_t numbers, column *out,
                              gbt_error *err)
{
    const json_t *accessor = json_array_get(json_object_get(r->root, "accessors"),
                                            whole(r->attributes, name, SIZE_MAX)),
                 *view = json_array_get(json_object_get(r->root, "bufferViews"),
                                        whole(accessor, "bufferView", SIZE_MAX)),
                 *type = json_object_get(accessor, "type");
    const size_t count = whole(accessor, "count", 0);
    out->type = (int)whole(accessor, "componentType", 0);
    out->width = width_of(out->type);
    const size_t record = out->width * numbers, in_view = whole(accessor, "byteOffset", 0),
                 from = whole(view, "byteOffset", 0);
    out->stride = whole(view, "byteStride", record);
    if (accessor == NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: glTF: %s is missing", r->file->name, name);
    if (out->width == 0 || !json_is_string(type) || strcmp(json_string_value(type), kind) != 0)
        return base_fail(err, GBT_ERR_FORMAT, "%s: glTF: %s: wanted %s of floats, bytes or shorts",
                         r->file->name, name, kind);
    if (json_object_get(accessor, "sparse") != NULL)
        return base_fail(err, GBT_ERR_FORMAT, "%s: glTF: %s: sparse accessors are not supported",
                         r->file->name, name);
    out->from = from + in_view;
    if (view == NULL || whole(view, "buffer", SIZE_MAX) != 0 || count == 0 || count == SIZE_MAX ||
        in_view == SIZE_MAX || from == SIZE_MAX || out->stride < record || out->stride > 1 << 16 ||
        out->from > r->data_size || r->data_size - out->from < record ||
        (r->data_size - out->from - record) / out->stride < count - 1)
        return base_fail(err, GBT_ERR_FORMAT, "%s: glTF: %s: its values are not in the binary chunk",
                         r->file->name, name);
    if (r->count != 0 && r->count != count)
        return base_fail(err, GBT_ERR_FORMAT, "%s: glTF: %s has %zu values (wanted %zu)", r->file->name, name,
                         count, r->count);
    r->count = count;
    return GBT_OK;
}

/* Integers are normalised: they stand for [0, 1] or [-1, 1]. */
static double number(const reading *r, const column *c, size_t i, size_t k)
{
    cursor at = r->data;
    at.at += c->from + i * c->stride + k * c->width;
    switch (c->type) {
    case GLB_BYTE:
        return fmax((double)(int8_t)cursor_uint(&at, 1) / 127, -1);
    case GLB_UBYTE:
        return (double)cursor_uint(&at, 1) / 255;
    case GLB_SHORT:
        return fmax((double)(int16_t)cursor_uint(&at, 2) / 32767, -1);
    case GLB_USHORT:
        return (double)cursor_uint(&at, 2) / 65535;
    default:
        return (double)cursor_f32(&at);
    }
}

typedef struct columns {
    column mean, rotation, scale, opacity, sh[GAUSSIAN_SH_COUNT];
} columns;

static gbt_status find_columns(reading *r, columns *c, int *degree, gbt_error *err)
{
    GBT_TRY(find_column(r, "POSITION", "VEC3", 3, &c->mean, err));
    GBT_TRY(find_column(r, "KHR_gaussian_splatting:ROTATION", "VEC4", 4, &c->rotation, err));
    GBT_TRY(find_column(r, "KHR_gaussian_splatting:SCALE", "VEC3", 3, &c->scale, err));
    GBT_TRY(find_column(r, "KHR_gaussian_splatting:OPACITY", "SCALAR", 1, &c->opacity, err));
    size_t k = 0;
    for (int d = 0; d <= 3; d++)
        for (int n = 0; n <= 2 * d; n++, k++) {
            char name[64];
            snprintf(name, sizeof name, "KHR_gaussian_splatting:SH_DEGREE_%d_COEF_%d", d, n);
            if (d > 0 && n == 0 && json_object_get(r->attributes, name) == NULL)
                return GBT_OK;
            GBT_TRY(find_column(r, name, "VEC3", 3, &c->sh[k], err));
            *degree = d;
        }
    return GBT_OK;
}

/* Add Gaussian i, turned by 180 degrees about z as in the writer. */
static void take(const reading *r, const columns *c, size_t i, gaussian_cloud *out)
{
    gaussian_row row = {.opacity = number(r, &c->opacity, i, 0)};
    const size_t coefficients = (size_t)((out->sh_degree + 1) * (out->sh_degree + 1));
    for (size_t k = 0; k < 3; k++) {
        const double scale = number(r, &c->scale, i, k);
        row.mean[k] = (k < 2 ? -1 : 1) * number(r, &c->mean, i, k);
        row.scale_log[k] = scale >= 0 ? log(scale) : (double)NAN;
    }
    row.quat[0] = number(r, &c->rotation, i, 3);
    for (size_t k = 0; k < 3; k++)
        row.quat[k + 1] = (k < 2 ? -1 : 1) * number(r, &c->rotation, i, k);
    for (size_t k = 0; k < coefficients; k++)
        for (size_t channel = 0; channel < 3; channel++)
            row.sh[k][channel] = (k % 2 == 0 ? 1 : -1) * number(r, &c->sh[k], i, channel);
    gaussian_cloud_add(out, &row);
}

static gbt_status read_root(reading *r, gaussian_cloud *out, gbt_error *err)
{
    size_t mesh = 0;
    double place[3] = {0, 0, 0};
    columns c;
    int degree = 0;
    GBT_TRY(find_primitive(r, &mesh, err));
    GBT_TRY(read_place(r, mesh, place, err));
    GBT_TRY(find_columns(r, &c, &degree, err));
    GBT_TRY(gaussian_cloud_alloc(out, r->count, err));
    out->count = 0;
    out->sh_degree = degree;
    for (size_t i = 0; i < r->count; i++)
        take(r, &c, i, out);
    for (int k = 0; k < 3; k++)
        out->origin[k] = (k < 2 ? 0 - place[k] : place[k]);
    const json_t *extras = json_object_get(json_object_get(r->root, "asset"), "extras");
    out->near = gaussian_cloud_near(json_number_value(json_object_get(extras, GLB_NEAR)));
    return out->count > 0 ? GBT_OK
                          : base_fail(err, GBT_ERR_FORMAT, "%s: holds no usable Gaussian (%zu dropped)",
                                      r->file->name, out->dropped);
}

gbt_status glb_read(const source_file *file, gaussian_cloud *out, gbt_error *err)
{
    reading r = {.file = file};
    memset(out, 0, sizeof *out);
    gbt_status status = read_chunks(&r, err);
    if (status == GBT_OK)
        status = read_root(&r, out, err);
    json_decref(r.root);
    if (status != GBT_OK)
        gaussian_cloud_free(out);
    return status;
}
