/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/world.c -- traces rays in a world, and computes light and colours. Shapes are in shapes.c. */
#include "scenes/world.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"

static const float pi = 3.14159265359f;

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void normalize(float a[3])
{
    const float length = sqrtf(dot(a, a));
    if (length > 0) {
        a[0] /= length;
        a[1] /= length;
        a[2] /= length;
    }
}

/** Two unit vectors that complete the unit vector n to a right-handed frame. */
static void frame(const float n[3], float a[3], float b[3])
{
    const float least[3] = {fabsf(n[0]) < 0.6f, fabsf(n[0]) < 0.6f ? 0.0f : 1.0f, 0};
    const float along = dot(least, n);
    for (int k = 0; k < 3; k++)
        a[k] = least[k] - along * n[k];
    normalize(a);
    b[0] = n[1] * a[2] - n[2] * a[1];
    b[1] = n[2] * a[0] - n[0] * a[2];
    b[2] = n[0] * a[1] - n[1] * a[0];
}

bool world_trace(const world *w, const float origin[3], const float dir[3], surface *out)
{
    mesh_hit hit;
    if (!mesh_tree_trace(w->tree, origin, dir, INFINITY, &hit))
        return false;
    const uint32_t *vertex = w->triangle + 3 * (size_t)hit.triangle;
    const double u = fmin(fmax(hit.u, 0), 1), v = fmin(fmax(hit.v, 0), 1 - u);
    const float second = (float)u, third = (float)v, weight[3] = {1 - second - third, second, third};
    memset(out, 0, sizeof *out);
    for (int corner = 0; corner < 3; corner++) {
        for (int k = 0; k < 3; k++) {
            out->normal[k] += weight[corner] * w->normal[3 * (size_t)vertex[corner] + (size_t)k];
            if (w->indirect != NULL)
                out->indirect[k] += weight[corner] * w->indirect[3 * (size_t)vertex[corner] + (size_t)k];
        }
        for (int k = 0; k < 2; k++)
            out->uv[k] += weight[corner] * w->uv[2 * (size_t)vertex[corner] + (size_t)k];
    }
    normalize(out->normal);
    memcpy(out->geometric, hit.normal, sizeof out->geometric);
    normalize(out->geometric);
    if (dot(out->geometric, dir) > 0)
        for (int k = 0; k < 3; k++)
            out->geometric[k] = -out->geometric[k];
    /* Shapes have outward normals, whatever the winding of their triangles. */
    out->is_back = dot(out->normal, out->geometric) < 0;
    if (out->is_back)
        for (int k = 0; k < 3; k++)
            out->normal[k] = -out->normal[k];
    for (int k = 0; k < 3; k++)
        out->position[k] = origin[k] + hit.t * dir[k];
    out->distance = hit.t;
    out->material = w->material[hit.triangle];
    out->variant = w->variant[hit.triangle];
    return true;
}

static void sky_radiance(const world *w, const float dir[3], float out[3])
{
    const float t = dir[2] < 0 ? 0 : dir[2];
    for (int k = 0; k < 3; k++)
        out[k] = w->lamp.sky_low[k] + t * (w->lamp.sky_high[k] - w->lamp.sky_low[k]);
}

/**
 * Light of the lamp that arrives at a point, times the cosine to its normal; 0 in shadow.
 *
 * @param to_lamp [out] unit direction to the sampled point of the lamp
 */
static bool lamp_light(const world *w, const surface *s, const float jitter[2], float to_lamp[3],
                       float irradiance[3])
{
    const light *lamp = &w->lamp;
    const float angle = 2 * pi * jitter[0], r = lamp->radius * sqrtf(jitter[1]);
    float aim[3], a[3], b[3], distance, falloff = 1;
    for (int k = 0; k < 3; k++)
        aim[k] = lamp->is_sun ? lamp->position[k] : lamp->position[k] - s->position[k];
    float unit[3] = {aim[0], aim[1], aim[2]};
    normalize(unit);
    frame(unit, a, b);
    for (int k = 0; k < 3; k++)
        to_lamp[k] = aim[k] + r * (cosf(angle) * a[k] + sinf(angle) * b[k]);
    const float length = sqrtf(dot(to_lamp, to_lamp));
    normalize(to_lamp);
    if (lamp->is_sun) {
        /* 0.97: the dome is a polyhedron inside its sphere. What stands outside is lit. */
        const float along = dot(s->position, to_lamp), inside = 0.97f * lamp->dome;
        const float square = along * along - dot(s->position, s->position) + inside * inside;
        distance = square > 0 ? sqrtf(square) - along : 0;
    } else {
        distance = length;
        falloff = 1 / (distance * distance);
    }
    const float cosine = dot(s->normal, to_lamp);
    if (cosine <= 0 || dot(s->geometric, to_lamp) <= 0)
        return false;
    float start[3];
    for (int k = 0; k < 3; k++)
        start[k] = s->position[k] + w->epsilon * s->geometric[k];
    if (distance > 2 * w->epsilon && mesh_tree_blocked(w->tree, start, to_lamp, distance - 2 * w->epsilon))
        return false;
    for (int k = 0; k < 3; k++)
        irradiance[k] = falloff * cosine * lamp->color[k];
    return true;
}

/** Radiance of a surface towards -dir. Mirror reflections are only followed if `depth` is 0. */
static void radiance(const world *w, const surface *s, const float dir[3], const float jitter[2], int depth,
                     float out[3])
{
    look l = {.shininess = 1};
    w->look(s, &l);
    float to_lamp[3], direct[3] = {0};
    const bool is_lit = lamp_light(w, s, jitter, to_lamp, direct);
    float half_way[3] = {0}, gloss = 0;
    if (is_lit && l.specular > 0) {
        for (int k = 0; k < 3; k++)
            half_way[k] = to_lamp[k] - dir[k];
        normalize(half_way);
        const float cosine = dot(half_way, s->normal);
        /* Blinn-Phong, scaled to keep its energy: (n + 8) / (8 pi), and pi because light units fold it in. */
        gloss = cosine > 0 ? l.specular * (l.shininess + 8) / 8 * powf(cosine, l.shininess) : 0;
    }
    for (int k = 0; k < 3; k++)
        out[k] = l.emission[k] + l.albedo[k] * (direct[k] + s->indirect[k]) + gloss * direct[k];
    if (!l.mirror || depth > 0)
        return;
    const float facing = -dot(dir, s->normal);
    const float grazing = 1 - (facing < 0 ? 0 : facing);
    const float fresnel = l.specular + (1 - l.specular) * grazing * grazing * grazing * grazing * grazing;
    float a[3], b[3], mirrored[3], start[3], seen[3];
    for (int k = 0; k < 3; k++)
        mirrored[k] = dir[k] + 2 * facing * s->normal[k];
    frame(mirrored, a, b);
    const float r = l.roughness * sqrtf(jitter[1]), angle = 2 * pi * jitter[0];
    for (int k = 0; k < 3; k++)
        mirrored[k] += r * (cosf(angle) * a[k] + sinf(angle) * b[k]);
    normalize(mirrored);
    if (dot(mirrored, s->geometric) <= 0)
        return;
    for (int k = 0; k < 3; k++)
        start[k] = s->position[k] + w->epsilon * s->geometric[k];
    surface other;
    if (world_trace(w, start, mirrored, &other))
        radiance(w, &other, mirrored, jitter, 1, seen);
    else
        sky_radiance(w, mirrored, seen);
    for (int k = 0; k < 3; k++)
        out[k] = (1 - fresnel) * out[k] + fresnel * seen[k];
}

/** Radiance to display: a soft shoulder, so that highlights keep their colour, then gamma 2.2. */
static void display(const world *w, float rgb[3])
{
    for (int k = 0; k < 3; k++) {
        const float soft = 1 - expf(-w->lamp.exposure * (rgb[k] > 0 ? rgb[k] : 0));
        rgb[k] = powf(soft, 1 / 2.2f);
    }
}

void world_shade(const world *w, const surface *s, const float dir[3], const float jitter[2], float rgb[3])
{
    radiance(w, s, dir, jitter, 0, rgb);
    display(w, rgb);
}

void world_sky(const world *w, const float dir[3], float rgb[3])
{
    sky_radiance(w, dir, rgb);
    display(w, rgb);
}

/* One bounce of indirect light is computed. Later bounces are approximated by this fraction of the sky's
   light without any occlusion. */
static const float later_bounces = 0.14f;

typedef struct bake {
    const world *w;
    float *indirect;
    unsigned char *is_buried; /* [vertex_count]: the vertex is inside a solid, so the light gathered there is
                                 meaningless */
    int rays;
} bake;

/** Van der Corput sequence in base 2: with i / n it makes the Hammersley set. */
static float reversed_bits(uint32_t i)
{
    uint32_t r = 0;
    for (int bit = 0; bit < 32; bit++)
        r |= (i >> bit & 1u) << (31 - bit);
    return (float)(r >> 8) * 0x1p-24f;
}

static void bake_vertices(size_t block, size_t begin, size_t end, void *context)
{
    (void)block;
    const bake *job = context;
    const world *w = job->w;
    for (size_t i = begin; i < end; i++) {
        const float *n = w->normal + 3 * i;
        float a[3], b[3], start[3], sum[3] = {0};
        int inside = 0;
        frame(n, a, b);
        for (int k = 0; k < 3; k++)
            start[k] = w->position[3 * i + (size_t)k] + 4 * w->epsilon * n[k];
        for (int ray = 0; ray < job->rays; ray++) {
            /* Cosine-distributed directions have equal weights. All vertices use the same directions, so
               there is no noise between neighbours. */
            const float u = ((float)ray + 0.5f) / (float)job->rays,
                        angle = 2 * pi * reversed_bits((uint32_t)ray);
            const float r = sqrtf(u), up = sqrtf(1 - u);
            float dir[3], seen[3] = {0}, to_lamp[3], direct[3] = {0};
            for (int k = 0; k < 3; k++)
                dir[k] = r * (cosf(angle) * a[k] + sinf(angle) * b[k]) + up * n[k];
            surface s;
            if (!world_trace(w, start, dir, &s)) {
                sky_radiance(w, dir, seen);
            } else {
                static const float center[2] = {0, 0};
                look l = {.shininess = 1};
                w->look(&s, &l);
                /* The inside of a solid gives no light; the inside of the sky dome does. */
                if (!s.is_back)
                    lamp_light(w, &s, center, to_lamp, direct);
                inside += s.is_back && l.emission[2] <= 0;
                for (int k = 0; k < 3; k++)
                    seen[k] =
                        l.emission[k] +
                        (s.is_back ? 0 : l.albedo[k] * (direct[k] + later_bounces * w->lamp.sky_high[k]));
            }
            for (int k = 0; k < 3; k++)
                sum[k] += seen[k];
        }
        for (int k = 0; k < 3; k++)
            job->indirect[3 * i + (size_t)k] = sum[k] / (float)job->rays;
        job->is_buried[i] = 2 * inside > job->rays;
    }
}

/** Give vertices inside a solid the mean light of their neighbours, starting at the edge, so that partly
    covered triangles are shaded evenly. */
static void spread_light(const bake *job, float *sum, uint32_t *count)
{
    const world *w = job->w;
    for (int pass = 0; pass < 8; pass++) {
        memset(sum, 0, 3 * w->vertex_count * sizeof *sum);
        memset(count, 0, w->vertex_count * sizeof *count);
        for (size_t t = 0; t < w->triangle_count; t++)
            for (int corner = 0; corner < 3; corner++) {
                const size_t to = w->triangle[3 * t + (size_t)corner];
                for (int step = 1; step < 3 && job->is_buried[to] != 0; step++) {
                    const size_t from = w->triangle[3 * t + (size_t)((corner + step) % 3)];
                    if (job->is_buried[from] != 0)
                        continue;
                    for (size_t k = 0; k < 3; k++)
                        sum[3 * to + k] += job->indirect[3 * from + k];
                    count[to]++;
                }
            }
        for (size_t i = 0; i < w->vertex_count; i++) {
            if (count[i] == 0)
                continue;
            for (size_t k = 0; k < 3; k++)
                job->indirect[3 * i + k] = sum[3 * i + k] / (float)count[i];
            job->is_buried[i] = 0;
        }
    }
}

gbt_status world_finish(world *w, int rays)
{
    if (w->status != GBT_OK)
        return w->status;
    w->status =
        mesh_tree_build(w->position, w->vertex_count, w->triangle, w->triangle_count, &w->tree, w->err);
    if (w->status != GBT_OK)
        return w->status;
    bake job = {.w = w, .rays = rays};
    job.indirect = mem_alloc(w->vertex_count, 3 * sizeof *job.indirect, "scene light", w->err);
    job.is_buried = mem_alloc(w->vertex_count, 1, "scene light", w->err);
    float *sum = mem_alloc(w->vertex_count, 3 * sizeof *sum, "scene light", w->err);
    uint32_t *count = mem_alloc(w->vertex_count, sizeof *count, "scene light", w->err);
    if (job.indirect == NULL || job.is_buried == NULL || sum == NULL || count == NULL) {
        mem_free(job.indirect);
        w->status = GBT_ERR_NO_MEMORY;
    } else {
        parallel_blocks(w->vertex_count, 64, bake_vertices, &job);
        spread_light(&job, sum, count);
        /* Set only now, because gathering must not use partial results. */
        w->indirect = job.indirect;
    }
    mem_free(job.is_buried);
    mem_free(sum);
    mem_free(count);
    return w->status;
}

void world_free(world *w)
{
    mem_free(w->position);
    mem_free(w->normal);
    mem_free(w->uv);
    mem_free(w->indirect);
    mem_free(w->triangle);
    mem_free(w->material);
    mem_free(w->variant);
    mesh_tree_free(w->tree);
    memset(w, 0, sizeof *w);
}
