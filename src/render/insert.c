/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert.c -- render rays among Gaussians and inserted meshes (docs/inserting.md).

   rays --> [nearest surface] --> trace the Gaussians in front of it
        --> darken them where a mesh blocks the light
                  |
                  +--> matt surface: a shadow ray to the lamp, through meshes and Gaussians
                  +--> mirror: the reflected ray, rendered in the same way

   After BOUNCES_MAX mirrors the next mirror counts as matt. All steps run over whole images of rays, so that
   the tracer can work on packets. */
#include "render/insert_surface.h"

#include <string.h>

#include "base/fail.h"
#include "base/memory.h"
#include "base/parallel.h"

enum { RAY_BLOCK = 512, BOUNCES_MAX = 4 };

/* Secondary rays see Gaussians from this share of the near distance on. The near distance keeps the space in
   front of the photos' cameras free, which does not apply to surfaces. */
static const float surface_near_share = 0.1f;

/* One level of recursion. Arrays have one element per ray. */
typedef struct surface_pass {
    const insert_scene *in;
    const ray_image *rays;
    int bounces; /* mirrors on the way from the camera */
    insert_surface *surface;
    float *far, *transmittance, *depth;
    image *rgb;
    float background[3];
    sky sky;
    ray_image next; /* secondary rays: shadow rays or reflected ones; direction 0 for pixels without one */
    int sample;     /* of the lamp: index of the current one */
    float *lamp_transmittance, *lamp_light; /* lamp_transmittance: of the current sample; lamp_light: cosine
                                               times transmittance, summed over the samples so far */
    image next_rgb;
} surface_pass;

static void find_surfaces(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    surface_pass *s = context;
    for (size_t i = begin; i < end; i++) {
        mesh_hit hit;
        const float *dir = s->rays->dir + 3 * i;
        const float t_max = s->rays->far != NULL ? s->rays->far[i] : INFINITY;
        const bool found = mesh_tree_trace(s->in->tree, ray_image_origin(s->rays, i), dir, t_max, &hit);
        s->far[i] = found ? hit.t : t_max;
        s->surface[i].object = NO_OBJECT;
        if (found)
            insert_surface_at(s->in, &hit, dir, &s->surface[i]);
    }
}

/* Gaussians have the light of the photos baked in. Shadows that meshes cast on them are computed once per
   ray, at the mean depth of the Gaussians that it crosses. */
static void shadow_gaussians(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    surface_pass *s = context;
    const int samples = insert_lamp_samples(s->in);
    for (size_t i = begin; i < end; i++) {
        float point[3], dir[3], far;
        int blocked = 0;
        for (size_t k = 0; k < 3; k++)
            point[k] = ray_image_origin(s->rays, i)[k] + s->depth[i] * s->rays->dir[3 * i + k];
        for (int sample = 0; sample < samples && s->depth[i] > 0; sample++)
            blocked += insert_towards_lamp(s->in, point, sample, i, dir, &far) &&
                       mesh_tree_blocked(s->in->tree, point, dir, far);
        const float light = 1 - (1 - s->in->ambient) * (float)blocked / (float)samples;
        for (size_t k = 0; k < 3; k++)
            s->rgb->pixels[3 * i + k] *= light;
    }
}

static bool is_mirror(const surface_pass *s, size_t i)
{
    return s->surface[i].object != NO_OBJECT && s->bounces < BOUNCES_MAX &&
           s->in->objects[s->surface[i].object].material == INSERT_MIRROR;
}

static bool is_matt(const surface_pass *s, size_t i)
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
    surface_pass *s = context;
    for (size_t i = begin; i < end; i++) {
        no_ray(&s->next, i);
        if (!is_mirror(s, i))
            continue;
        insert_reflect(&s->surface[i], s->rays->dir + 3 * i, s->next.dir + 3 * i);
        memcpy(s->next.origin + 3 * i, s->surface[i].point, sizeof s->surface[i].point);
    }
}

/* Shadow rays to sample s->sample of the lamp, for matt surfaces that face the lamp and have no mesh in
   between. */
static void lamp_rays(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    surface_pass *s = context;
    for (size_t i = begin; i < end; i++) {
        float *dir = s->next.dir + 3 * i;
        const insert_surface *at = &s->surface[i];
        const bool lamp =
            is_matt(s, i) && insert_towards_lamp(s->in, at->point, s->sample, i, dir, &s->next.far[i]);
        const bool in_front = lamp && dir[0] * at->flat[0] + dir[1] * at->flat[1] + dir[2] * at->flat[2] > 0;
        if (in_front && !mesh_tree_blocked(s->in->tree, at->point, dir, s->next.far[i]))
            memcpy(s->next.origin + 3 * i, at->point, sizeof at->point);
        else
            no_ray(&s->next, i);
    }
}

static void add_lamp(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    surface_pass *s = context;
    for (size_t i = begin; i < end; i++) {
        const float *n = s->surface[i].normal, *d = s->next.dir + 3 * i; /* d is 0 for a surface in shadow */
        if (is_matt(s, i))
            s->lamp_light[i] += fmaxf(0, n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) * s->lamp_transmittance[i];
    }
}

static void add_light(const surface_pass *s, size_t i, const float light[3])
{
    for (size_t k = 0; k < 3; k++)
        s->rgb->pixels[3 * i + k] = fmaf(s->transmittance[i], light[k], s->rgb->pixels[3 * i + k]);
}

static void add_mirrored(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    surface_pass *s = context;
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
    surface_pass *s = context;
    for (size_t i = begin; i < end; i++) {
        if (!is_matt(s, i))
            continue;
        const float *color = s->in->objects[s->surface[i].object].color;
        const int samples = insert_lamp_samples(s->in);
        const float light =
            s->in->ambient + (samples > 0 ? (1 - s->in->ambient) * s->lamp_light[i] / (float)samples : 0);
        add_light(s, i, (const float[3]){color[0] * light, color[1] * light, color[2] * light});
    }
}

static void add_background(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    surface_pass *s = context;
    for (size_t i = begin; i < end; i++)
        if (s->surface[i].object == NO_OBJECT) {
            float behind[3];
            sky_color(&s->sky, s->background, s->rays->dir + 3 * i, behind);
            add_light(s, i, behind);
        }
}

static gbt_status allocate(surface_pass *s, gbt_error *err)
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

static gbt_status allocate_next(surface_pass *s, gbt_error *err)
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

static void release(surface_pass *s)
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

static gbt_status shade(surface_pass *s, trace_scene *scene, gbt_error *err);

static gbt_status shade_mirrored(surface_pass *s, trace_scene *scene, gbt_error *err)
{
    surface_pass mirrored = {.in = s->in, .rays = &s->next, .bounces = s->bounces + 1, .rgb = &s->next_rgb};
    memcpy(mirrored.background, s->background, sizeof mirrored.background);
    mirrored.sky = s->sky;
    const gbt_status status = shade(&mirrored, scene, err);
    release(&mirrored);
    return status;
}

static gbt_status shade_surfaces(surface_pass *s, trace_scene *scene, gbt_error *err)
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
        GBT_TRY(shade_mirrored(s, scene, err));
        parallel_blocks(count, RAY_BLOCK, add_mirrored, s);
    }
    for (s->sample = 0; matt_count > 0 && s->sample < insert_lamp_samples(s->in); s->sample++) {
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

static gbt_status shade(surface_pass *s, trace_scene *scene, gbt_error *err)
{
    const float near = scene->settings.t_near;
    const size_t count = ray_image_count(s->rays);
    GBT_TRY(allocate(s, err));
    parallel_blocks(count, RAY_BLOCK, find_surfaces, s);
    ray_image ended = *s->rays; /* a view of the same rays, with the surfaces as their ends */
    ended.far = s->far;
    GBT_TRY(trace_forward(
        scene, &ended, false,
        &(trace_outputs){.rgb = s->rgb, .transmittance = s->transmittance, .depth = s->depth}, NULL, err));
    if (s->in->lamp != INSERT_NO_LAMP)
        parallel_blocks(count, RAY_BLOCK, shadow_gaussians, s);
    if (s->bounces == 0)
        scene->settings.t_near *= surface_near_share;
    const gbt_status status = shade_surfaces(s, scene, err);
    scene->settings.t_near = near;
    GBT_TRY(status);
    parallel_blocks(count, RAY_BLOCK, add_background, s);
    return GBT_OK;
}

gbt_status insert_trace(void *context, trace_scene *scene, const ray_image *rays, image *rgb, gbt_error *err)
{
    surface_pass s = {.in = context, .rays = rays, .rgb = rgb};
    /* The tracer must not add the background, which a surface may hide; add_background() adds it where it is
     * seen. */
    memcpy(s.background, scene->settings.background, sizeof s.background);
    memset(scene->settings.background, 0, sizeof scene->settings.background);
    s.sky = scene->settings.sky;
    scene->settings.sky.varies = false;
    const gbt_status status = shade(&s, scene, err);
    memcpy(scene->settings.background, s.background, sizeof s.background);
    scene->settings.sky = s.sky;
    release(&s);
    return status;
}
