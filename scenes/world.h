/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/world.h -- triangles with materials, the shapes they are made of, and the light that falls on them.

   A scene file builds a world with the shape functions, names materials by its own numbers and answers `look`
   for a surface point.
   World axes: z is up. The first failure sticks in world.status and makes every later call do nothing, so
   that a scene reads as a list of shapes. */
#ifndef GBT_SCENES_WORLD_H
#define GBT_SCENES_WORLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bvh/mesh.h"
#include "gbtrace/status.h"

/** What is known about a point of a surface before it is coloured. */
typedef struct surface {
    float position[3];
    float normal[3];    /* shading normal, unit, on the viewer's side */
    float geometric[3]; /* the triangle's normal, unit, on the viewer's side */
    float uv[2];        /* the shape's own coordinates, see each shape */
    float indirect[3];  /* light from everything but the lamp, as baked */
    float distance;     /* along the ray */
    bool is_back;       /* seen from the inside of a closed shape */
    int material;
    int variant; /* tells equal shapes of one material apart */
} surface;

/** The colour of a surface. Light units: 1 is a white surface in full light. */
typedef struct look {
    float albedo[3];
    float emission[3]; /* of sky and windows: added, not lit */
    float specular;    /* reflectance straight on, [0, 1]; grazing reflectance grows as Schlick says */
    float shininess;   /* Blinn-Phong exponent of the highlight, >= 1 */
    float roughness;   /* spread of the mirror ray; the mirror ray is traced only where `mirror` is set */
    bool mirror;
} look;

typedef void look_fn(const surface *s, look *out);

typedef struct light {
    float position[3]; /* of the lamp's centre, or the unit direction towards the sun */
    float radius;      /* of the lamp, scene units; of the sun, tangent of its angular radius */
    float color[3];    /* irradiance on a facing surface: at distance 1 of the lamp, anywhere under the sun */
    float dome;        /* under a sun: radius of the sky dome around the origin; shadow rays end before it */
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
    float epsilon;  /* how far a secondary ray starts off its surface */
    float place[4]; /* where the next shapes stand: x, y, z, turn about z in radians */
    size_t capacity[6];
    gbt_status status;
    gbt_error *err;
} world;

/** The next shapes stand at (x, y, z), turned about z. */
void world_place(world *w, float x, float y, float z, float turn_rad);

/** Parallelogram corner + a*[0,1] + b*[0,1], facing a x b, in cells x_cells * y_cells; uv are lengths from
    its centre. */
void world_sheet(world *w, int material, int variant, const float corner[3], const float a[3],
                 const float b[3], float cell);

/** Box with sides parallel to the axes; each face is a sheet. `cell` is the largest edge of a triangle's
    square. */
void world_box(world *w, int material, int variant, const float center[3], const float half[3], float cell);

/**
 * Surface of revolution about z.
 *
 * @param profile [count][2]: radius and height; outside is on the right when walking along it; a point given
 *                twice is a sharp edge
 *
 * uv: angle in turns, [0, 1], and length along the profile.
 */
void world_revolve(world *w, int material, int variant, const float profile[][2], int count, int segments);

/** Ball; uv: angle in turns and length along a meridian from the lowest point. */
void world_ball(world *w, int material, int variant, const float center[3], float radius, int segments);

/** Ball pushed in and out by noise: `amount` is a fraction of the radius, `detail` the number of bumps over a
    radius; `flat` scales z. */
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

/** Single vertices and triangles, for the rest. */
uint32_t world_vertex(world *w, const float position[3], const float normal[3], float u, float v);
void world_triangle(world *w, int material, int variant, uint32_t a, uint32_t b, uint32_t c);

/** Build the tree, then gather the indirect light of every vertex with `rays` rays (one bounce, plus a
    constant for the rest). */
gbt_status world_finish(world *w, int rays);

/** First surface along a ray. */
bool world_trace(const world *w, const float origin[3], const float dir[3], surface *out);

/**
 * Colour of a surface towards `dir` reversed, display-referred [0, 1].
 *
 * @param dir   unit direction of the ray that found it
 * @param jitter two numbers in [0, 1): where on the lamp the shadow ray goes
 */
void world_shade(const world *w, const surface *s, const float dir[3], const float jitter[2], float rgb[3]);

/** What a ray sees that hits nothing, display-referred. */
void world_sky(const world *w, const float dir[3], float rgb[3]);

void world_free(world *w);

#endif
