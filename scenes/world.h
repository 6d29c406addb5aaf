/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/world.h -- triangles with materials, the shapes they are made of, and the light that falls on them.

   A scene file builds a world with the shape functions, numbers its materials, and provides a function `look`
   that gives the colour of a surface point. z is up. The first failure is kept in world.status and makes all
   later calls do nothing, so that a scene can be written as a plain list of shapes. */
#ifndef GBT_SCENES_WORLD_H
#define GBT_SCENES_WORLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bvh/mesh.h"
#include "gbtrace/status.h"

/** A point of a surface, before its colour is determined. */
typedef struct surface {
    float position[3];
    float normal[3];    /* shading normal, unit, on the viewer's side */
    float geometric[3]; /* the triangle's normal, unit, on the viewer's side */
    float uv[2];        /* texture coordinates, defined by each shape */
    float indirect[3];  /* light from everything but the lamp, as baked */
    float distance;     /* along the ray */
    bool is_back;       /* seen from the inside of a closed shape */
    int material;
    int variant; /* distinguishes shapes of the same material */
} surface;

/** The colour of a surface. Light units: 1 is a white surface in full light. */
typedef struct look {
    float albedo[3];
    float emission[3]; /* of sky and windows: added, not affected by lighting */
    float specular;  /* reflectance at normal incidence, [0, 1]; increases towards grazing angles (Schlick) */
    float shininess; /* Blinn-Phong exponent of the highlight, >= 1 */
    float roughness; /* spread of the mirror ray, which is traced only where `mirror` is set */
    bool mirror;
} look;

typedef void look_fn(const surface *s, look *out);

typedef struct light {
    float position[3]; /* of the lamp's centre, or the unit direction towards the sun */
    float radius;      /* of the lamp, scene units; of the sun, tangent of its angular radius */
    float color[3]; /* irradiance on a surface that faces it: at distance 1 for a lamp, anywhere for the sun
                     */
    float dome; /* with a sun: radius of the sky dome around the origin; shadow rays end before they reach it
                 */
    bool is_sun;
    float sky_low[3], sky_high[3]; /* what a ray that leaves the scene sees, at the horizon and overhead */
    float exposure;
} light;

typedef struct world {
    size_t vertex_count, triangle_count;
    float *position;    /* [vertex_count][3] */
    float *normal;      /* [vertex_count][3], unit, outward */
    float *uv;          /* [vertex_count][2] */
    float *indirect;    /* [vertex_count][3]; light from everything but the lamp; NULL until world_finish() */
    uint32_t *triangle; /* [triangle_count][3] */
    uint16_t *material; /* [triangle_count] */
    uint16_t *variant;  /* [triangle_count] */
    mesh_tree *tree;    /* NULL until world_finish() */
    light lamp;
    look_fn *look;
    float epsilon;  /* offset of secondary rays from their surface */
    float place[4]; /* position of the following shapes: x, y, z, rotation about z in radians */
    size_t capacity[6];
    gbt_status status;
    gbt_error *err;
} world;

/** Place the following shapes at (x, y, z), rotated about z. */
void world_place(world *w, float x, float y, float z, float turn_rad);

/** Parallelogram corner + a*[0,1] + b*[0,1], facing a x b, divided into x_cells * y_cells cells; uv are
    lengths from its centre. */
void world_sheet(world *w, int material, int variant, const float corner[3], const float a[3],
                 const float b[3], float cell);

/** Box with sides parallel to the axes; each face is a sheet. `cell` is the largest edge of a cell. */
void world_box(world *w, int material, int variant, const float center[3], const float half[3], float cell);

/**
 * Surface of revolution about z.
 *
 * @param profile [count][2]: radius and height; outside is on the right when walking along it; a repeated
 *                point makes a sharp edge
 *
 * uv: angle in turns, [0, 1], and length along the profile.
 */
void world_revolve(world *w, int material, int variant, const float profile[][2], int count, int segments);

/** Ball; uv: angle in turns and length along a meridian from the lowest point. */
void world_ball(world *w, int material, int variant, const float center[3], float radius, int segments);

/** Ball deformed by noise: `amount` is a fraction of the radius, `detail` the number of bumps per radius;
    `flat` scales z. */
void world_blob(world *w, int material, int variant, const float center[3], float radius, float flat,
                float amount, float detail, int segments);

/** Torus about z. */
void world_torus(world *w, int material, const float center[3], float ring_radius, float tube_radius,
                 int segments, int sides);

/** Open tube from a to b; uv: angle in turns and length. */
void world_tube(world *w, int material, const float a[3], const float b[3], float radius, int sides);

/** Height field over [x0, x1] x [y0, y1]; uv are x and y. */
typedef float height_fn(float x, float y);
void world_field(world *w, int material, const float low[2], const float high[2], int cells,
                 height_fn *height);

/** Single vertices and triangles, for everything else. */
uint32_t world_vertex(world *w, const float position[3], const float normal[3], float u, float v);
void world_triangle(world *w, int material, int variant, uint32_t a, uint32_t b, uint32_t c);

/** Build the tree, then compute the indirect light at every vertex with `rays` rays (one bounce, plus a
    constant for later ones). */
gbt_status world_finish(world *w, int rays);

/** The first surface along a ray. */
bool world_trace(const world *w, const float origin[3], const float dir[3], surface *out);

/**
 * The colour of a surface seen along `dir`, display-referred [0, 1].
 *
 * @param dir   unit direction of the ray that found it
 * @param jitter two numbers in [0, 1) that select the point of the lamp for the shadow ray
 */
void world_shade(const world *w, const surface *s, const float dir[3], const float jitter[2], float rgb[3]);

/** What a ray sees that hits nothing, display-referred. */
void world_sky(const world *w, const float dir[3], float rgb[3]);

void world_free(world *w);

#endif
