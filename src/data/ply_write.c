/* SPDX-License-Identifier: Apache-2.0 */
/* data/ply_write.c -- writes point clouds and triangle meshes as binary little-endian PLY. */
#include <stdio.h>

#include "data/ply.h"

static bool is_word(const char *text)
{
    for (const char *c = text; *c != '\0'; c++)
        if (!((*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') || (*c >= '0' && *c <= '9') || *c == '_'))
            return false;
    return text[0] != '\0';
}

static gbt_status check_cloud(const char *path, const ply_cloud *cloud, gbt_error *err)
{
    for (const char *c = cloud->comment; c != NULL && *c != '\0'; c++)
        if ((unsigned char)*c < 0x20)
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: PLY comment is not one line", path);
    for (size_t i = 0; i < cloud->extra_count; i++)
        if (!is_word(cloud->extras[i].name) || strlen(cloud->extras[i].name) > 64)
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: bad PLY property name: %.64s", path,
                             cloud->extras[i].name);
    for (size_t i = 0; i < 3 * cloud->face_count; i++)
        if (cloud->faces[i] >= cloud->vertex_count || cloud->faces[i] > INT32_MAX)
            return base_fail(err, GBT_ERR_ARGUMENT, "%s: face %zu has vertex %u (wanted fewer than %zu)",
                             path, i / 3, cloud->faces[i], cloud->vertex_count);
    return GBT_OK;
}

/* With an origin, coordinates may be large, where floats are too coarse: their step at 5 million is 1/2. */
static bool is_double(const ply_cloud *cloud)
{
    return cloud->origin[0] != 0 || cloud->origin[1] != 0 || cloud->origin[2] != 0;
}

static void put_header(sink *s, const ply_cloud *cloud)
{
    const char *type = is_double(cloud) ? "double" : "float";
    char line[128];
    sink_put_text(s, "ply\nformat binary_little_endian 1.0\n");
    if (cloud->comment != NULL) {
        sink_put_text(s, "comment ");
        sink_put_text(s, cloud->comment);
        sink_put_text(s, "\n");
    }
    snprintf(line, sizeof line, "element vertex %zu\n", cloud->vertex_count);
    sink_put_text(s, line);
    snprintf(line, sizeof line, "property %s x\nproperty %s y\nproperty %s z\n", type, type, type);
    sink_put_text(s, line);
    for (size_t i = 0; i < cloud->extra_count; i++) {
        snprintf(line, sizeof line, "property float %s\n", cloud->extras[i].name);
        sink_put_text(s, line);
    }
    if (cloud->color != NULL)
        sink_put_text(s, "property uchar red\nproperty uchar green\nproperty uchar blue\n");
    if (cloud->face_count > 0) {
        snprintf(line, sizeof line, "element face %zu\nproperty list uchar int vertex_indices\n",
                 cloud->face_count);
        sink_put_text(s, line);
    }
    sink_put_text(s, "end_header\n");
}

static unsigned level_of(float value)
{
    return value >= 1 ? 255 : value > 0 ? (unsigned)(value * 255 + 0.5f) : 0; /* NaN becomes 0 */
}

gbt_status ply_write(const char *path, const ply_cloud *cloud, gbt_error *err)
{
    GBT_TRY(check_cloud(path, cloud, err));
    sink s = {.err = err};
    put_header(&s, cloud);
    for (size_t i = 0; i < cloud->vertex_count && s.status == GBT_OK; i++) {
        for (size_t k = 0; k < 3; k++) {
            if (is_double(cloud))
                sink_put_f64(&s, (double)cloud->position[3 * i + k] + cloud->origin[k]);
            else
                sink_put_f32(&s, cloud->position[3 * i + k]);
        }
        for (size_t j = 0; j < cloud->extra_count; j++)
            sink_put_f32(&s, cloud->extras[j].values[i * cloud->extras[j].stride]);
        for (size_t k = 0; k < 3 && cloud->color != NULL; k++)
            sink_put_uint(&s, level_of(cloud->color[3 * i + k]), 1);
    }
    for (size_t i = 0; i < cloud->face_count && s.status == GBT_OK; i++) {
        sink_put_uint(&s, 3, 1);
        for (size_t k = 0; k < 3; k++)
            sink_put_uint(&s, cloud->faces[3 * i + k], 4);
    }
    return sink_write(&s, path);
}
