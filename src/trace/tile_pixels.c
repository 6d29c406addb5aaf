/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_pixels.c -- the pixels of a tile: packets of 4 x 4, whole ones four pixels at a time. */
#include "trace/tile_pixels.h"

#include <math.h>
#include <string.h>

#include "trace/triples.h"

enum { ALL_LANES = (1 << PACKET_LANES) - 1 };

/* Pixel of a lane; false when it lies outside the image. */
static bool lane_pixel(const ray_image *rays, int x0, int y0, int packet, int lane, size_t *out)
{
    const int x = x0 + packet % TILE_ACROSS * PACKET_PIXELS + lane % PACKET_PIXELS;
    const int y = y0 + packet / TILE_ACROSS * PACKET_PIXELS + lane / PACKET_PIXELS;
    *out = (size_t)y * (size_t)rays->width + (size_t)x;
    return x < rays->width && y < rays->height;
}

/* First pixel of a packet all of whose pixels lie in the image; false for others. */
static bool packet_pixel(const ray_image *rays, int x0, int y0, int packet, size_t *out)
{
    const int x = x0 + packet % TILE_ACROSS * PACKET_PIXELS, y = y0 + packet / TILE_ACROSS * PACKET_PIXELS;
    *out = (size_t)y * (size_t)rays->width + (size_t)x;
    return x + PACKET_PIXELS <= rays->width && y + PACKET_PIXELS <= rays->height;
}

/* Loads a ray into its lane, which stays inactive if the ray is not valid or no part of it is to be
   traced. */
static void load_ray(const ray_image *rays, size_t at, int lane, packet_rays *p)
{
    const float *d = rays->dir + 3 * at, *o = ray_image_origin(rays, at);
    if (!ray_is_sound(o, d))
        return;
    for (int axis = 0; axis < 3; axis++) {
        p->dir[axis][lane] = d[axis];
        p->origin[axis][lane] = o[axis];
    }
    p->far[lane] = rays->far == NULL ? INFINITY : rays->far[at];
    if (rays->near != NULL) {
        p->near[lane] = rays->near[at];
        p->T_front[lane] = rays->T_front[at];
        if (!(p->near[lane] < p->far[lane]))
            return;
    }
    p->active |= 1u << lane;
}

/* The common case: all pixels in the image, rays from one point, no limits to their length. */
static void load_whole_packet(const ray_image *rays, size_t first, packet_rays *p)
{
    const float *o = rays->origin;
    const bool here = ray_origin_is_sound(o);
    const four_ints lane_bits = {1, 2, 4, 8};
    four_ints sound = {0, 0, 0, 0};
    for (int row = 0; row < PACKET_PIXELS; row++) {
        four_floats d[3];
        load_triples(rays->dir + 3 * (first + (size_t)row * (size_t)rays->width), d);
        for (int axis = 0; axis < 3; axis++)
            four_store(p->dir[axis] + PACKET_PIXELS * row, d[axis]);
        const four_floats square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        sound |= RAY_SQUARE_IS_SOUND(square) & (lane_bits << (PACKET_PIXELS * row));
    }
    for (int axis = 0; axis < 3; axis++)
        for (int lane = 0; lane < PACKET_LANES; lane++)
            p->origin[axis][lane] = o[axis];
    for (int lane = 0; lane < PACKET_LANES; lane++)
        p->far[lane] = INFINITY;
    p->active = here ? (unsigned)(sound[0] | sound[1] | sound[2] | sound[3]) : 0;
}

/* Lanes that are not active repeat one that is. */
static void repeat_active(packet_rays *p, bool parts)
{
    const int first = __builtin_ctz(p->active);
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        if (p->active >> lane & 1)
            continue;
        for (int axis = 0; axis < 3; axis++) {
            p->dir[axis][lane] = p->dir[axis][first];
            p->origin[axis][lane] = p->origin[axis][first];
        }
        p->far[lane] = p->far[first];
        if (parts) {
            p->near[lane] = p->near[first];
            p->T_front[lane] = p->T_front[first];
        }
    }
}

/* Leaves active only the rays that belong to this part of the tile; `other_part`: the other pixels. */
static void keep_part(const list_view *view, const list_part *part, packet_rays *p, uint16_t *other_part)
{
    unsigned own = part->first ? ~p->active : 0;
    for (int lane = 0; lane < PACKET_LANES; lane++) {
        const float d[3] = {p->dir[0][lane], p->dir[1][lane], p->dir[2][lane]};
        if (p->active >> lane & 1 && part_has_ray(view, part, d))
            own |= 1u << lane;
    }
    *other_part = (uint16_t)~own;
    p->active &= own;
}

void tile_load_rays(const ray_image *rays, const trace_settings *s, int x0, int y0, const list_view *view,
                    const list_part *part, tile_rays *out)
{
    out->common_origin = rays->common_origin;
    out->parts = rays->near != NULL;
    for (int packet = 0; packet < TILE_PACKETS; packet++) {
        packet_rays *p = &out->packet[packet];
        size_t at;
        p->active = 0;
        if (packet_pixel(rays, x0, y0, packet, &at) && rays->common_origin && rays->far == NULL &&
            rays->near == NULL)
            load_whole_packet(rays, at, p);
        else
            for (int lane = 0; lane < PACKET_LANES; lane++)
                if (lane_pixel(rays, x0, y0, packet, lane, &at))
                    load_ray(rays, at, lane, p);
        out->other_part[packet] = 0;
        if (part != NULL && !part->whole)
            keep_part(view, part, p, &out->other_part[packet]);
        if (p->active != 0 && p->active != ALL_LANES)
            repeat_active(p, out->parts);
        if (p->active != 0)
            sky_colors(&s->sky, s->background, p->dir, p->background);
    }
}

/* The background of a pixel without a ray: the one colour, cut to [0, 1] where there is a sky, or the ground
   below it. */
static float plain_background(const trace_settings *s, size_t c)
{
    const float color = s->sky.varies && s->sky.has_horizon ? s->sky.ground[c] : s->background[c];
    return !s->sky.varies ? color : color < 0 ? 0 : color > 1 ? 1 : color;
}

/* `o` NULL: the pixel has no ray. */
static void store_pixel(const ray_image *rays, const kernel_scene *scene, const trace_outputs *out, size_t at,
                        const packet_output *o, int lane)
{
    const float T_front = rays->near != NULL ? rays->T_front[at] : 1;
    for (size_t c = 0; c < 3; c++)
        out->rgb->pixels[3 * at + c] =
            o == NULL ? T_front * plain_background(&scene->settings, c) : o->rgb[c][lane];
    if (out->transmittance != NULL)
        out->transmittance[at] = o == NULL ? T_front : o->transmittance[lane];
    if (out->ended != NULL)
        out->ended[at] = o != NULL && (o->ended >> lane & 1) != 0;
    if (!scene->extra)
        return;
    if (out->depth != NULL)
        out->depth[at] = o != NULL && o->weight[lane] > 0 ? o->weighted_depth[lane] / o->weight[lane] : 0;
    if (out->median_depth != NULL)
        out->median_depth[at] = o != NULL && isfinite(o->median_depth[lane]) ? o->median_depth[lane] : 0;
    for (size_t k = 0; k < 3 && out->normal != NULL; k++)
        out->normal[3 * at + k] = o == NULL ? 0 : o->normal[k][lane];
    if (out->hit_count != NULL)
        out->hit_count[at] = o == NULL ? 0 : o->hit_count[lane];
    if (out->strongest != NULL)
        out->strongest[at] = o == NULL ? UINT32_MAX : o->strongest[lane];
}

static void store_colors(const image *rgb_image, size_t first, const packet_output *o)
{
    for (int row = 0; row < PACKET_PIXELS; row++) {
        four_floats rgb[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = four_load(o->rgb[c] + PACKET_PIXELS * row);
        store_triples(rgb, rgb_image->pixels + 3 * (first + (size_t)row * (size_t)rgb_image->width));
    }
}

void tile_store_pixels(const ray_image *rays, const kernel_scene *scene, const trace_outputs *to, int x0,
                       int y0, const tile_rays *tile, const packet_output out[TILE_PACKETS])
{
    const bool color_alone = !scene->extra && to->transmittance == NULL && to->ended == NULL;
    for (int packet = 0; packet < TILE_PACKETS; packet++) {
        const unsigned active = tile->packet[packet].active;
        size_t at;
        if (packet_pixel(rays, x0, y0, packet, &at) && color_alone && active == ALL_LANES) {
            store_colors(to->rgb, at, &out[packet]);
            continue;
        }
        for (int lane = 0; lane < PACKET_LANES; lane++)
            if (lane_pixel(rays, x0, y0, packet, lane, &at) && !(tile->other_part[packet] >> lane & 1))
                store_pixel(rays, scene, to, at, active >> lane & 1 ? &out[packet] : NULL, lane);
    }
}

static void load_packet_gradients(const image *d_image, size_t first, float d_rgb[3][PACKET_LANES])
{
    for (int row = 0; row < PACKET_PIXELS; row++) {
        four_floats d[3];
        load_triples(d_image->pixels + 3 * (first + (size_t)row * (size_t)d_image->width), d);
        for (int c = 0; c < 3; c++)
            four_store(d_rgb[c] + PACKET_PIXELS * row, d[c]);
    }
}

void tile_load_gradients(const ray_image *rays, const image *d_image, int x0, int y0, const tile_rays *tile,
                         float d_rgb[TILE_PACKETS][3][PACKET_LANES])
{
    for (int packet = 0; packet < TILE_PACKETS; packet++) {
        const unsigned active = tile->packet[packet].active;
        size_t at;
        if (packet_pixel(rays, x0, y0, packet, &at) && active == ALL_LANES) {
            load_packet_gradients(d_image, at, d_rgb[packet]);
            continue;
        }
        memset(d_rgb[packet], 0, sizeof d_rgb[packet]);
        for (int lane = 0; lane < PACKET_LANES; lane++) {
            if (!(active >> lane & 1) || !lane_pixel(rays, x0, y0, packet, lane, &at))
                continue;
            for (int c = 0; c < 3; c++)
                d_rgb[packet][c][lane] = d_image->pixels[3 * at + (size_t)c];
        }
    }
}
