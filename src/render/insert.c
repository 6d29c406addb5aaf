/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert.c -- rays among Gaussians and the surfaces of meshes.

   rays --> [nearest surface] --> Gaussians in front of it
        --> darkened where a surface keeps the lamp from them
                  |
                  +--> matt: a ray to the lamp, through surfaces and Gaussians
                  +--> mirror: the reflected ray, seen the same way; behind BOUNCES_MAX mirrors one is matt */
#include "render/insert.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "base/vec.h"

enum { RAY_BLOCK = 512, BOUNCES_MAX = 4, LAMP_SEED = 1 };

#define NO_OBJECT UINT32_MAX

/* Points are rounded to a relative error of 2^-24; rays that leave a surface start some of these away from
   it. */
static const float offset_share = 0x1p-18f;
/* No photo was taken from there: they see what is nearer than anything before a camera. */
static const float surface_near_share = 0.1f;

/* ---- objects ---- */

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
    for (size_t i = 0; i < 3 * triangle_count; i++) {
        if (triangles[i] >= vertex_count)
            return base_fail(err, GBT_ERR_ARGUMENT,
                             "mesh: triangle %zu: bad vertex number (wanted < %zu, got %u)", i / 3,
                             vertex_count, triangles[i]);
        in->triangles[3 * triangle_first + i] = (uint32_t)vertex_first + triangles[i];
    }
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
    in->offset_min = largest * 0x1p-10f * offset_share;
    in->reach = largest * (1 + 2 * offset_share);
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

/* ---- what one ray meets ---- */

/* Normals are unit and on the side that the ray came from. */
typedef struct surface {
    uint32_t object;          /* or NO_OBJECT */
    float point[3];           /* a little above the surface */
    float flat[3], normal[3]; /* of the triangle; for shading */
} surface;

static uint32_t object_of(const insert_scene *in, uint32_t triangle)
{
    uint32_t object = 0;
    while (in->objects[object].triangle_end <= triangle)
        object++;
    return object;
}

static void describe(const insert_scene *in, const mesh_hit *hit, const float dir[3], surface *out)
{
    const uint32_t *corner = in->triangles + 3 * (size_t)hit->triangle;
    const double weight[3] = {1 - (double)hit->u - (double)hit->v, (double)hit->u, (double)hit->v};
    double point[3] = {0, 0, 0}, normal[3] = {0, 0, 0}, flat[3];
    out->object = object_of(in, hit->triangle);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) {
            point[k] += weight[c] * (double)in->vertices[3 * (size_t)corner[c] + (size_t)k];
            normal[k] += weight[c] * in->normals[3 * (size_t)corner[c] + (size_t)k];
        }
    for (int k = 0; k < 3; k++)
        flat[k] = (double)hit->normal[k];
    if (!in->objects[out->object].smooth || !(dvec_dot(normal, flat) > 0))
        memcpy(normal, flat, sizeof normal);
    dvec_normalize(normal);
    const float side =
        dir[0] * hit->normal[0] + dir[1] * hit->normal[1] + dir[2] * hit->normal[2] > 0 ? -1 : 1;
    const double largest = fmax(fabs(point[0]), fmax(fabs(point[1]), fabs(point[2])));
    const double offset = fmax((double)in->offset_min, largest * (double)offset_share);
    for (int k = 0; k < 3; k++) {
        out->flat[k] = side * hit->normal[k];
        out->normal[k] = side * (float)normal[k];
        out->point[k] = (float)(point[k] + offset * (double)out->flat[k]);
    }
}

static int lamp_samples(const insert_scene *in)
{
    return in->lamp == INSERT_NO_LAMP                             ? 0
           : in->lamp == INSERT_LAMP_POINT && in->lamp_radius > 0 ? INSERT_LAMP_SAMPLES
                                                                  : 1;
}

/* Point `sample` of the disc that the lamp is seen as: a sunflower's spiral, turned by another angle for each
   ray. */
static void move_over_lamp(const insert_scene *in, int sample, size_t ray, const double dir[3],
                           double to_lamp[3])
{
    /* The golden angle: even over the disc (Vogel 1979). */
    const double golden = 2.399963229728653, turn = 6.283185307179586;
    const double angle = golden * sample + turn * (double)rng_uniform(LAMP_SEED, 0, ray);
    const double radius = in->lamp_radius * sqrt((sample + 0.5) / INSERT_LAMP_SAMPLES),
                 any[3] = {fabs(dir[0]) < 0.6, fabs(dir[0]) >= 0.6, 0};
    double right[3], up[3];
    dvec_cross(any, dir, right);
    dvec_normalize(right);
    dvec_cross(dir, right, up);
    for (int k = 0; k < 3; k++)
        to_lamp[k] += radius * (cos(angle) * right[k] + sin(angle) * up[k]);
}

/* From a point to sample `sample` of the lamp: unit direction, and how far it is. False for a point in the
   lamp itself. */
static bool towards_lamp(const insert_scene *in, const float point[3], int sample, size_t ray, float dir[3],
                         float *far)
{
    double d[3], length = INFINITY;
    memcpy(d, in->lamp_at, sizeof d);
    if (in->lamp == INSERT_LAMP_POINT) {
        for (int k = 0; k < 3; k++)
            d[k] -= (double)point[k];
        double unit[3] = {d[0], d[1], d[2]};
        dvec_normalize(unit);
        if (in->lamp_radius > 0)
            move_over_lamp(in, sample, ray, unit, d);
        length = dvec_length(d);
        dvec_normalize(d);
    }
    for (int k = 0; k < 3; k++)
        dir[k] = (float)d[k];
    *far = (float)length;
    return length > 0;
}

static void reflect(const surface *s, const float dir[3], float out[3])
{
    double d[3], flat[3], r[3], normal[3];
    for (int k = 0; k < 3; k++) {
        d[k] = (double)dir[k];
        flat[k] = (double)s->flat[k];
        normal[k] = (double)s->normal[k];
    }
    for (int attempt = 0; attempt < 2; attempt++) {
        const double along = 2 * dvec_dot(d, normal);
        for (int k = 0; k < 3; k++)
            r[k] = d[k] - along * normal[k];
        if (dvec_dot(r, flat) > 0)
            break;
        memcpy(normal, flat, sizeof normal); /* an interpolated normal may send the ray into the surface; the
                                                triangle's own does not */
    }
    dvec_normalize(r);
    for (int k = 0; k < 3; k++)
        out[k] = (float)r[k];
}

/* ---- one picture of rays ---- */

/* Arrays have a value per ray. */
typedef struct sight {
    const insert_scene *in;
    const ray_image *rays;
    int bounces; /* mirrors on the way here */
    surface *surface;
    float *far, *transmittance, *depth;
    image *rgb;
    float background[3];
    ray_image next; /* to the lamp, or mirrored; a zero direction where there is none */
    int sample;     /* of the lamp */
    float *lamp_transmittance,
        *lamp_light; /* of this sample; cosine times transmittance, summed over the samples so far */
    image next_rgb;
} sight;

static void find_surfaces(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++) {
        mesh_hit hit;
        const float *dir = s->rays->dir + 3 * i;
        const float t_max = s->rays->far != NULL ? s->rays->far[i] : INFINITY;
        const bool found = mesh_tree_trace(s->in->tree, ray_image_origin(s->rays, i), dir, 0, t_max, &hit);
        s->far[i] = found ? hit.t : t_max;
        s->surface[i].object = NO_OBJECT;
        if (found)
            describe(s->in, &hit, dir, &s->surface[i]);
    }
}

/* Gaussians carry the light of the day they were photographed in; what a surface takes of it is taken here,
   for the whole ray at once, at the mean depth of what it meets. */
static void shadow_gaussians(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    const int samples = lamp_samples(s->in);
    for (size_t i = begin; i < end; i++) {
        float point[3], dir[3], far;
        int blocked = 0;
        for (size_t k = 0; k < 3; k++)
            point[k] = ray_image_origin(s->rays, i)[k] + s->depth[i] * s->rays->dir[3 * i + k];
        for (int sample = 0; sample < samples && s->depth[i] > 0; sample++)
            blocked += towards_lamp(s->in, point, sample, i, dir, &far) &&
                       mesh_tree_blocked(s->in->tree, point, dir, 0, far);
        const float light = 1 - (1 - s->in->ambient) * (float)blocked / (float)samples;
        for (size_t k = 0; k < 3; k++)
            s->rgb->pixels[3 * i + k] *= light;
    }
}

static bool is_mirror(const sight *s, size_t i)
{
    return s->surface[i].object != NO_OBJECT && s->bounces < BOUNCES_MAX &&
           s->in->objects[s->surface[i].object].material == INSERT_MIRROR;
}

static bool is_matt(const sight *s, size_t i)
{
    return s->surface[i].object != NO_OBJECT && !is_mirror(s, i);
}

static void no_ray(ray_image *rays, size_t i)
{
    for (size_t k = 0; k < 3; k++)
        rays->dir[3 * i + k] = rays->origin[3 * i + k] = 0;
    rays->far[i] = INFINITY;
}

static void mirror_rays(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++) {
        no_ray(&s->next, i);
        if (!is_mirror(s, i))
            continue;
        reflect(&s->surface[i], s->rays->dir + 3 * i, s->next.dir + 3 * i);
        memcpy(s->next.origin + 3 * i, s->surface[i].point, sizeof s->surface[i].point);
    }
}

/* The ray to sample s->sample of the lamp, for each matt surface that the lamp is in front of, with no
   surface between them. */
static void lamp_rays(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++) {
        float *dir = s->next.dir + 3 * i;
        const surface *at = &s->surface[i];
        const bool lamp = is_matt(s, i) && towards_lamp(s->in, at->point, s->sample, i, dir, &s->next.far[i]);
        const bool in_front = lamp && dir[0] * at->flat[0] + dir[1] * at->flat[1] + dir[2] * at->flat[2] > 0;
        if (in_front && !mesh_tree_blocked(s->in->tree, at->point, dir, 0, s->next.far[i]))
            memcpy(s->next.origin + 3 * i, at->point, sizeof at->point);
        else
            no_ray(&s->next, i);
    }
}

static void add_lamp(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++) {
        const float *n = s->surface[i].normal, *d = s->next.dir + 3 * i; /* zero for a surface in shadow */
        if (is_matt(s, i))
            s->lamp_light[i] += fmaxf(0, n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) * s->lamp_transmittance[i];
    }
}

static void add_light(const sight *s, size_t i, const float light[3])
{
    for (size_t k = 0; k < 3; k++)
        s->rgb->pixels[3 * i + k] = fmaf(s->transmittance[i], light[k], s->rgb->pixels[3 * i + k]);
}

static void add_mirrored(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++) {
        if (!is_mirror(s, i))
            continue;
        const float *color = s->in->objects[s->surface[i].object].color, *seen = s->next_rgb.pixels + 3 * i;
        add_light(s, i, (const float[3]){color[0] * seen[0], color[1] * seen[1], color[2] * seen[2]});
    }
}

static void add_matt(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++) {
        if (!is_matt(s, i))
            continue;
        const float *color = s->in->objects[s->surface[i].object].color;
        const int samples = lamp_samples(s->in);
        const float light =
            s->in->ambient + (samples > 0 ? (1 - s->in->ambient) * s->lamp_light[i] / (float)samples : 0);
        add_light(s, i, (const float[3]){color[0] * light, color[1] * light, color[2] * light});
    }
}

static void add_background(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    sight *s = context;
    for (size_t i = begin; i < end; i++)
        if (s->surface[i].object == NO_OBJECT)
            add_light(s, i, s->background);
}

static gbt_status allocate(sight *s, gbt_error *err)
{
    const size_t count = ray_image_count(s->rays);
    s->surface = mem_alloc(count, sizeof *s->surface, "surfaces", err);
    s->far = mem_alloc(count, sizeof *s->far, "surfaces", err);
    s->transmittance = mem_alloc(count, sizeof *s->transmittance, "surfaces", err);
    s->depth = mem_alloc(count, sizeof *s->depth, "surfaces", err);
    if (s->surface == NULL || s->far == NULL || s->transmittance == NULL || s->depth == NULL)
        return GBT_ERR_NO_MEMORY;
    return GBT_OK;
}

static gbt_status allocate_next(sight *s, gbt_error *err)
{
    const size_t count = ray_image_count(s->rays);
    GBT_TRY(ray_image_reserve(&s->next, s->rays->width, s->rays->height, false, err));
    s->next.far = mem_alloc(count, sizeof *s->next.far, "surfaces", err);
    s->lamp_light = mem_calloc(count, sizeof *s->lamp_light, "surfaces", err);
    s->lamp_transmittance = mem_alloc(count, sizeof *s->lamp_transmittance, "surfaces", err);
    if (s->next.far == NULL || s->lamp_light == NULL || s->lamp_transmittance == NULL)
        return GBT_ERR_NO_MEMORY;
    return image_alloc(&s->next_rgb, s->rays->width, s->rays->height, 3, err);
}

static void release(sight *s)
{
    mem_free(s->surface);
    mem_free(s->far);
    mem_free(s->transmittance);
    mem_free(s->depth);
    mem_free(s->lamp_light);
    mem_free(s->lamp_transmittance);
    ray_image_free(&s->next);
    image_free(&s->next_rgb);
}

static gbt_status see(sight *s, trace_scene *scene, gbt_error *err);

static gbt_status see_mirrored(sight *s, trace_scene *scene, gbt_error *err)
{
    sight mirrored = {.in = s->in, .rays = &s->next, .bounces = s->bounces + 1, .rgb = &s->next_rgb};
    memcpy(mirrored.background, s->background, sizeof mirrored.background);
    const gbt_status status = see(&mirrored, scene, err);
    release(&mirrored);
    return status;
}

static gbt_status see_surfaces(sight *s, trace_scene *scene, gbt_error *err)
{
    const size_t count = ray_image_count(s->rays);
    size_t matt_count = 0, mirror_count = 0;
    for (size_t i = 0; i < count; i++) {
        matt_count += is_matt(s, i);
        mirror_count += is_mirror(s, i);
    }
    if (matt_count + mirror_count > 0)
        GBT_TRY(allocate_next(s, err));
    if (mirror_count > 0) {
        parallel_blocks(count, RAY_BLOCK, mirror_rays, s);
        GBT_TRY(see_mirrored(s, scene, err));
        parallel_blocks(count, RAY_BLOCK, add_mirrored, s);
    }
    for (s->sample = 0; matt_count > 0 && s->sample < lamp_samples(s->in); s->sample++) {
        parallel_blocks(count, RAY_BLOCK, lamp_rays, s);
        GBT_TRY(trace_forward(scene, &s->next, false,
                              &(trace_outputs){.rgb = &s->next_rgb, .transmittance = s->lamp_transmittance},
                              NULL, err));
        parallel_blocks(count, RAY_BLOCK, add_lamp, s);
    }
    if (matt_count > 0)
        parallel_blocks(count, RAY_BLOCK, add_matt, s);
    return GBT_OK;
}

static gbt_status see(sight *s, trace_scene *scene, gbt_error *err)
{
    const float near = scene->settings.t_near;
    const size_t count = ray_image_count(s->rays);
    GBT_TRY(allocate(s, err));
    parallel_blocks(count, RAY_BLOCK, find_surfaces, s);
    ray_image ended = *s->rays; /* the same rays; only their ends are ours */
    ended.far = s->far;
    GBT_TRY(trace_forward(
        scene, &ended, false,
        &(trace_outputs){.rgb = s->rgb, .transmittance = s->transmittance, .depth = s->depth}, NULL, err));
    if (s->in->lamp != INSERT_NO_LAMP)
        parallel_blocks(count, RAY_BLOCK, shadow_gaussians, s);
    if (s->bounces == 0)
        scene->settings.t_near *= surface_near_share;
    const gbt_status status = see_surfaces(s, scene, err);
    scene->settings.t_near = near;
    GBT_TRY(status);
    parallel_blocks(count, RAY_BLOCK, add_background, s);
    return GBT_OK;
}

gbt_status insert_trace(void *context, trace_scene *scene, const ray_image *rays, image *rgb, gbt_error *err)
{
    sight s = {.in = context, .rays = rays, .rgb = rgb};
    /* A surface hides the background, so it is not added before that is known. */
    memcpy(s.background, scene->settings.background, sizeof s.background);
    memset(scene->settings.background, 0, sizeof scene->settings.background);
    const gbt_status status = see(&s, scene, err);
    memcpy(scene->settings.background, s.background, sizeof s.background);
    release(&s);
    return status;
}
