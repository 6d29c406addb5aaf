/* SPDX-License-Identifier: Apache-2.0 */
/* trace/tile_pixels.h -- between an image and the packets of one of its tiles: rays in, pixels out, gradients
   of pixels in. (x0, y0) is a tile's first pixel; tiles at the border may reach beyond the image. */
#ifndef GBT_TRACE_TILE_PIXELS_H
#define GBT_TRACE_TILE_PIXELS_H

#include "trace/kernel.h"
#include "trace/list_view.h"
#include "trace/trace.h"

/** Rays of a tile, or of a part of it (NULL: all); lanes outside the image or without a ray are not active.
 */
void tile_load_rays(const ray_image *rays, const trace_settings *s, int x0, int y0, const list_view *view,
                    const list_part *part, tile_rays *out);

/** Writes what was traced into the pictures that `to` asks for. A pixel without a ray becomes the background;
    pixels that belong to another part of the tile are not written. */
void tile_store_pixels(const ray_image *rays, const kernel_scene *scene, const trace_outputs *to, int x0,
                       int y0, const tile_rays *tile, const packet_output out[TILE_PACKETS]);

/** dL/d(rgb) of the tile's rays, 0 for lanes without one. */
void tile_load_gradients(const ray_image *rays, const image *d_image, int x0, int y0, const tile_rays *tile,
                         float d_rgb[TILE_PACKETS][3][PACKET_LANES]);

#endif
