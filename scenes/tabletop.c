/* SPDX-License-Identifier: Apache-2.0 */
/* scenes/tabletop.c -- a laid table in a furnished room: matt, glossy, thin and lettered things under one
   warm lamp. */
#include <math.h>
#include <string.h>

#include "scenes/place.h"
#include "scenes/recipe.h"
#include "scenes/texture.h"

enum {
    FLOOR,
    RUG,
    BRICK_WALL,
    PAPER_WALL,
    PLASTER_WALL,
    PANEL_WALL,
    WOOD,
    TABLE_TOP,
    PICTURE,
    WINDOW,
    BOOK,
    CLOTH,
    GLOBE,
    BRASS,
    CERAMIC,
    LETTER_BLOCK,
    WIRE,
    FRUIT,
    VASE,
    LEAF,
    POT,
    WHITE_PAINT,
    CURTAIN,
    SOIL,
    CUP
};

static const float room = 2.7f, room_height = 2.7f,
                   top = 0.76f; /* half the room's side; its height; the table's surface */

static float between(float value, float low, float high) { return value >= low && value < high; }

/** A hill landscape under a big sun, for u and v in [-1, 1]. */
static void paint_picture(float u, float v, int variant, float out[3])
{
    static const float skies[3][3] = {{0.95f, 0.72f, 0.38f}, {0.45f, 0.70f, 0.85f}, {0.90f, 0.86f, 0.72f}};
    static const float hills[3][3] = {{0.36f, 0.16f, 0.22f}, {0.12f, 0.34f, 0.24f}, {0.72f, 0.30f, 0.16f}};
    const int kind = variant % 3;
    texture_mix(out, skies[kind], (const float[3]){0.95f, 0.92f, 0.85f}, 0.5f - 0.5f * v);
    if (hypotf(u - 0.35f, v - 0.35f) < 0.26f)
        set(out, 0.92f, 0.36f, 0.16f);
    for (int layer = 0; layer < 3; layer++) {
        const float crest =
            0.05f - 0.32f * (float)layer +
            0.22f * texture_noise(1.7f * u + 9.1f * (float)layer, 4.0f * (float)variant, 0.5f);
        if (v < crest) {
            memcpy(out, hills[kind], 3 * sizeof *out);
            texture_scale(out, 1.35f - 0.4f * (float)layer);
        }
    }
}

static void look_at_floor(const surface *s, look *l)
{
    const float *p = s->position;
    const int i = (int)floorf(p[0] / 0.45f), j = (int)floorf(p[1] / 0.45f);
    const float in_x = p[0] / 0.45f - (float)i, in_y = p[1] / 0.45f - (float)j;
    const float shade = 0.85f + 0.2f * texture_hash(i, j, 3) + 0.10f * texture_fbm(5 * p[0], 5 * p[1], 0, 2);
    if (((i + j) & 1) != 0)
        set(l->albedo, 0.62f, 0.30f, 0.18f);
    else
        set(l->albedo, 0.74f, 0.66f, 0.52f);
    texture_scale(l->albedo, shade);
    if (fminf(fminf(in_x, 1 - in_x), fminf(in_y, 1 - in_y)) < 0.025f)
        set(l->albedo, 0.36f, 0.32f, 0.28f);
    l->specular = 0.03f;
    l->shininess = 60;
}

static void look_at_rug(const surface *s, look *l)
{
    const float *p = s->position;
    const float r = hypotf(p[0], p[1]), angle = (float)atan2(p[1], p[0]);
    const float wave = r + 0.035f * sinf(12 * angle);
    if (wave < 0.42f)
        set(l->albedo, 0.78f, 0.68f, 0.46f);
    else if (wave < 0.75f)
        set(l->albedo, 0.16f, 0.26f, 0.42f);
    else if (wave < 0.95f)
        set(l->albedo, 0.80f, 0.72f, 0.52f);
    else if (wave < 1.12f)
        set(l->albedo, 0.62f, 0.18f, 0.14f);
    else
        set(l->albedo, 0.14f, 0.22f, 0.36f);
    texture_scale(l->albedo, 1 + 0.16f * texture_noise(40 * p[0], 40 * p[1], 0));
}

static void look_at_brick_wall(const surface *s, look *l)
{
    int id[2];
    const float *p = s->position, u = s->uv[0];
    const float edge = texture_brick(u, p[2], 0.34f, 0.125f, id);
    if (edge < 0.009f)
        set(l->albedo, 0.66f, 0.62f, 0.56f);
    else {
        texture_mix(l->albedo, (const float[3]){0.50f, 0.20f, 0.13f}, (const float[3]){0.68f, 0.36f, 0.24f},
                    texture_hash(id[0], id[1], 7));
        texture_scale(l->albedo, 1 + 0.14f * texture_fbm(9 * u, 14 * p[2], 2, 2));
    }
}

static void look_at_paper_wall(const surface *s, look *l)
{
    const float *p = s->position, u = s->uv[0];
    /* Wide stripes with a diamond on every dark one. */
    const float stripe = u / 0.30f - floorf(u / 0.30f);
    set(l->albedo, 0.60f, 0.68f, 0.58f);
    if (stripe < 0.5f) {
        set(l->albedo, 0.42f, 0.55f, 0.46f);
        const float height = p[2] / 0.30f - floorf(p[2] / 0.30f);
        if (fabsf(stripe - 0.25f) * 2 + fabsf(height - 0.5f) < 0.28f)
            set(l->albedo, 0.84f, 0.78f, 0.54f);
    }
    texture_scale(l->albedo, 1 + 0.04f * texture_fbm(3 * u, 3 * p[2], 4, 2));
}

static void look_at_plaster_wall(const surface *s, look *l)
{
    const float *p = s->position;
    set(l->albedo, 0.80f, 0.68f, 0.50f);
    texture_scale(l->albedo, 0.95f + 0.12f * texture_fbm(1.6f * p[0], 1.6f * p[1], 1.6f * p[2], 4));
}

static void look_at_panel_wall(const surface *s, look *l)
{
    const float *p = s->position, u = s->uv[0];
    const float board = u / 0.24f - floorf(u / 0.24f);
    const int number = (int)floorf(u / 0.24f);
    const float ring = texture_wood(0.7f * p[2] + 7 * texture_hash(number, 0, 1), board * 0.4f + 0.3f,
                                    0.2f + 0.3f * texture_hash(number, 1, 1));
    texture_mix(l->albedo, (const float[3]){0.34f, 0.42f, 0.50f}, (const float[3]){0.44f, 0.53f, 0.60f},
                ring);
    if (board < 0.05f)
        texture_scale(l->albedo, 0.45f);
}

static void look_at_wood(const surface *s, look *l)
{
    const float *p = s->position;
    const float plank = floorf(p[1] / 0.18f), offset = texture_hash((int)plank, 5, s->material);
    const float ring =
        texture_wood(1.1f * p[0] + 5 * offset, 1.6f * (p[1] - 0.18f * plank) + 0.25f + 0.2f * offset,
                     0.5f * p[2] + 0.3f * offset);
    texture_mix(l->albedo, (const float[3]){0.33f, 0.18f, 0.09f}, (const float[3]){0.60f, 0.37f, 0.19f},
                ring);
    if (s->material == TABLE_TOP) {
        texture_scale(l->albedo, 0.85f + 0.3f * offset);
        if (p[1] / 0.18f - plank < 0.025f && s->normal[2] > 0.5f)
            texture_scale(l->albedo, 0.5f);
    }
    l->specular = 0.03f;
    l->shininess = 40;
}

static void look_at_picture(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    paint_picture(u / 0.36f, v / 0.27f, s->variant, l->albedo);
}

static void look_at_window(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    /* A painted view; it gives light of its own, as daylight behind a pane would. */
    float out[3];
    texture_mix(out, (const float[3]){0.95f, 0.90f, 0.80f}, (const float[3]){0.42f, 0.66f, 0.95f},
                texture_step(-0.3f, 0.6f, v));
    const float cloud = texture_step(0.05f, 0.5f, texture_fbm(2.2f * u, 3.6f * v, 1, 3));
    texture_mix(out, out, (const float[3]){1, 1, 1}, 0.8f * cloud);
    if (v < -0.28f + 0.10f * texture_noise(2.1f * u, 0, 7))
        set(out, 0.30f, 0.48f, 0.34f);
    if (v < -0.40f + 0.08f * texture_noise(3.3f * u, 2, 3))
        set(out, 0.20f, 0.36f, 0.16f);
    for (int k = 0; k < 3; k++)
        l->emission[k] = 0.8f * out[k];
    set(l->albedo, 0.05f, 0.05f, 0.05f);
}

static void look_at_book(const surface *s, look *l)
{
    const float v = s->uv[1];
    const float hue = texture_hash(s->variant, 11, 0), tone = 0.7f + 0.5f * texture_hash(s->variant, 12, 0);
    static const float covers[6][3] = {{0.55f, 0.13f, 0.11f}, {0.13f, 0.28f, 0.46f}, {0.16f, 0.38f, 0.22f},
                                       {0.72f, 0.54f, 0.20f}, {0.40f, 0.20f, 0.38f}, {0.78f, 0.72f, 0.60f}};
    memcpy(l->albedo, covers[(int)(6 * hue) % 6], 3 * sizeof *l->albedo);
    texture_scale(l->albedo, tone);
    if (between(fabsf(v), 0.075f, 0.092f))
        set(l->albedo, 0.85f, 0.72f, 0.36f);
    l->specular = 0.03f;
    l->shininess = 30;
}

static void look_at_cloth(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    const float stripe = fabsf(v) / 0.30f;
    set(l->albedo, 0.84f, 0.80f, 0.70f);
    if (between(stripe, 0.80f, 0.93f) || between(stripe, 0.30f, 0.38f))
        set(l->albedo, 0.66f, 0.16f, 0.14f);
    else if (between(stripe, 0.62f, 0.74f))
        set(l->albedo, 0.18f, 0.32f, 0.44f);
    const float cross = u / 0.16f - floorf(u / 0.16f);
    if (stripe < 0.26f && fabsf(cross - 0.5f) + stripe / 0.5f < 0.36f)
        set(l->albedo, 0.20f, 0.40f, 0.36f);
    texture_scale(l->albedo, 1 + 0.08f * texture_noise(55 * u, 55 * v, 0));
}

static void look_at_globe(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    /* Continents in the globe's own turned frame; parallels every 30 degrees. */
    const float angle = 6.2831853f * u, height = -cosf(v / 0.17f);
    const float ring = sqrtf(fmaxf(0, 1 - height * height)), x = ring * cosf(angle), y = ring * sinf(angle);
    const float land = texture_fbm(1.7f * x + 3.1f, 1.7f * y + 1.4f, 1.7f * height + 5.2f, 4);
    if (land > -0.04f) {
        texture_mix(l->albedo, (const float[3]){0.36f, 0.52f, 0.20f}, (const float[3]){0.76f, 0.60f, 0.34f},
                    texture_step(-0.04f, 0.30f, land));
    } else {
        texture_mix(l->albedo, (const float[3]){0.08f, 0.22f, 0.44f}, (const float[3]){0.24f, 0.52f, 0.66f},
                    texture_step(-0.45f, -0.04f, land));
    }
    if (fabsf(height) > 0.88f + 0.04f * texture_noise(4 * x, 4 * y, 0))
        set(l->albedo, 0.88f, 0.90f, 0.90f);
}

static void look_at_brass(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.60f, 0.42f, 0.16f);
    l->specular = 0.18f;
    l->shininess = 50;
}

static void look_at_ceramic(const surface *s, look *l)
{
    const float u = s->uv[0];
    static const float glazes[3][3] = {{0.62f, 0.08f, 0.06f}, {0.06f, 0.22f, 0.48f}, {0.10f, 0.40f, 0.30f}};
    memcpy(l->albedo, glazes[s->variant % 3], 3 * sizeof *l->albedo);
    if (s->variant == 0 && ((int)floorf(24 * u) & 3) == 0)
        set(l->albedo, 0.82f, 0.70f, 0.44f);
    l->specular = 0.05f;
    l->shininess = 90;
    l->mirror = true;
    l->roughness = 0.05f;
}

static void look_at_letter_block(const surface *s, look *l)
{
    const float *p = s->position, u = s->uv[0], v = s->uv[1];
    /* Faces tell themselves apart by where they look; letters run round the block. */
    static const char letters[6] = {'G', 'B', 'T', 'A', 'R', '3'};
    static const float inks[5][3] = {{0.70f, 0.12f, 0.10f},
                                     {0.10f, 0.28f, 0.58f},
                                     {0.12f, 0.45f, 0.22f},
                                     {0.82f, 0.50f, 0.10f},
                                     {0.42f, 0.16f, 0.46f}};
    const float half = 0.075f, a = u / half, b = v / half;
    const int side = s->normal[2] > 0.5f
                         ? 4
                         : (int)floorf(((float)atan2(s->normal[1], s->normal[0]) + 6.6f) / 1.5708f) & 3;
    const float *ink = inks[(s->variant + side) % 5];
    set(l->albedo, 0.86f, 0.76f, 0.56f);
    texture_scale(l->albedo, 1 + 0.08f * texture_noise(12 * p[0], 12 * p[1], 60 * p[2]));
    if (fmaxf(fabsf(a), fabsf(b)) > 0.80f ||
        texture_glyph(letters[(s->variant + side) % 6], (a + 0.5f), (b + 0.6f) / 1.2f))
        memcpy(l->albedo, ink, 3 * sizeof *l->albedo);
    l->specular = 0.03f;
    l->shininess = 30;
}

static void look_at_wire(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.12f, 0.12f, 0.13f);
    l->specular = 0.08f;
    l->shininess = 25;
}

static void look_at_fruit(const surface *s, look *l)
{
    const float *p = s->position;
    if (s->variant % 2 == 0)
        texture_mix(l->albedo, (const float[3]){0.86f, 0.42f, 0.06f}, (const float[3]){0.92f, 0.58f, 0.12f},
                    0.5f + 0.5f * texture_fbm(16 * p[0], 16 * p[1], 16 * p[2], 2));
    else
        texture_mix(l->albedo, (const float[3]){0.62f, 0.10f, 0.07f}, (const float[3]){0.70f, 0.62f, 0.16f},
                    texture_step(0.1f, 0.6f, texture_fbm(9 * p[0], 9 * p[1], 9 * p[2], 2)));
    l->specular = 0.04f;
    l->shininess = 35;
}

static void look_at_vase(const surface *s, look *l)
{
    const float u = s->uv[0], v = s->uv[1];
    const float band =
        v / 0.055f + 0.35f * sinf(6.2831853f * 8 * u) * (((int)(v / 0.11f) & 1) != 0 ? 1.0f : 0.0f);
    set(l->albedo, 0.86f, 0.84f, 0.78f);
    if (((int)floorf(band) & 1) != 0)
        set(l->albedo, 0.12f, 0.24f, 0.46f);
    l->specular = 0.05f;
    l->shininess = 70;
}

static void look_at_leaf(const surface *s, look *l)
{
    const float u = s->uv[0];
    const float tone = texture_hash(s->variant, 21, 0);
    texture_mix(l->albedo, (const float[3]){0.14f, 0.34f, 0.10f}, (const float[3]){0.36f, 0.52f, 0.16f},
                tone);
    if (fabsf(u) < 0.06f)
        texture_scale(l->albedo, 1.5f);
    l->specular = 0.03f;
    l->shininess = 20;
}

static void look_at_pot(const surface *s, look *l)
{
    const float *p = s->position, u = s->uv[0], v = s->uv[1];
    set(l->albedo, 0.64f, 0.34f, 0.20f);
    if (v > 0.30f && ((int)floorf(20 * u + 0.5f) & 1) != 0)
        set(l->albedo, 0.82f, 0.70f, 0.50f);
    texture_scale(l->albedo, 1 + 0.12f * texture_fbm(9 * p[0], 9 * p[1], 9 * p[2], 2));
}

static void look_at_white_paint(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.82f, 0.80f, 0.74f);
}

static void look_at_curtain(const surface *s, look *l)
{
    const float u = s->uv[0];
    const float fold = sinf(38 * u);
    texture_mix(l->albedo, (const float[3]){0.56f, 0.16f, 0.13f}, (const float[3]){0.78f, 0.30f, 0.20f},
                0.5f + 0.5f * fold);
}

static void look_at_soil(const surface *s, look *l)
{
    (void)s;
    set(l->albedo, 0.16f, 0.11f, 0.08f);
}

static void look_at_cup(const surface *s, look *l)
{
    const float v = s->uv[1];
    set(l->albedo, 0.84f, 0.82f, 0.76f);
    if (between(v, 0.125f, 0.15f) || between(v, 0.075f, 0.085f))
        set(l->albedo, 0.10f, 0.45f, 0.45f);
    l->specular = 0.05f;
    l->shininess = 80;
}

static void look_at_room(const surface *s, look *l)
{
    static look_fn *const looks[] = {
        [FLOOR] = look_at_floor,
        [RUG] = look_at_rug,
        [BRICK_WALL] = look_at_brick_wall,
        [PAPER_WALL] = look_at_paper_wall,
        [PLASTER_WALL] = look_at_plaster_wall,
        [PANEL_WALL] = look_at_panel_wall,
        [WOOD] = look_at_wood,
        [TABLE_TOP] = look_at_wood,
        [PICTURE] = look_at_picture,
        [WINDOW] = look_at_window,
        [BOOK] = look_at_book,
        [CLOTH] = look_at_cloth,
        [GLOBE] = look_at_globe,
        [BRASS] = look_at_brass,
        [CERAMIC] = look_at_ceramic,
        [LETTER_BLOCK] = look_at_letter_block,
        [WIRE] = look_at_wire,
        [FRUIT] = look_at_fruit,
        [VASE] = look_at_vase,
        [LEAF] = look_at_leaf,
        [POT] = look_at_pot,
        [WHITE_PAINT] = look_at_white_paint,
        [CURTAIN] = look_at_curtain,
        [SOIL] = look_at_soil,
        [CUP] = look_at_cup,
    };
    looks[s->material](s, l);
}

/** A leaf: a strip of `width` that rises from the origin towards `angle` and bends over. */
static void leaf(world *w, int variant, float x, float y, float z, float angle, float length, float width,
                 float rise)
{
    enum { STEPS = 8 };
    const float c = cosf(angle), s = sinf(angle);
    uint32_t last[3] = {0};
    for (int i = 0; i <= STEPS; i++) {
        const float t = (float)i / STEPS, out = length * t, up = rise * t * (1.6f - 1.25f * t),
                    half = width * sinf(3.0f * (0.06f + 0.94f * t));
        const float slope = rise * (1.6f - 2.5f * t) / length;
        const float normal[3] = {-slope * c, -slope * s, 1};
        uint32_t row[3];
        for (int k = 0; k < 3; k++) {
            const float side = (float)(k - 1) * half, fold = k == 1 ? 0 : 0.25f * half;
            row[k] = world_vertex(
                w, (const float[3]){x + out * c - side * s, y + out * s + side * c, z + up + fold}, normal,
                (float)(k - 1) * 0.5f, t);
        }
        for (int k = 0; k < 2 && i > 0; k++) {
            world_triangle(w, LEAF, variant, last[k], row[k], row[k + 1]);
            world_triangle(w, LEAF, variant, last[k], row[k + 1], last[k + 1]);
        }
        memcpy(last, row, sizeof last);
    }
}

static void build_walls(world *w)
{
    static const int walls[4] = {BRICK_WALL, PAPER_WALL, PLASTER_WALL, PANEL_WALL};
    for (int i = 0; i < 4; i++) {
        /* Each wall stands at y = +room of its own turned frame and faces -y. */
        world_place(w, 0, 0, 0, -1.57079633f * (float)i);
        const float corner[3] = {-room, room, 0}, along[3] = {2 * room, 0, 0}, up[3] = {0, 0, room_height};
        world_sheet(w, walls[i], 0, corner, along, up, 0.09f);
        box(w, WHITE_PAINT, 0, 0, room - 0.015f, 0.06f, room, 0.015f, 0.06f, 0.15f);
        if (walls[i] == BRICK_WALL)
            for (int k = 0; k < 3; k++) {
                const float x = -1.55f + 1.55f * (float)k, z = 1.45f + 0.1f * (float)(k % 2);
                box(w, WOOD, 0, x, room - 0.02f, z, 0.41f, 0.02f, 0.32f, 0.15f);
                world_sheet(w, PICTURE, k, (const float[3]){x - 0.36f, room - 0.041f, z - 0.27f},
                            (const float[3]){0.72f, 0, 0}, (const float[3]){0, 0, 0.54f}, 0.15f);
            }
        if (walls[i] == PAPER_WALL)
            for (int shelf = 0; shelf < 3; shelf++) { /* books on three boards */
                const float z = 0.55f + 0.50f * (float)shelf;
                box(w, WOOD, shelf, 0.1f, room - 0.14f, z, 1.25f, 0.14f, 0.02f, 0.12f);
                float x = -1.1f;
                for (int book = 0; x < 1.2f; book++) {
                    const int number = 40 * shelf + book;
                    const float half = 0.028f + 0.030f * texture_hash(number, 1, 9),
                                high = 0.14f + 0.07f * texture_hash(number, 2, 9);
                    if (texture_hash(number, 3, 9) > 0.16f)
                        box(w, BOOK, number, x + half, room - 0.13f, z + 0.02f + high, half - 0.002f, 0.11f,
                            high, 0.12f);
                    x += 2 * half;
                }
            }
        if (walls[i] == PLASTER_WALL) {
            const float z = 1.40f;
            world_sheet(w, WINDOW, 0, (const float[3]){-0.8f, room - 0.01f, z - 0.6f},
                        (const float[3]){1.6f, 0, 0}, (const float[3]){0, 0, 1.2f}, 0.2f);
            for (int k = -1; k <= 1; k++) {
                box(w, WHITE_PAINT, 0, 0.8f * (float)k, room - 0.04f, z, 0.035f, 0.04f, 0.64f, 0.15f);
                box(w, WHITE_PAINT, 0, 0, room - 0.04f, z + 0.6f * (float)k, 0.835f, 0.039f, 0.035f, 0.15f);
            }
            box(w, WHITE_PAINT, 0, 0, room - 0.08f, z - 0.66f, 0.95f, 0.08f, 0.025f, 0.15f);
            for (int side = -1; side <= 1; side += 2)
                box(w, CURTAIN, 0, 1.12f * (float)side, room - 0.07f, z - 0.05f, 0.26f, 0.03f, 0.92f, 0.10f);
            tube(w, BRASS, -1.5f, room - 0.07f, z + 0.9f, 1.5f, room - 0.07f, z + 0.9f, 0.02f);
        }
        if (walls[i] == PANEL_WALL) {
            box(w, WOOD, 0, -0.5f, room - 0.22f, 0.80f, 0.75f, 0.22f, 0.03f, 0.12f); /* a side table with pots
                                                                                      */
            for (int leg = 0; leg < 4; leg++)
                box(w, WOOD, 0, -0.5f + ((leg & 1) != 0 ? 0.68f : -0.68f),
                    room - 0.22f + ((leg & 2) != 0 ? 0.16f : -0.16f), 0.385f, 0.03f, 0.03f, 0.385f, 0.12f);
            static const float jar[][2] = {{0.0f, 0.83f},  {0.09f, 0.83f},  {0.13f, 0.93f}, {0.12f, 1.03f},
                                           {0.06f, 1.12f}, {0.075f, 1.16f}, {0.05f, 1.16f}};
            for (int k = 0; k < 3; k++) {
                const float c = cosf(-1.57079633f * (float)i), s = sinf(-1.57079633f * (float)i);
                const float x = -0.98f + 0.48f * (float)k, y = room - 0.22f;
                world_place(w, c * x - s * y, s * x + c * y, 0, 0);
                world_revolve(w, CERAMIC, k, jar, sizeof jar / sizeof jar[0], 28);
            }
            world_place(w, 0, 0, 0, -1.57079633f * (float)i);
            box(w, WOOD, 0, 1.25f, room - 0.02f, 1.45f, 0.41f, 0.02f, 0.32f, 0.15f);
            world_sheet(w, PICTURE, 4, (const float[3]){0.89f, room - 0.041f, 1.18f},
                        (const float[3]){0.72f, 0, 0}, (const float[3]){0, 0, 0.54f}, 0.15f);
        }
    }
    world_place(w, 0, 0, 0, 0);
}

static void build_plant(world *w, float x, float y)
{
    static const float pot[][2] = {{0.0f, 0.0f},   {0.14f, 0.0f},  {0.14f, 0.0f},  {0.20f, 0.34f},
                                   {0.20f, 0.34f}, {0.22f, 0.34f}, {0.22f, 0.40f}, {0.22f, 0.40f},
                                   {0.18f, 0.40f}, {0.17f, 0.34f}};
    static const float soil[][2] = {{0.175f, 0.36f}, {0.0f, 0.37f}};
    world_place(w, x, y, 0, 0);
    world_revolve(w, POT, 0, pot, sizeof pot / sizeof pot[0], 28);
    world_revolve(w, SOIL, 0, soil, 2, 28);
    for (int i = 0; i < 22; i++) {
        const float r = texture_hash(i, 31, 0), q = texture_hash(i, 32, 0);
        leaf(w, i, 0, 0, 0.37f, 2.399963f * (float)i, 0.25f + 0.30f * r, 0.055f + 0.02f * q,
             0.35f + 0.75f * q);
    }
    world_place(w, 0, 0, 0, 0);
}

static void build_table(world *w)
{
    box(w, TABLE_TOP, 0, 0, 0, top - 0.02f, 0.80f, 0.58f, 0.02f, 0.04f);
    box(w, WOOD, 1, 0, 0, top - 0.08f, 0.70f, 0.48f, 0.04f, 0.08f);
    for (int leg = 0; leg < 4; leg++) {
        const float x = (leg & 1) != 0 ? 0.68f : -0.68f, y = (leg & 2) != 0 ? 0.46f : -0.46f;
        box(w, WOOD, 2, x, y, 0.36f, 0.035f, 0.035f, 0.36f, 0.08f);
    }
    /* The cloth lies across the table and hangs over both long edges. */
    world_sheet(w, CLOTH, 0, (const float[3]){-0.66f, -0.30f, top + 0.003f}, (const float[3]){1.32f, 0, 0},
                (const float[3]){0, 0.60f, 0}, 0.03f);

    world_place(w, -0.40f, 0.16f, top, 0.4f);
    static const float foot[][2] = {{0.11f, 0.003f}, {0.11f, 0.02f},  {0.11f, 0.02f},
                                    {0.03f, 0.045f}, {0.018f, 0.08f}, {0.018f, 0.09f}};
    world_revolve(w, BRASS, 0, foot, sizeof foot / sizeof foot[0], 28);
    world_ball(w, GLOBE, 0, (const float[3]){0, 0, 0.26f}, 0.17f, 48);
    for (int i = 0; i < 14; i++) { /* the half ring that holds the globe */
        const float a = -1.57f + 3.14159f * (float)i / 14, b = -1.57f + 3.14159f * (float)(i + 1) / 14;
        tube(w, BRASS, 0.19f * cosf(a), 0, 0.26f + 0.19f * sinf(a), 0.19f * cosf(b), 0,
             0.26f + 0.19f * sinf(b), 0.009f);
    }

    world_place(w, 0.40f, 0.17f, top, 0.5f);
    box(w, LETTER_BLOCK, 0, -0.09f, 0, 0.078f, 0.075f, 0.075f, 0.075f, 0.04f);
    world_place(w, 0.50f, 0.24f, top, 0.15f);
    box(w, LETTER_BLOCK, 1, 0.02f, 0, 0.078f, 0.075f, 0.075f, 0.075f, 0.04f);
    world_place(w, 0.42f, 0.21f, top, -0.3f);
    box(w, LETTER_BLOCK, 2, 0, 0, 0.228f, 0.075f, 0.075f, 0.075f, 0.04f);

    world_place(w, 0.36f, -0.24f, top, 0);
    world_torus(w, CERAMIC, (const float[3]){0, 0, 0.056f}, 0.12f, 0.052f, 56, 24);
    world_place(w, 0.60f, -0.08f, top, 0);
    world_ball(w, CERAMIC, 1, (const float[3]){0, 0, 0.088f}, 0.085f, 40);

    /* A wire basket: hoops, ribs and a handle, with fruit. */
    world_place(w, -0.30f, -0.26f, top, 0);
    enum { RIBS = 18, ARCS = 6 };
    for (int i = 0; i < RIBS; i++) {
        const float angle = 6.2831853f * (float)i / RIBS, next = 6.2831853f * (float)(i + 1) / RIBS;
        for (int k = 0; k < ARCS; k++) {
            const float a = (float)k / ARCS, b = (float)(k + 1) / ARCS;
            const float ra = 0.08f + 0.085f * sinf(1.5708f * a), rb = 0.08f + 0.085f * sinf(1.5708f * b),
                        za = 0.008f + 0.12f * a, zb = 0.008f + 0.12f * b;
            tube(w, WIRE, ra * cosf(angle), ra * sinf(angle), za, rb * cosf(angle), rb * sinf(angle), zb,
                 0.0028f);
            if (k % 3 == 2)
                tube(w, WIRE, rb * cosf(angle), rb * sinf(angle), zb, rb * cosf(next), rb * sinf(next), zb,
                     k == ARCS - 1 ? 0.006f : 0.0032f);
        }
    }
    for (int i = 0; i < 16; i++) {
        const float a = 3.14159f * (float)i / 16, b = 3.14159f * (float)(i + 1) / 16;
        tube(w, WIRE, 0.165f * cosf(a), 0, 0.128f + 0.17f * sinf(a), 0.165f * cosf(b), 0,
             0.128f + 0.17f * sinf(b), 0.005f);
    }
    static const float fruit[5][4] = {{-0.055f, 0.04f, 0.062f, 0.055f},
                                      {0.06f, 0.035f, 0.06f, 0.052f},
                                      {0.0f, -0.068f, 0.06f, 0.053f},
                                      {0.005f, 0.005f, 0.135f, 0.054f},
                                      {0.085f, -0.055f, 0.115f, 0.042f}};
    for (int i = 0; i < 5; i++)
        world_ball(w, FRUIT, i, fruit[i], fruit[i][3], 24);

    world_place(w, 0.04f, 0.28f, top, 0);
    static const float vase[][2] = {{0.0f, 0.003f}, {0.06f, 0.003f}, {0.06f, 0.003f},  {0.085f, 0.05f},
                                    {0.10f, 0.11f}, {0.095f, 0.16f}, {0.07f, 0.21f},   {0.045f, 0.25f},
                                    {0.04f, 0.28f}, {0.055f, 0.31f}, {0.048f, 0.312f}, {0.034f, 0.28f}};
    world_revolve(w, VASE, 0, vase, sizeof vase / sizeof vase[0], 40);
    for (int i = 0; i < 9; i++)
        leaf(w, 60 + i, 0, 0, 0.27f, 2.399963f * (float)i, 0.16f + 0.08f * texture_hash(i, 33, 0), 0.026f,
             0.22f + 0.3f * texture_hash(i, 34, 0));

    world_place(w, 0.02f, -0.10f, top, 0.25f); /* two books and a cup on them */
    box(w, BOOK, 200, 0, 0, 0.023f, 0.13f, 0.095f, 0.019f, 0.05f);
    world_place(w, 0.02f, -0.10f, top, -0.1f);
    box(w, BOOK, 203, 0, 0, 0.057f, 0.115f, 0.085f, 0.015f, 0.05f);
    static const float cup[][2] = {{0.0f, 0.074f},  {0.03f, 0.074f}, {0.03f, 0.074f},
                                   {0.042f, 0.10f}, {0.046f, 0.15f}, {0.046f, 0.15f},
                                   {0.041f, 0.15f}, {0.037f, 0.10f}, {0.0f, 0.085f}};
    world_revolve(w, CUP, 0, cup, sizeof cup / sizeof cup[0], 32);
    world_place(w, 0, 0, 0, 0);
}

static void build_chair(world *w, float x, float y, float turn_rad)
{
    world_place(w, x, y, 0, turn_rad);
    box(w, WOOD, 3, 0, 0, 0.44f, 0.21f, 0.21f, 0.02f, 0.06f);
    for (int leg = 0; leg < 4; leg++) {
        const float side = (leg & 1) != 0 ? 0.19f : -0.19f, depth = (leg & 2) != 0 ? 0.19f : -0.19f;
        box(w, WOOD, 3, side, depth, (leg & 2) != 0 ? 0.43f : 0.21f, 0.018f, 0.018f,
            (leg & 2) != 0 ? 0.43f : 0.21f, 0.08f);
    }
    for (int slat = 0; slat < 3; slat++)
        box(w, WOOD, 3, 0, 0.19f, 0.58f + 0.11f * (float)slat, 0.18f, 0.010f, 0.028f, 0.06f);
    world_place(w, 0, 0, 0, 0);
}

static void build(world *w)
{
    w->look = look_at_room;
    w->epsilon = 2e-4f;
    w->lamp = (light){.position = {1.5f, -1.3f, 3.3f},
                      .radius = 0.16f,
                      .color = {13.5f, 11.2f, 8.2f},
                      .exposure = 1.15f,
                      .sky_low = {0.34f, 0.38f, 0.44f},
                      .sky_high = {0.40f, 0.45f, 0.55f}};
    world_sheet(w, FLOOR, 0, (const float[3]){-room, -room, 0}, (const float[3]){2 * room, 0, 0},
                (const float[3]){0, 2 * room, 0}, 0.07f);
    static const float rug[][2] = {{1.3f, 0.0f},   {1.3f, 0.012f}, {1.3f, 0.012f}, {1.0f, 0.012f},
                                   {0.7f, 0.012f}, {0.4f, 0.012f}, {0.0f, 0.012f}};
    world_revolve(w, RUG, 0, rug, sizeof rug / sizeof rug[0], 64);
    build_walls(w);
    build_plant(w, 2.15f, 2.10f);
    build_plant(w, -2.20f, -2.15f);
    build_chair(w, -2.1f, 1.95f, 0.6f);
    build_chair(w, 2.05f, -2.0f, 3.9f);
    build_table(w);
}

const recipe recipe_tabletop = {
    .name = "tabletop",
    .summary = "a laid table in a furnished room: matt, glossy and thin things under a warm lamp",
    .about = "A wooden table in a furnished room. On a striped cloth: a matt globe on a brass foot, three "
             "letter blocks, a glazed ring and a glazed ball that mirror the room a little, a wire basket "
             "with fruit, a banded vase with leaves, books and a cup. The four walls (brick with pictures, "
             "wallpaper with a bookshelf, plaster with a window, painted boards) and the tiled floor with "
             "its rug fill the background of every photo. One warm lamp with a soft shadow, pale light from "
             "above, and one bounce of indirect light.",
    .build = build,
    .rings = {{1.62f, 1.42f}, {1.40f, 1.85f}},
    .target = {0, 0, 0.82f},
    .jitter = 0.04f,
    .focal_widths = 0.84f,
    .bake_rays = 64,
};
