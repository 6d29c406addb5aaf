/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/courtyard.c -- a town square under a low sun: fountain, facades, trees, a fence, hills and a sky
   dome. */
#include <math.h>
#include <string.h>

#include "scenes/place.h"
#include "scenes/recipe.h"
#include "scenes/texture.h"

enum {
    PAVING,
    GRASS,
    STONE,
    WATER,
    BRONZE,
    FACADE,
    PANE,
    DOOR,
    TRIM,
    ROOF,
    BARK,
    CROWN,
    HEDGE,
    IRON,
    LAMP_GLASS,
    BENCH,
    AWNING,
    FLOWERS,
    HILLS,
    SKY
};

static const float dome_radius = 95;

static void look_at_paving(const surface *s, look *l)
{
    int id[2];
    const float *p = s->position;
    /* Rings of setts around the fountain; big slabs outside. */
    const float r = hypotf(p[0], p[1]), angle = (float)atan2(p[1], p[0]);
    float edge, tone;
    if (r < 8.0f) {
        const float ring = floorf(r / 0.55f), around = ring * 6 + 8;
        edge = texture_brick(angle / 6.2831853f * around, r / 0.55f, 1, 1, id);
        tone = texture_hash(id[0], ((id[1] % (int)around) + (int)around) % (int)around, 4);
        texture_mix(l->albedo, (const float[3]){0.50f, 0.44f, 0.38f}, (const float[3]){0.70f, 0.62f, 0.52f},
                    tone);
        if ((int)ring % 5 == 4)
            set(l->albedo, 0.56f, 0.32f, 0.24f);
        edge *= 0.55f;
    } else {
        edge = texture_brick(p[0], p[1], 1.5f, 1.0f, id);
        tone = texture_hash(id[0], id[1], 5);
        texture_mix(l->albedo, (const float[3]){0.54f, 0.52f, 0.48f}, (const float[3]){0.68f, 0.64f, 0.58f},
                    tone);
    }
    texture_scale(l->albedo, 1 + 0.10f * texture_fbm(2 * p[0], 2 * p[1], 0, 3));
    if (edge < 0.03f)
        texture_scale(l->albedo, 0.62f);
}

static void look_at_grass(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.18f, 0.30f, 0.09f}, (const float[3]){0.36f, 0.46f, 0.16f},
                0.5f + 0.6f * texture_fbm(1.6f * p[0], 1.6f * p[1], 0, 3));
}

static void look_at_stone(const surface *s, look *l)
{
    const float *p = s->position, u = s->uv[0];
    set(l->albedo, 0.66f, 0.60f, 0.52f);
    texture_scale(l->albedo, 0.92f + 0.22f * texture_fbm(3 * p[0], 3 * p[1], 3 * p[2], 3));
    if (s->variant == 1 && ((int)floorf(16 * u) & 1) != 0)
        texture_scale(l->albedo, 0.82f);
}

static void look_at_water(const surface *s, look *l)
{
    const float *p = s->position;
    const float ripple = 0.5f + 0.5f * sinf(9 * hypotf(p[0], p[1]) + 1.5f * texture_noise(p[0], p[1], 0));
    texture_mix(l->albedo, (const float[3]){0.08f, 0.26f, 0.30f}, (const float[3]){0.16f, 0.38f, 0.40f},
                ripple);
    l->specular = 0.04f;
    l->shininess = 60;
    l->mirror = true;
    l->roughness = 0.015f;
}

static void look_at_bronze(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.34f, 0.22f, 0.10f}, (const float[3]){0.20f, 0.42f, 0.34f},
                texture_step(-0.1f, 0.4f, texture_fbm(4 * p[0], 4 * p[1], 4 * p[2], 3)));
    l->specular = 0.16f;
    l->shininess = 40;
    l->mirror = true;
    l->roughness = 0.05f;
}

static void look_at_facade(const surface *s, look *l)
{
    int id[2];
    const float *p = s->position;
    static const float paints[5][3] = {{0.78f, 0.58f, 0.36f},
                                       {0.68f, 0.36f, 0.26f},
                                       {0.80f, 0.74f, 0.58f},
                                       {0.54f, 0.62f, 0.62f},
                                       {0.76f, 0.50f, 0.42f}};
    memcpy(l->albedo, paints[s->variant % 5], 3 * sizeof *l->albedo);
    if (s->variant % 5 == 1 || p[2] < 0.9f) {
        const float edge =
            texture_brick(p[0] + p[1], p[2], p[2] < 0.9f ? 0.9f : 0.5f, p[2] < 0.9f ? 0.45f : 0.2f, id);
        if (p[2] < 0.9f)
            set(l->albedo, 0.56f, 0.52f, 0.46f);
        texture_scale(l->albedo, edge < 0.025f ? 0.72f : 0.9f + 0.2f * texture_hash(id[0], id[1], 6));
    }
    texture_scale(l->albedo, 0.95f + 0.14f * texture_fbm(0.8f * p[0], 0.8f * p[1], 0.6f * p[2], 4));
}

static void look_at_pane(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    /* Glazing bars, and curtains behind some of the panes. */
    const float curtain = texture_hash(s->variant, 3, 3);
    texture_mix(l->albedo, (const float[3]){0.10f, 0.15f, 0.20f}, (const float[3]){0.30f, 0.40f, 0.48f},
                texture_step(-0.7f, 0.9f, v));
    if (curtain > 0.5f && fabsf(u) > 0.22f)
        set(l->albedo, 0.66f, 0.60f, 0.52f);
    if (fabsf(u) < 0.035f || fabsf(v - 0.25f) < 0.035f)
        set(l->albedo, 0.78f, 0.76f, 0.70f);
    l->specular = 0.05f;
    l->shininess = 80;
}

static void look_at_door(const surface *s, look *l)
{
    const float u = s->uv[0];
    const float board = u / 0.3f - floorf(u / 0.3f);
    set(l->albedo, 0.22f, 0.30f, 0.26f);
    if (s->variant % 2 == 1)
        set(l->albedo, 0.40f, 0.18f, 0.12f);
    if (board < 0.08f)
        texture_scale(l->albedo, 0.6f);
}

static void look_at_trim(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.80f, 0.76f, 0.68f);
}

static void look_at_roof(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    const float wave = u / 0.5f - floorf(u / 0.5f), row = v / 0.42f - floorf(v / 0.42f);
    texture_mix(l->albedo, (const float[3]){0.46f, 0.20f, 0.13f}, (const float[3]){0.64f, 0.32f, 0.20f},
                texture_hash((int)floorf(u / 0.5f), (int)floorf(v / 0.42f), 8));
    texture_scale(l->albedo, row < 0.15f || wave < 0.12f ? 0.7f : 1.0f);
}

static void look_at_bark(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.24f, 0.17f, 0.11f}, (const float[3]){0.40f, 0.30f, 0.20f},
                0.5f + 0.5f * texture_fbm(9 * p[0], 9 * p[1], 2 * p[2], 2));
}

static void look_at_crown(const surface *s, look *l)
{
    const float *p = s->position;
    static const float deep[3][3] = {{0.10f, 0.22f, 0.06f}, {0.14f, 0.26f, 0.06f}, {0.26f, 0.22f, 0.05f}};
    static const float bright[3][3] = {{0.30f, 0.46f, 0.12f}, {0.42f, 0.50f, 0.14f}, {0.66f, 0.48f, 0.12f}};
    texture_mix(l->albedo, deep[s->variant % 3], bright[s->variant % 3],
                texture_step(-0.5f, 0.5f, texture_fbm(3.2f * p[0], 3.2f * p[1], 3.2f * p[2], 3)));
}

static void look_at_hedge(const surface *s, look *l)
{
    const float *p = s->position;
    texture_mix(l->albedo, (const float[3]){0.08f, 0.20f, 0.07f}, (const float[3]){0.24f, 0.38f, 0.12f},
                texture_step(-0.5f, 0.5f, texture_fbm(5 * p[0], 5 * p[1], 5 * p[2], 3)));
}

static void look_at_iron(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.10f, 0.12f, 0.12f);
    l->specular = 0.06f;
    l->shininess = 25;
}

static void look_at_lamp_glass(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.90f, 0.84f, 0.66f);
    l->specular = 0.05f;
    l->shininess = 60;
}

static void look_at_bench(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    set(l->albedo, 0.46f, 0.28f, 0.14f);
    texture_scale(l->albedo, 0.9f + 0.2f * texture_noise(2 * u, 12 * v, 0));
}

static void look_at_awning(const surface *s, look *l)
{
    const float u = s->uv[0];
    const float stripe = u / 0.5f - floorf(u / 0.5f);
    set(l->albedo, 0.84f, 0.80f, 0.72f);
    if (stripe < 0.5f)
        set(l->albedo, s->variant % 2 == 0 ? 0.66f : 0.14f, s->variant % 2 == 0 ? 0.16f : 0.36f,
            s->variant % 2 == 0 ? 0.12f : 0.34f);
}

static void look_at_flowers(const surface *s, look *l)
{
    const float *p = s->position;
    static const float petals[4][3] = {
        {0.80f, 0.20f, 0.18f}, {0.88f, 0.70f, 0.18f}, {0.80f, 0.76f, 0.80f}, {0.52f, 0.26f, 0.58f}};
    const float kind = texture_hash((int)floorf(3.2f * p[0]), (int)floorf(3.2f * p[1]), 2);
    set(l->albedo, 0.16f, 0.30f, 0.10f);
    if (texture_noise(5 * p[0], 5 * p[1], 5 * p[2]) > -0.05f)
        memcpy(l->albedo, petals[(int)(4 * kind) & 3], 3 * sizeof *l->albedo);
}

static void look_at_hills(const surface *s, look *l)
{
    const float *p = s->position;
    const float patch = texture_fbm(0.10f * p[0], 0.10f * p[1], 0, 4),
                far = texture_step(40, 95, hypotf(p[0], p[1]));
    texture_mix(l->albedo, (const float[3]){0.16f, 0.28f, 0.10f}, (const float[3]){0.56f, 0.50f, 0.24f},
                texture_step(-0.25f, 0.35f, patch));
    /* Haze lightens what is far. */
    texture_mix(l->albedo, l->albedo, (const float[3]){0.52f, 0.60f, 0.70f}, 0.55f * far);
}

static void look_at_sky(const surface *s, look *l)
{
    const float *p = s->position;
    const float height = p[2] / dome_radius;
    float out[3];
    texture_mix(out, (const float[3]){0.98f, 0.86f, 0.70f}, (const float[3]){0.34f, 0.56f, 0.92f},
                texture_step(-0.10f, 0.55f, height));
    const float cloud =
        texture_step(0.02f, 0.45f, texture_fbm(0.045f * p[0], 0.045f * p[1], 0.11f * p[2], 4));
    texture_mix(out, out, (const float[3]){1.05f, 1.0f, 0.95f}, 0.85f * cloud);
    for (int k = 0; k < 3; k++)
        l->emission[k] = 0.9f * out[k];
}

static void look_at_square(const surface *s, look *l)
{
    static look_fn *const looks[] = {
        [PAVING] = look_at_paving, [GRASS] = look_at_grass,   [STONE] = look_at_stone,
        [WATER] = look_at_water,   [BRONZE] = look_at_bronze, [FACADE] = look_at_facade,
        [PANE] = look_at_pane,     [DOOR] = look_at_door,     [TRIM] = look_at_trim,
        [ROOF] = look_at_roof,     [BARK] = look_at_bark,     [CROWN] = look_at_crown,
        [HEDGE] = look_at_hedge,   [IRON] = look_at_iron,     [LAMP_GLASS] = look_at_lamp_glass,
        [BENCH] = look_at_bench,   [AWNING] = look_at_awning, [FLOWERS] = look_at_flowers,
        [HILLS] = look_at_hills,   [SKY] = look_at_sky,
    };
    looks[s->material](s, l);
}

/** A house front in the current frame: its wall stands at y = distance, from x0 to x1, and looks towards the
    square. */
static void build_house(world *w, int number, float x0, float x1, float distance, int floors)
{
    const float height = 1.2f + 2.6f * (float)floors, middle = 0.5f * (x0 + x1), half = 0.5f * (x1 - x0);
    box(w, FACADE, number, middle, distance + 3, 0.5f * height, half, 3, 0.5f * height, 0.8f);
    box(w, TRIM, 0, middle, distance - 0.1f, height - 0.15f, half + 0.08f, 0.22f, 0.15f, 0.8f);
    box(w, TRIM, 0, middle, distance - 0.03f, 3.35f, half, 0.08f, 0.10f, 0.8f);
    world_sheet(w, ROOF, number, (const float[3]){x0 - 0.2f, distance - 0.45f, height},
                (const float[3]){x1 - x0 + 0.4f, 0, 0}, (const float[3]){0, 3.45f, 2.1f}, 0.8f);
    const int columns = (int)(2 * half / 1.9f);
    for (int column = 0; column < columns; column++) {
        const float x = x0 + (x1 - x0) * ((float)column + 0.5f) / (float)columns;
        for (int level = 0; level < floors; level++) {
            const float z = 1.9f + 2.6f * (float)level;
            const int pane = 100 * number + 10 * column + level;
            if (level == 0 && column == columns / 2) {
                box(w, DOOR, number, x, distance - 0.02f, 1.2f, 0.62f, 0.05f, 1.2f, 0.4f);
                box(w, TRIM, 0, x, distance - 0.06f, 2.5f, 0.78f, 0.12f, 0.10f, 0.4f);
                box(w, STONE, 0, x, distance - 0.35f, 0.09f, 0.9f, 0.35f, 0.09f, 0.4f);
                continue;
            }
            box(w, PANE, pane, x, distance + 0.01f, z, 0.46f, 0.03f, 0.75f, 0.5f);
            box(w, TRIM, 0, x, distance - 0.08f, z - 0.82f, 0.62f, 0.14f, 0.06f, 0.5f);
            box(w, TRIM, 0, x, distance - 0.04f, z + 0.82f, 0.58f, 0.09f, 0.08f, 0.5f);
            for (int side = -1; side <= 1; side += 2)
                box(w, level == 0 || number % 2 == 0 ? TRIM : DOOR, number,
                    x + 0.54f * (float)side + (level > 0 && number % 2 != 0 ? 0.16f * (float)side : 0),
                    distance - 0.04f, z, level > 0 && number % 2 != 0 ? 0.22f : 0.07f, 0.06f, 0.78f, 0.5f);
        }
    }
    if (number % 2 == 0)
        for (int side = -1; side <= 1; side += 2) {
            const float x = middle + 0.5f * half * (float)side;
            world_sheet(w, AWNING, number / 2, (const float[3]){x - 1.2f, distance - 1.3f, 2.75f},
                        (const float[3]){2.4f, 0, 0}, (const float[3]){0, 1.25f, 0.55f}, 0.3f);
        }
}

static void build_tree(world *w, int number, float x, float y, float height)
{
    world_place(w, x, y, 0, 0.9f * (float)number);
    static const float bed[][2] = {{0.95f, 0.0f},  {0.95f, 0.18f}, {0.95f, 0.18f},
                                   {0.82f, 0.18f}, {0.82f, 0.12f}, {0.0f, 0.14f}};
    world_revolve(w, number % 2 == 0 ? FLOWERS : STONE, 0, bed, sizeof bed / sizeof bed[0], 24);
    tube(w, BARK, 0, 0, 0, 0.05f, 0, 0.62f * height, 0.15f);
    for (int branch = 0; branch < 4; branch++) {
        const float angle = 1.6f * (float)branch + (float)number;
        tube(w, BARK, 0.03f, 0, 0.45f * height, 0.8f * cosf(angle), 0.8f * sinf(angle), 0.68f * height,
             0.07f);
    }
    for (int i = 0; i < 7; i++) {
        const float angle = 2.4f * (float)i + (float)number,
                    out = i == 0 ? 0 : 0.26f * height * (0.6f + 0.3f * texture_hash(i, number, 1));
        const float z = height * (i == 0 ? 0.88f : 0.62f + 0.2f * texture_hash(i, number, 2));
        world_blob(w, CROWN, number, (const float[3]){out * cosf(angle), out * sinf(angle), z},
                   height * (0.19f + 0.05f * texture_hash(i, number, 3)), 0.85f, 0.35f, 3.0f, 30);
    }
}

static void build_fountain(world *w)
{
    static const float basin[][2] = {{2.5f, 0.0f},   {2.5f, 0.12f},  {2.5f, 0.12f},  {2.3f, 0.12f},
                                     {2.3f, 0.12f},  {2.15f, 0.30f}, {2.15f, 0.55f}, {2.3f, 0.65f},
                                     {2.3f, 0.65f},  {2.32f, 0.78f}, {2.32f, 0.78f}, {1.95f, 0.78f},
                                     {1.95f, 0.78f}, {1.92f, 0.45f}};
    static const float water[][2] = {{1.93f, 0.62f}, {1.2f, 0.62f}, {0.0f, 0.62f}};
    static const float column[][2] = {{0.55f, 0.45f}, {0.55f, 0.75f}, {0.55f, 0.75f}, {0.30f, 0.85f},
                                      {0.22f, 1.1f},  {0.20f, 1.4f},  {0.26f, 1.55f}, {0.95f, 1.85f},
                                      {1.05f, 1.98f}, {1.05f, 1.98f}, {0.95f, 1.98f}, {0.85f, 1.88f}};
    static const float upper[][2] = {{0.93f, 1.94f}, {0.0f, 1.94f}};
    static const float post[][2] = {{0.22f, 1.85f}, {0.16f, 2.2f}, {0.14f, 2.5f}, {0.20f, 2.62f},
                                    {0.32f, 2.7f},  {0.32f, 2.7f}, {0.0f, 2.74f}};
    world_place(w, 0, 0, 0, 0);
    world_revolve(w, STONE, 1, basin, sizeof basin / sizeof basin[0], 48);
    world_revolve(w, WATER, 0, water, sizeof water / sizeof water[0], 48);
    world_revolve(w, STONE, 0, column, sizeof column / sizeof column[0], 40);
    world_revolve(w, WATER, 1, upper, 2, 40);
    world_revolve(w, STONE, 0, post, sizeof post / sizeof post[0], 32);
    world_ball(w, BRONZE, 0, (const float[3]){0, 0, 3.02f}, 0.30f, 36);
    world_torus(w, BRONZE, (const float[3]){0, 0, 3.02f}, 0.46f, 0.045f, 40, 12);
    for (int i = 0; i < 8; i++) { /* bronze spheres on the rim */
        const float angle = 0.785398f * (float)i + 0.39f;
        world_ball(w, BRONZE, 1, (const float[3]){2.14f * cosf(angle), 2.14f * sinf(angle), 0.93f}, 0.15f,
                   20);
    }
}

static float hill_height(float x, float y)
{
    const float r = hypotf(x, y), rise = texture_step(24, 80, r);
    return -0.12f + rise * (7.5f + 7 * texture_fbm(0.045f * x, 0.045f * y, 3, 4));
}

static void build(world *w)
{
    w->look = look_at_square;
    w->epsilon = 2e-3f;
    w->lamp = (light){.position = {0.52f, -0.62f, 0.59f},
                      .radius = 0.012f,
                      .color = {3.0f, 2.4f, 1.65f},
                      .dome = dome_radius,
                      .is_sun = true,
                      .exposure = 0.8f,
                      .sky_low = {0.9f, 0.85f, 0.8f},
                      .sky_high = {0.45f, 0.62f, 0.95f}};
    world_field(w, HILLS, (const float[2]){-90, -90}, (const float[2]){90, 90}, 90, hill_height);
    world_sheet(w, PAVING, 0, (const float[3]){-21, -21, 0}, (const float[3]){42, 0, 0},
                (const float[3]){0, 42, 0}, 0.6f);
    world_ball(w, SKY, 0, (const float[3]){0, 0, 0}, dome_radius, 32);

    world_place(w, 0, 0, 0, 0);
    build_house(w, 0, -13, -5.5f, 13, 3);
    build_house(w, 1, -5.5f, 1.0f, 13, 2);
    build_house(w, 2, 1.0f, 9.5f, 13, 3);
    world_place(w, 0, 0, 0, 1.570796f);
    build_house(w, 3, -8, 0.5f, 13.5f, 2);
    build_house(w, 4, 0.5f, 10.5f, 13.5f, 3);
    world_place(w, 0, 0, 0, -1.570796f);
    build_house(w, 5, -9.5f, -2.0f, 14, 2);
    build_house(w, 7, -2.0f, 3.0f, 14, 3);

    /* The open side: a low wall with an iron fence. */
    world_place(w, 0, 0, 0, 0);
    for (int part = 0; part < 2; part++) {
        const float x = part == 0 ? -8.0f : 8.0f;
        box(w, STONE, 0, x, -12.5f, 0.3f, 5.5f, 0.25f, 0.3f, 0.6f);
        for (int end = -1; end <= 1; end += 2) {
            box(w, STONE, 0, x + 5.5f * (float)end, -12.5f, 0.9f, 0.35f, 0.35f, 0.9f, 0.5f);
            world_ball(w, STONE, 0, (const float[3]){x + 5.5f * (float)end, -12.5f, 2.05f}, 0.30f, 20);
        }
        for (int i = 0; i <= 20; i++)
            tube(w, IRON, x - 5.0f + 0.5f * (float)i, -12.5f, 0.6f, x - 5.0f + 0.5f * (float)i, -12.5f, 1.65f,
                 0.03f);
        for (int rail = 0; rail < 2; rail++)
            tube(w, IRON, x - 5.4f, -12.5f, 0.75f + 0.75f * (float)rail, x + 5.4f, -12.5f,
                 0.75f + 0.75f * (float)rail, 0.035f);
    }
    build_tree(w, 0, -9.0f, 9.0f, 5.2f);
    build_tree(w, 1, 10.0f, 8.5f, 4.6f);
    build_tree(w, 2, -10.0f, -8.5f, 5.6f);
    build_tree(w, 4, 9.5f, -9.0f, 5.0f);
    build_tree(w, 5, -16.5f, -13.5f, 6.5f);
    build_tree(w, 6, 16.0f, -15.0f, 7.0f);
    build_tree(w, 7, 3.0f, -19.0f, 6.0f);
    build_fountain(w);
    for (int quarter = 0; quarter < 4; quarter++) { /* lawns with hedges and flowers, benches and lamps */
        world_place(w, 0, 0, 0, 0.785398f + 1.570796f * (float)quarter);
        static const float lawn[][2] = {
            {1.25f, 0.0f}, {1.25f, 0.07f}, {1.25f, 0.07f}, {0.7f, 0.09f}, {0.0f, 0.1f}};
        const float turn_rad = 0.785398f + 1.570796f * (float)quarter, c = cosf(turn_rad), s = sinf(turn_rad);
        world_place(w, 4.7f * c, 4.7f * s, 0, turn_rad);
        world_revolve(w, GRASS, 0, lawn, sizeof lawn / sizeof lawn[0], 32);
        world_blob(w, HEDGE, quarter, (const float[3]){0, 0, 0.35f}, 0.55f, 0.9f, 0.18f, 4, 32);
        for (int i = 0; i < 6; i++)
            world_blob(
                w, FLOWERS, i,
                (const float[3]){0.9f * cosf(1.047f * (float)i), 0.9f * sinf(1.047f * (float)i), 0.12f},
                0.22f, 0.7f, 0.2f, 4, 14);
        const float t = turn_rad - 0.785398f, bc = cosf(t), bs = sinf(t);
        world_place(w, 5.4f * bc, 5.4f * bs, 0, t - 1.570796f);
        for (int slat = 0; slat < 3; slat++) {
            box(w, BENCH, slat, 0, -0.16f + 0.16f * (float)slat, 0.46f, 0.85f, 0.065f, 0.025f, 0.3f);
            box(w, BENCH, slat, 0, 0.24f + 0.02f * (float)slat, 0.58f + 0.16f * (float)slat, 0.85f, 0.02f,
                0.06f, 0.3f);
        }
        for (int side = -1; side <= 1; side += 2)
            box(w, IRON, 0, 0.7f * (float)side, 0, 0.22f, 0.04f, 0.2f, 0.22f, 0.3f);
        world_place(w, 7.4f * cosf(t + 0.4f), 7.4f * sinf(t + 0.4f), 0, 0);
        static const float foot[][2] = {{0.18f, 0.0f},  {0.16f, 0.3f}, {0.06f, 0.45f},
                                        {0.045f, 2.6f}, {0.12f, 2.7f}, {0.0f, 2.72f}};
        static const float cap[][2] = {{0.22f, 3.08f}, {0.16f, 3.16f}, {0.03f, 3.26f}, {0.0f, 3.36f}};
        world_revolve(w, IRON, 0, foot, sizeof foot / sizeof foot[0], 16);
        world_ball(w, LAMP_GLASS, 0, (const float[3]){0, 0, 2.9f}, 0.20f, 20);
        world_revolve(w, IRON, 0, cap, sizeof cap / sizeof cap[0], 16);
    }
    world_place(w, 0, 0, 0, 0);
}

const recipe recipe_courtyard = {
    .name = "courtyard",
    .summary = "a town square: fountain, facades, trees, a fence, hills and sky",
    .about = "A town square under a low, warm sun. A stone fountain with rippled water and bronze balls that "
             "mirror a little stands on rings of setts, between lawns, flower beds, benches and street "
             "lamps. Painted and brick facades with windows, shutters, awnings and tiled roofs close three "
             "sides; the fourth is open over an iron fence to hills and a sky dome with clouds. The dome is "
             "a sphere of 95 units around the square, so the sky has depth and sparse points too.",
    .build = build,
    .rings = {{7.6f, 2.1f}, {9.4f, 3.8f}},
    .target = {0, 0, 1.55f},
    .jitter = 0.15f,
    .focal_widths = 0.78f,
    .bake_rays = 64,
};
