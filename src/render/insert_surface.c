/* SPDX-License-Identifier: Apache-2.0 */
/* render/insert_surface.c -- the surface that a ray meets, and the shadow rays and reflected rays that leave
   it. */
#include "render/insert_surface.h"

#include <math.h>
#include <string.h>

#include "base/rng.h"
#include "base/vec.h"

enum { LAMP_SEED = 1 };

static uint32_t object_of(const insert_scene *in, uint32_t triangle)
{
    uint32_t object = 0;
    while (in->objects[object].triangle_end <= triangle)
        object++;
    return object;
}

void insert_surface_at(const insert_scene *in, const mesh_hit *hit, const float dir[3], insert_surface *out)
{
    const uint32_t *corner = in->triangles + 3 * (size_t)hit->triangle;
    const double weight[3] = {1 - hit->u - hit->v, hit->u, hit->v};
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
    const double offset = fmax((double)in->offset_min, largest * (double)INSERT_OFFSET_SHARE);
    for (int k = 0; k < 3; k++) {
        out->flat[k] = side * hit->normal[k];
        out->normal[k] = side * (float)normal[k];
        out->point[k] = (float)(point[k] + offset * (double)out->flat[k]);
    }
}

int insert_lamp_samples(const insert_scene *in)
{
    return in->lamp == INSERT_NO_LAMP                             ? 0
           : in->lamp == INSERT_LAMP_POINT && in->lamp_radius > 0 ? INSERT_LAMP_SAMPLES
                                                                  : 1;
}

/* Move the target to point `sample` of the disc as which the lamp is seen: a sunflower spiral (Vogel 1979),
   which covers the disc evenly, rotated by a random angle per ray. */
static void move_over_lamp(const insert_scene *in, int sample, size_t ray, const double dir[3],
                           double to_lamp[3])
{
    const double angle = GOLDEN_ANGLE * sample + 2 * PI * (double)rng_uniform(LAMP_SEED, 0, ray);
    const double radius = in->lamp_radius * sqrt((sample + 0.5) / INSERT_LAMP_SAMPLES),
                 any[3] = {fabs(dir[0]) < 0.6, fabs(dir[0]) >= 0.6, 0};
    double right[3], up[3];
    dvec_cross(any, dir, right);
    dvec_normalize(right);
    dvec_cross(dir, right, up);
    for (int k = 0; k < 3; k++)
        to_lamp[k] += radius * (cos(angle) * right[k] + sin(angle) * up[k]);
}

bool insert_towards_lamp(const insert_scene *in, const float point[3], int sample, size_t ray, float dir[3],
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

void insert_reflect(const insert_surface *s, const float dir[3], float out[3])
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
        memcpy(normal, flat, sizeof normal); /* with an interpolated normal the reflected ray may point into
                                                the surface; with the triangle's own normal it cannot */
    }
    dvec_normalize(r);
    for (int k = 0; k < 3; k++)
        out[k] = (float)r[k];
}
