/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/terrain.c -- a valley from the air: slopes by height, a lake, a village, woods and a road. */
#include <math.h>
#include <string.h>

#include "scenes/recipe.h"
#include "scenes/texture.h"

enum { GROUND, LAKE, HOUSE_WALL, HOUSE_ROOF, TOWER, LEAVES, NEEDLES, TRUNK, SKY };

static const float dome_radius = 70, half_size = 48, lake_level = -0.55f;

/** The road and the village keep to this line. */
static float road_y(float x) { return 1.6f * sinf(0.28f * x) - 0.8f; }

static float ground_height(float x, float y)
{
    const float r = hypotf(x, y);
    const float hills = 2.4f * texture_fbm(0.11f * x, 0.11f * y, 0.5f, 5);
    const float rim =
        9 * texture_step(12, 46, r) * (0.75f + 0.5f * texture_fbm(0.09f * x, 0.09f * y, 4.5f, 4));
    const float lake = -2.6f * texture_step(4.2f, 1.2f, hypotf(x - 4.6f, 0.8f * (y + 3.8f)));
    /* The road lies in a smooth strip, and so do the houses along it. */
    const float strip = 1 - texture_step(0.8f, 3.0f, fabsf(y - road_y(x)));
    const float calm = 0.25f * hills;
    return (hills + (calm - hills) * strip) + rim + lake * (1 - strip) + 0.15f;
}

static void look_at_ground(const surface *s, look *l)
{
    const float *p = s->position;
    static const float sand[3] = {0.68f, 0.58f, 0.40f}, meadow[3] = {0.30f, 0.42f, 0.14f},
                       dry[3] = {0.56f, 0.50f, 0.24f};
    static const float rock[3] = {0.44f, 0.40f, 0.36f}, snow[3] = {0.86f, 0.88f, 0.90f},
                       road[3] = {0.66f, 0.58f, 0.46f};
    texture_mix(l->albedo, meadow, dry,
                texture_step(-0.25f, 0.35f, texture_fbm(0.35f * p[0], 0.35f * p[1], 2, 4)));
    texture_scale(l->albedo, 1 + 0.18f * texture_noise(2.6f * p[0], 2.6f * p[1], 0));
    texture_mix(l->albedo, l->albedo, rock, texture_step(0.88f, 0.72f, s->normal[2]));
    if (s->normal[2] > 0.6f)
        texture_mix(l->albedo, l->albedo, snow,
                    texture_step(7.0f, 9.0f, p[2] + texture_fbm(p[0], p[1], 0, 2)));
    texture_mix(l->albedo, l->albedo, sand, texture_step(lake_level + 0.30f, lake_level + 0.12f, p[2]));
    texture_mix(l->albedo, l->albedo, road, texture_step(0.26f, 0.20f, fabsf(p[1] - road_y(p[0]))));
}

static void look_at_lake(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.05f, 0.20f, 0.28f}, (const float[3]){0.10f, 0.32f, 0.36f},
                0.5f + 0.5f * texture_fbm(0.7f * p[0], 2 * p[1], 0, 3));
    l->specular = 0.03f;
    l->shininess = 60;
    l->mirror = true;
    l->roughness = 0.02f;
}

static void look_at_house_wall(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    static const float paints[4][3] = {
        {0.82f, 0.76f, 0.62f}, {0.76f, 0.58f, 0.42f}, {0.80f, 0.80f, 0.76f}, {0.66f, 0.48f, 0.38f}};
    memcpy(l->albedo, paints[s->variant % 4], 3 * sizeof *l->albedo);
    const float column = u / 0.30f - floorf(u / 0.30f), row = v / 0.34f - floorf(v / 0.34f);
    if (s->normal[2] < 0.5f && fabsf(column - 0.5f) < 0.20f && fabsf(row - 0.5f) < 0.24f) {
        l->albedo[0] = 0.14f;
        l->albedo[1] = 0.18f;
        l->albedo[2] = 0.24f;
    }
}

static void look_at_house_roof(const surface *s, look *l)
{
    const float v = s->uv[1];
    texture_mix(l->albedo, (const float[3]){0.50f, 0.18f, 0.11f}, (const float[3]){0.66f, 0.32f, 0.19f},
                texture_hash(s->variant, 4, 4));
    if (v / 0.14f - floorf(v / 0.14f) < 0.25f)
        texture_scale(l->albedo, 0.78f);
}

static void look_at_tower(const surface *s, look *l)
{
    const float *p = s->position, u = s->uv[0];
    l->albedo[0] = 0.70f;
    l->albedo[1] = 0.66f;
    l->albedo[2] = 0.58f;
    if (p[2] > 1.2f && ((int)floorf(u / 0.2f) & 1) != 0)
        texture_scale(l->albedo, 0.75f);
}

static void look_at_leaves(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.12f, 0.26f, 0.06f}, (const float[3]){0.44f, 0.48f, 0.13f},
                texture_step(-0.5f, 0.5f, texture_fbm(4 * p[0], 4 * p[1], 4 * p[2], 2)));
}

static void look_at_needles(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.05f, 0.16f, 0.09f}, (const float[3]){0.14f, 0.30f, 0.15f},
                texture_step(-0.5f, 0.5f, texture_fbm(5 * p[0], 5 * p[1], 5 * p[2], 2)));
}

static void look_at_trunk(const surface *s, look *l)
{
    (void)s;
    l->albedo[0] = 0.30f;
    l->albedo[1] = 0.21f;
    l->albedo[2] = 0.14f;
}

static void look_at_sky(const surface *s, look *l)
{
    const float *p = s->position;
    float out[3];
    texture_mix(out, (const float[3]){0.86f, 0.88f, 0.92f}, (const float[3]){0.36f, 0.58f, 0.94f},
                texture_step(-0.05f, 0.6f, p[2] / dome_radius));
    const float cloud = texture_step(0.05f, 0.45f, texture_fbm(0.06f * p[0], 0.06f * p[1], 0.15f * p[2], 4));
    texture_mix(out, out, (const float[3]){1.05f, 1.03f, 1.0f}, 0.8f * cloud);
    for (int k = 0; k < 3; k++)
        l->emission[k] = 0.75f * out[k];
}

static void look_at_land(const surface *s, look *l)
{
    static look_fn *const looks[] = {
        [GROUND] = look_at_ground,         [LAKE] = look_at_lake,   [HOUSE_WALL] = look_at_house_wall,
        [HOUSE_ROOF] = look_at_house_roof, [TOWER] = look_at_tower, [LEAVES] = look_at_leaves,
        [NEEDLES] = look_at_needles,       [TRUNK] = look_at_trunk, [SKY] = look_at_sky,
    };
    looks[s->material](s, l);
}

static void build_house(world *w, int number, float x, float y, float turn_rad, float length, float height)
{
    const float half = 0.42f, ground = ground_height(x, y) - 0.1f, eave = 0.06f, rise = 0.42f;
    world_place(w, x, y, ground, turn_rad);
    world_box(w, HOUSE_WALL, number, (const float[3]){0, 0, 0.5f * height},
              (const float[3]){length, half, 0.5f * height}, 0.4f);
    for (int side = -1; side <= 1; side += 2) {
        const float s = (float)side;
        world_sheet(w, HOUSE_ROOF, number,
                    (const float[3]){-s * (length + eave), -s * (half + eave), height - 0.05f},
                    (const float[3]){2 * s * (length + eave), 0, 0},
                    (const float[3]){0, s * (half + eave), rise}, 0.4f);
        /* The gable above the end wall. */
        const float normal[3] = {s, 0, 0};
        const uint32_t a = world_vertex(w, (const float[3]){s * length, -half, height}, normal, 0, 0),
                       b = world_vertex(w, (const float[3]){s * length, half, height}, normal, 0, 0);
        const uint32_t c =
            world_vertex(w, (const float[3]){s * length, 0, height + 0.88f * rise}, normal, 0, 0);
        world_triangle(w, HOUSE_WALL, number, a, b, c);
    }
}

static void build_tree(world *w, int number, float x, float y)
{
    const float high = 0.9f + 0.7f * texture_hash(number, 3, 7);
    world_place(w, x, y, ground_height(x, y), (float)number);
    world_tube(w, TRUNK, (const float[3]){0, 0, -0.1f}, (const float[3]){0, 0, 0.5f * high}, 0.05f, 6);
    if (number % 3 != 0) {
        static const float cone[][2] = {{0.0f, 0.22f},  {0.40f, 0.22f}, {0.40f, 0.22f}, {0.18f, 0.62f},
                                        {0.18f, 0.62f}, {0.29f, 0.60f}, {0.29f, 0.60f}, {0.0f, 1.15f}};
        float scaled[8][2];
        for (int i = 0; i < 8; i++) {
            scaled[i][0] = high * cone[i][0];
            scaled[i][1] = high * cone[i][1];
        }
        world_revolve(w, NEEDLES, number, (const float(*)[2])scaled, 8, 12);
    } else {
        world_blob(w, LEAVES, number, (const float[3]){0, 0, 0.72f * high}, 0.44f * high, 0.9f, 0.35f, 2.5f,
                   16);
    }
}

static void build(world *w)
{
    w->look = look_at_land;
    w->epsilon = 2e-3f;
    w->lamp = (light){.position = {-0.52f, 0.48f, 0.707f},
                      .radius = 0.012f,
                      .color = {2.7f, 2.3f, 1.75f},
                      .dome = dome_radius,
                      .is_sun = true,
                      .exposure = 0.8f,
                      .sky_low = {0.8f, 0.82f, 0.86f},
                      .sky_high = {0.42f, 0.6f, 0.9f}};
    world_place(w, 0, 0, 0, 0);
    world_field(w, GROUND, (const float[2]){-half_size, -half_size}, (const float[2]){half_size, half_size},
                200, ground_height);
    static const float lake[][2] = {{5.4f, -0.55f}, {2.5f, -0.55f}, {0.0f, -0.55f}};
    world_place(w, 4.6f, -3.8f, 0, 0);
    world_revolve(w, LAKE, 0, lake, 3, 32);
    world_place(w, 0, 0, 0, 0);
    world_ball(w, SKY, 0, (const float[3]){0, 0, 0}, dome_radius, 32);
    for (int i = 0; i < 22; i++) { /* houses on both sides of the road */
        const float x = -6.2f + 1.15f * (float)(i / 2) + 0.3f * texture_hash(i, 1, 2),
                    side = (i & 1) != 0 ? 1 : -1;
        const float y = road_y(x) + side * (1.05f + 0.25f * texture_hash(i, 2, 2));
        build_house(w, i, x, y, 0.45f * cosf(0.28f * x) + (texture_hash(i, 3, 2) > 0.7f ? 1.57f : 0),
                    0.45f + 0.12f * texture_hash(i, 4, 2), 0.65f + 0.35f * texture_hash(i, 5, 2));
    }
    /* The church: a tower with a spire beside a long house. */
    const float cx = -1.2f, cy = road_y(-1.2f) + 2.6f;
    build_house(w, 102, cx, cy, 0.3f, 0.9f, 1.0f);
    static const float tower[][2] = {{0.34f, 0.0f},  {0.34f, 2.2f},  {0.34f, 2.2f},
                                     {0.42f, 2.25f}, {0.42f, 2.25f}, {0.0f, 3.3f}};
    world_place(w, cx - 1.1f, cy - 0.35f, ground_height(cx, cy) - 0.1f, 0.3f);
    world_revolve(w, TOWER, 0, tower, 4, 4);
    world_revolve(w, HOUSE_ROOF, 5, tower + 4, 2, 4);
    for (int i = 0, tries = 0; i < 260 && tries < 4000; tries++) {
        const float r = 2.5f + 14 * texture_hash(tries, 1, 5), angle = 6.2831853f * texture_hash(tries, 2, 5);
        const float x = r * cosf(angle), y = r * sinf(angle);
        /* Woods grow in patches, off the road, the houses and the water. */
        if (texture_fbm(0.22f * x, 0.22f * y, 8, 2) < 0.0f || fabsf(y - road_y(x)) < 2.1f ||
            ground_height(x, y) < lake_level + 0.35f || hypotf(x - cx, y - cy) < 2.2f)
            continue;
        build_tree(w, i++, x, y);
    }
    world_place(w, 0, 0, 0, 0);
}

const recipe recipe_terrain = {
    .name = "terrain",
    .summary = "a valley from the air: lake, village, woods and slopes",
    .about = "A valley seen from the air: meadows, rock and snow by slope and height, a lake with a sandy "
             "shore, a road, a village of gabled houses with a church, and patches of needle and leaf trees. "
             "A sphere of 70 units around the valley carries the sky and its clouds, so the sky has depth "
             "and sparse points too.",
    .build = build,
    .rings = {{12.5f, 5.6f}, {9.5f, 8.5f}},
    .target = {0, 0, 0.2f},
    .jitter = 0.25f,
    .focal_widths = 0.80f,
    .bake_rays = 48,
};
