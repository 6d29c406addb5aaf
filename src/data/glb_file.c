/* SPDX-License-Identifier: Apache-2.0 */
/* data/glb_file.c -- writes .glb: the JSON chunk, and a binary chunk with one array (one accessor) after the
   other. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "data/gaussian_formats.h"
#include "data/glb.h"

typedef struct glb {
    sink data; /* the binary chunk */
    json_t *attributes, *accessors, *views;
    size_t count;
} glb;

/* Declare the bytes appended to the binary chunk since `from` as an attribute. */
static json_t *add_attribute(glb *g, const char *name, const char *type, int component, size_t from)
{
    json_t *accessor = json_pack("{s:i,s:i,s:I,s:s}", "bufferView", (int)json_array_size(g->views),
                                 "componentType", component, "count", (json_int_t)g->count, "type", type);
    json_array_append_new(g->views, json_pack("{s:i,s:I,s:I}", "buffer", 0, "byteOffset", (json_int_t)from,
                                              "byteLength", (json_int_t)(g->data.size - from)));
    json_object_set_new(g->attributes, name, json_integer((json_int_t)json_array_size(g->accessors)));
    json_array_append_new(g->accessors, accessor);
    return accessor;
}

static void put_positions(glb *g, const gaussian_cloud *cloud)
{
    const size_t from = g->data.size;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * cloud->count; i++) {
        const float turned = i % 3 < 2 ? -cloud->mean[i] : cloud->mean[i];
        low[i % 3] = fmin(low[i % 3], (double)turned);
        high[i % 3] = fmax(high[i % 3], (double)turned);
        sink_put_f32(&g->data, turned);
    }
    json_t *accessor = add_attribute(g, "POSITION", "VEC3", GLB_FLOAT, from);
    json_object_set_new(accessor, "min", json_pack("[f,f,f]", low[0], low[1], low[2])); /* glTF wants exact
                                                                                           bounds */
    json_object_set_new(accessor, "max", json_pack("[f,f,f]", high[0], high[1], high[2]));
}

static double linear_of(double srgb)
{
    const double s = fmin(fmax(srgb, 0), 1);
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static void put_shape(glb *g, const gaussian_cloud *cloud)
{
    sink *s = &g->data;
    size_t from = s->size;
    for (size_t i = 0; i < cloud->count; i++) {
        const float *sh = cloud->sh + i * GAUSSIAN_SH_COUNT * 3;
        for (int c = 0; c < 3; c++)
            sink_put_uint(s, (uint64_t)(255 * linear_of(0.5 + GAUSSIAN_SH_0 * (double)sh[c]) + 0.5), 1);
        sink_put_uint(s, (uint64_t)(255 * fmin(fmax((double)cloud->opacity[i], 0), 1) + 0.5), 1);
    }
    json_object_set_new(add_attribute(g, "COLOR_0", "VEC4", GLB_UBYTE, from), "normalized", json_true());
    from = s->size;
    for (size_t i = 0; i < cloud->count; i++) { /* from w x y z to glTF's x y z w */
        const float *q = cloud->quat + 4 * i;
        const float norm = sqrtf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        const float turned[4] = {-q[1], -q[2], q[3], q[0]};
        for (int k = 0; k < 4; k++)
            sink_put_f32(s, turned[k] / norm);
    }
    add_attribute(g, "KHR_gaussian_splatting:ROTATION", "VEC4", GLB_FLOAT, from);
    from = s->size;
    for (size_t i = 0; i < 3 * cloud->count; i++)
        sink_put_f32(s, expf(cloud->scale_log[i]));
    add_attribute(g, "KHR_gaussian_splatting:SCALE", "VEC3", GLB_FLOAT, from);
    from = s->size;
    for (size_t i = 0; i < cloud->count; i++)
        sink_put_f32(s, cloud->opacity[i]);
    add_attribute(g, "KHR_gaussian_splatting:OPACITY", "SCALAR", GLB_FLOAT, from);
}

/* Half a turn about z changes the sign of every second SH function, in the order that files have them. */
static void put_harmonics(glb *g, const gaussian_cloud *cloud)
{
    for (size_t k = 0, degree = 0; degree <= (size_t)cloud->sh_degree; degree++)
        for (size_t n = 0; n <= 2 * degree; n++, k++) {
            const size_t from = g->data.size;
            char name[64];
            for (size_t i = 0; i < cloud->count; i++)
                for (size_t c = 0; c < 3; c++) {
                    const float value = cloud->sh[(i * GAUSSIAN_SH_COUNT + k) * 3 + c];
                    sink_put_f32(&g->data, k % 2 == 0 ? value : -value);
                }
            snprintf(name, sizeof name, "KHR_gaussian_splatting:SH_DEGREE_%zu_COEF_%zu", degree, n);
            add_attribute(g, name, "VEC3", GLB_FLOAT, from);
        }
}

/* The origin becomes the node's translation, which is stored in double. */
static json_t *document(const glb *g, const gaussian_cloud *cloud, const double origin[3])
{
    json_t *primitive =
        json_pack("{s:i,s:O,s:{s:{s:s,s:s,s:s,s:s}}}", "mode", (int)GLB_POINTS, "attributes", g->attributes,
                  "extensions", "KHR_gaussian_splatting", "kernel", "ellipse", "colorSpace",
                  "srgb_rec709_display", "sortingMethod", "cameraDistance", "projection", "perspective");
    json_t *root =
        json_pack("{s:{s:s,s:s},s:[s],s:[{s:I}],s:O,s:O,s:[{s:[o]}],s:[{s:i,s:[f,f,f]}],s:[{s:[i]}],s:i}",
                  "asset", "version", "2.0", "generator", "gbtrace", "extensionsUsed",
                  "KHR_gaussian_splatting", "buffers", "byteLength", (json_int_t)g->data.size, "bufferViews",
                  g->views, "accessors", g->accessors, "meshes", "primitives", primitive, "nodes", "mesh", 0,
                  "translation", 0 - origin[0], 0 - origin[1], origin[2], "scenes", "nodes", 0, "scene", 0);
    if (cloud->near > 0)
        json_object_set_new(json_object_get(root, "asset"), "extras",
                            json_pack("{s:f}", GLB_NEAR, (double)cloud->near));
    return root;
}

static gbt_status write_chunks(const char *path, const glb *g, const char *json, gbt_error *err)
{
    const size_t json_size = strlen(json), json_padded = (json_size + 3) / 4 * 4,
                 data_padded = (g->data.size + 3) / 4 * 4;
    const size_t total = 12 + 8 + json_padded + 8 + data_padded;
    if (total > UINT32_MAX)
        return base_fail(err, GBT_ERR_ARGUMENT, "%s: %zu bytes are too many for a .glb file (limit 4 GiB)",
                         path, total);
    sink s = {.err = err};
    const uint32_t head[5] = {GLB_MAGIC, 2, (uint32_t)total, (uint32_t)json_padded, GLB_JSON};
    for (int i = 0; i < 5; i++)
        sink_put_uint(&s, head[i], 4);
    sink_put_text(&s, json);
    for (size_t i = json_size; i < json_padded; i++)
        sink_put_text(&s, " ");
    sink_put_uint(&s, data_padded, 4);
    sink_put_uint(&s, GLB_BINARY, 4);
    sink_put(&s, g->data.bytes, g->data.size);
    static const unsigned char zeros[3];
    sink_put(&s, zeros, data_padded - g->data.size);
    return sink_write(&s, path);
}

/*
 * Write a .glb. In glTF y points up, in our scenes down, so the scene is turned by 180 degrees about z: x and
 * y change sign, and rotations and spherical harmonics follow.
 *
 * Viewers without the extension show points: COLOR_0 holds the mean colour (linear) and the opacity.
 *
 * @param origin [in] becomes the node's translation
 * @return GBT_OK; GBT_ERR_ARGUMENT (beyond 4 GiB); GBT_ERR_NO_MEMORY; as file_write_atomic()
 */
static gbt_status write_glb(const char *path, const gaussian_cloud *cloud, const double origin[3],
                            gbt_error *err)
{
    glb g = {.data.err = err,
             .attributes = json_object(),
             .accessors = json_array(),
             .views = json_array(),
             .count = cloud->count};
    put_positions(&g, cloud);
    put_shape(&g, cloud);
    put_harmonics(&g, cloud);
    gbt_status status = g.data.status;
    if (status == GBT_OK) {
        json_t *root = document(&g, cloud, origin);
        char *json =
            root == NULL ? NULL : json_dumps(root, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
        status = json == NULL ? base_fail(err, GBT_ERR_NO_MEMORY, "%s: no memory", path)
                              : write_chunks(path, &g, json, err);
        free(json);
        json_decref(root);
    }
    json_decref(g.attributes);
    json_decref(g.accessors);
    json_decref(g.views);
    sink_free(&g.data);
    return status;
}

const gaussian_format gaussian_format_glb = {
    .ending = ".glb",
    .what = "glTF 2.0 with KHR_gaussian_splatting: everything, as floats",
    .degree = 3,
    .keeps_origin = true,
    .read = glb_read,
    .write = write_glb};
