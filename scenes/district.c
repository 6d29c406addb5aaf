/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/district.c -- a district of streets and blocks of houses, as an example of a large scene: cameras
   walk its streets and fly over it, and each sees only a small part. */
#include <math.h>
#include <string.h>

#include "scenes/place.h"
#include "scenes/recipe.h"
#include "scenes/texture.h"

enum { GROUND, FACADE, ROOF, LEAVES, TRUNK, SKY };

enum { BLOCKS = 8, LOTS = 3 /* houses along one side of a block */ };

static const float dome_radius = 190, pitch = 24, street = 8, window_width = 1.5f, floor_height = 3.0f;

/** The centre of block `i` along an axis. */
static float block_middle(int i) { return pitch * ((float)i - 0.5f * (BLOCKS - 1)); }

/** Distance from the centre line of the nearest street along an axis. */
static float street_distance(float x)
{
    const float at = x / pitch;
    return pitch * fabsf(at - floorf(at + 0.5f));
}

static void look_at_ground(const float p[3], float albedo[3])
{
    const float to_street = fminf(street_distance(p[0]), street_distance(p[1]));
    texture_mix(albedo, (const float[3]){0.24f, 0.34f, 0.12f}, (const float[3]){0.46f, 0.44f, 0.20f},
                0.5f + 0.6f * texture_fbm(0.7f * p[0], 0.7f * p[1], 3, 4));
    if (fabsf(p[0]) > 0.5f * pitch * BLOCKS + 4 || fabsf(p[1]) > 0.5f * pitch * BLOCKS + 4)
        return;
    int id[2];
    if (to_street < 0.5f * street) { /* paving stones beside the road */
        const float edge = texture_brick(p[0], p[1], 0.8f, 0.5f, id);
        texture_mix(albedo, (const float[3]){0.50f, 0.47f, 0.43f}, (const float[3]){0.66f, 0.62f, 0.55f},
                    texture_hash(id[0], id[1], 5));
        texture_scale(albedo, edge < 0.03f ? 0.7f : 1);
    }
    if (to_street < 2.6f) {
        set(albedo, 0.26f, 0.26f, 0.28f);
        texture_scale(albedo, 1 + 0.25f * texture_fbm(2.5f * p[0], 2.5f * p[1], 0, 4));
        if (to_street < 0.12f && ((int)floorf(0.4f * (p[0] + p[1])) & 1) != 0)
            set(albedo, 0.80f, 0.80f, 0.76f);
    }
}

static void look_at_facade(const surface *s, look *l)
{
    static const float paints[6][3] = {{0.78f, 0.60f, 0.40f}, {0.66f, 0.36f, 0.26f}, {0.80f, 0.74f, 0.60f},
                                       {0.52f, 0.60f, 0.62f}, {0.74f, 0.50f, 0.42f}, {0.60f, 0.64f, 0.48f}};
    const float u = s->uv[0] / window_width, v = s->position[2] / floor_height;
    const float column = u - floorf(u), row = v - floorf(v);
    float *albedo = l->albedo;
    memcpy(albedo, paints[s->variant % 6], 3 * sizeof *albedo);
    texture_scale(albedo, 0.95f + 0.16f * texture_fbm(0.8f * s->position[0], 0.8f * s->position[1],
                                                      0.8f * s->position[2], 4));
    if (fabsf(column - 0.5f) < 0.27f && fabsf(row - 0.55f) < 0.30f) {
        const float lit = texture_hash((int)floorf(u), (int)floorf(v), s->variant);
        const bool bar = fabsf(column - 0.5f) < 0.02f || fabsf(row - 0.62f) < 0.015f;
        texture_mix(albedo, (const float[3]){0.10f, 0.13f, 0.18f}, (const float[3]){0.50f, 0.46f, 0.36f},
                    lit * lit);
        if (bar || fabsf(column - 0.5f) > 0.25f || fabsf(row - 0.55f) > 0.285f)
            set(albedo, 0.82f, 0.80f, 0.75f);
    } else if (row < 0.06f)
        texture_scale(albedo, 0.75f);
}

static void look_at_district(const surface *s, look *l)
{
    const float *p = s->position;
    float *albedo = l->albedo;
    int id[2];
    switch (s->material) {
    case GROUND:
        look_at_ground(p, albedo);
        break;
    case FACADE:
        look_at_facade(s, l);
        break;
    case ROOF: {
        const float edge = texture_brick(s->uv[0], s->uv[1], 0.5f, 0.35f, id);
        texture_mix(albedo, (const float[3]){0.46f, 0.18f, 0.12f}, (const float[3]){0.62f, 0.34f, 0.22f},
                    texture_hash(id[0], id[1], s->variant));
        texture_scale(albedo, edge < 0.03f ? 0.7f : 1);
        break;
    }
    case LEAVES:
        texture_mix(albedo, (const float[3]){0.10f, 0.24f, 0.06f}, (const float[3]){0.42f, 0.47f, 0.14f},
                    texture_step(-0.5f, 0.5f, texture_fbm(3 * p[0], 3 * p[1], 3 * p[2], 3)));
        break;
    case TRUNK:
        set(albedo, 0.30f, 0.22f, 0.15f);
        break;
    default: /* SKY */
        texture_mix(l->emission, (const float[3]){0.84f, 0.86f, 0.90f}, (const float[3]){0.34f, 0.56f, 0.92f},
                    texture_step(-0.05f, 0.6f, p[2] / dome_radius));
        texture_mix(l->emission, l->emission, (const float[3]){1.0f, 0.98f, 0.95f},
                    0.8f * texture_step(0.05f, 0.45f, texture_fbm(0.03f * p[0], 0.03f * p[1], 0, 4)));
        texture_scale(l->emission, 0.75f);
        break;
    }
}

/** A house on a lot of 2 half_x by 2 half_y: walls and a gabled roof. */
static void build_house(world *w, int number, float x, float y, float half_x, float half_y)
{
    const float height = floor_height * (2 + floorf(4 * texture_hash(number, 1, 3))), rise = 0.7f * half_y;
    world_place(w, x, y, 0, 0);
    box(w, FACADE, number, 0, 0, 0.5f * height, half_x, half_y, 0.5f * height, 2.5f);
    for (int side = -1; side <= 1; side += 2) {
        const float s = (float)side;
        world_sheet(w, ROOF, number, (const float[3]){-s * half_x, -s * (half_y + 0.3f), height - 0.1f},
                    (const float[3]){2 * s * half_x, 0, 0}, (const float[3]){0, s * (half_y + 0.3f), rise},
                    2.5f);
        const float normal[3] = {s, 0, 0};
        const uint32_t a = world_vertex(w, (const float[3]){s * half_x, -half_y, height}, normal, 0, 0),
                       b = world_vertex(w, (const float[3]){s * half_x, half_y, height}, normal, 0, 0),
                       c = world_vertex(w, (const float[3]){s * half_x, 0, height + 0.9f * rise}, normal, 0,
                                        0);
        world_triangle(w, FACADE, number, a, b, c);
    }
}

static void build_block(world *w, int number, float x, float y)
{
    const float inner = 0.5f * (pitch - street) - 1, deep = 2.6f, half = inner / LOTS;
    for (int lot = 0; lot < LOTS; lot++) /* along both streets that run in x */
        for (int side = -1; side <= 1; side += 2)
            build_house(w, 16 * number + 2 * lot + (side > 0), x - inner + half * (float)(2 * lot + 1),
                        y + (float)side * (inner - deep), half * 0.98f, deep);
    for (int tree = 0; tree < 6; tree++) { /* in the yard and at the kerb */
        const float along = inner * (2 * texture_hash(number, tree, 7) - 1),
                    at = tree < 3 ? 1.2f * (2 * texture_hash(number, tree, 8) - 1)
                                  : (tree == 3 ? -1.0f : 1.0f) * (inner + 1.2f),
                    high = 2.2f + 1.6f * texture_hash(number, tree, 9);
        world_place(w, x + along, y + at, 0, (float)tree);
        tube(w, TRUNK, 0, 0, -0.1f, 0, 0, high, 0.12f);
        world_blob(w, LEAVES, number, (const float[3]){0, 0, high + 0.8f}, 1.3f, 0.9f, 0.3f, 2.5f, 20);
    }
}

static float flat(float x, float y)
{
    const float beyond = fmaxf(fabsf(x), fabsf(y)) - 0.5f * pitch * BLOCKS;
    return beyond > 6 ? 0.12f * (beyond - 6) : 0;
}

static void build(world *w)
{
    w->look = look_at_district;
    w->epsilon = 4e-3f;
    w->lamp = (light){.position = {-0.48f, 0.36f, 0.80f},
                      .radius = 0.012f,
                      .color = {2.6f, 2.3f, 1.8f},
                      .dome = dome_radius,
                      .is_sun = true,
                      .exposure = 0.8f,
                      .sky_low = {0.8f, 0.82f, 0.86f},
                      .sky_high = {0.42f, 0.6f, 0.9f}};
    const float edge = 150;
    world_place(w, 0, 0, 0, 0);
    world_field(w, GROUND, (const float[2]){-edge, -edge}, (const float[2]){edge, edge}, 160, flat);
    world_ball(w, SKY, 0, (const float[3]){0, 0, 0}, dome_radius, 32);
    for (int j = 0; j < BLOCKS; j++)
        for (int i = 0; i < BLOCKS; i++)
            build_block(w, BLOCKS * j + i, block_middle(i), block_middle(j));
    world_place(w, 0, 0, 0, 0);
}

/** Two of three cameras walk along the streets in turn, looking ahead and to one side. The third flies over
    the blocks in rows and looks down. Any eight consecutive views include both kinds. */
static void place_camera(int view, int view_count, double eye[3], double target[3])
{
    const double half = 0.5 * (double)pitch * BLOCKS, part = (view + 0.5) / view_count;
    if (view % 3 == 2) {
        const double row = part * BLOCKS, along = row - floor(row),
                     x = half * (2 * (((int)row & 1) != 0 ? 1 - along : along) - 1),
                     y = (double)pitch * (floor(row) - 0.5 * (BLOCKS - 1));
        const double turn = 2.4 * view;
        const double at[3] = {x, y, 24}, to[3] = {x + 16 * cos(turn), y + 16 * sin(turn), 0};
        memcpy(eye, at, sizeof at);
        memcpy(target, to, sizeof to);
        return;
    }
    const double streets = 2 * (BLOCKS - 1), place = part * streets, along = place - floor(place);
    const int number = (int)place, axis = number & 1;
    const double across = (double)pitch * (number / 2 - 0.5 * (BLOCKS - 2)), side = view % 3 == 0 ? 1 : -1;
    const double ahead = (view / 3) % 2 == 0 ? 1 : -1;
    double at[3] = {0, 0, 1.8}, to[3] = {0, 0, 3.2};
    at[axis] = half * (2 * along - 1);
    at[1 - axis] = across - 1.5 * side;
    to[axis] = at[axis] + 10 * ahead;
    to[1 - axis] = across + (3 + 5 * ((view / 6) % 2)) * side;
    memcpy(eye, at, sizeof at);
    memcpy(target, to, sizeof to);
}

const recipe recipe_district = {
    .name = "district",
    .summary = "64 blocks of houses along 14 streets, walked and flown over: for large scenes",
    .about = "A district of 8 x 8 blocks of gabled houses with yards and trees between straight streets, "
             "190 units across. Two of three cameras stand in the streets at eye level, the others fly "
             "over the roofs; each sees a small part of the district. A sphere of 190 units around it "
             "carries the sky.",
    .build = build,
    .place_camera = place_camera,
    .jitter = 0.2f,
    .focal_widths = 0.70f,
    .view_distance = 60,
    .bake_rays = 32,
};
