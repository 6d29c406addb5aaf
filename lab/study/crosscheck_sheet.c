/* SPDX-License-Identifier: Apache-2.0 */
/* study/crosscheck_sheet.c -- all pictures of one view in one PNG, differences in the report's error colours.
 */
#include <math.h>

#include "base/fail.h"
#include "report/image.h"
#include "study/crosscheck.h"

enum { PANELS_ACROSS = 4, PANELS_DOWN = 2, PANEL_SIDE_MAX = 512, PANEL_GAP = 4 };

/* One panel: a picture, or the difference of two. */
typedef struct panel {
    const image *shown, *before; /* before NULL: show the picture itself */
    float amplified;
} panel;

/* Colour of a pixel; for differences, of the largest over the channels, amplified. */
static void panel_color(const panel *p, size_t pixel, float rgb[3])
{
    const float *a = p->shown->pixels + 3 * pixel;
    float most = 0;
    for (int c = 0; c < 3; c++)
        rgb[c] = fminf(fmaxf(a[c], 0), 1);
    if (p->before == NULL)
        return;
    const float *b = p->before->pixels + 3 * pixel;
    for (int c = 0; c < 3; c++)
        most = fmaxf(most, fabsf(a[c] - b[c]));
    error_color((double)(p->amplified * most), rgb);
}

/* Draw a panel, scaled down by a whole factor. */
static void draw_panel(const panel *p, int factor, int left, int top, image *sheet)
{
    const int width = p->shown->width / factor, height = p->shown->height / factor;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float *to = sheet->pixels + 3 * ((size_t)(top + y) * (size_t)sheet->width + (size_t)(left + x));
            for (int i = 0; i < factor * factor; i++) {
                float rgb[3];
                panel_color(p,
                            (size_t)(y * factor + i / factor) * (size_t)p->shown->width +
                                (size_t)(x * factor + i % factor),
                            rgb);
                for (int c = 0; c < 3; c++)
                    to[c] = (i == 0 ? 0 : to[c]) + rgb[c] / (float)(factor * factor);
            }
        }
}

gbt_status cross_write_sheet(const image *traced, const image pictures[CROSS_STEPS], const char *path,
                             gbt_error *err)
{
    const image *tiles = &pictures[CROSS_TILES], *order = &pictures[CROSS_ORDER],
                *flat = &pictures[CROSS_PROJECTION];
    const image *wide = &pictures[CROSS_DILATION], *splat = &pictures[CROSS_CUTS];
    const panel panels[PANELS_ACROSS * PANELS_DOWN] = {
        {traced, NULL, 0},
        {splat, NULL, 0},
        {splat, traced, CROSS_AMPLIFIED},
        {tiles, traced, CROSS_AMPLIFIED_TILES},
        {order, tiles, CROSS_AMPLIFIED},
        {flat, order, CROSS_AMPLIFIED},
        {wide, flat, CROSS_AMPLIFIED},
        {splat, wide, CROSS_AMPLIFIED},
    };
    const int side = traced->width > traced->height ? traced->width : traced->height;
    int factor = (side + PANEL_SIDE_MAX - 1) / PANEL_SIDE_MAX;
    if (traced->width < factor || traced->height < factor)
        factor = 1;
    const int width = traced->width / factor, height = traced->height / factor;
    image sheet;
    GBT_TRY(image_alloc(&sheet, PANELS_ACROSS * (width + PANEL_GAP) - PANEL_GAP,
                        PANELS_DOWN * (height + PANEL_GAP) - PANEL_GAP, 3, err));
    for (size_t i = 0; i < 3 * (size_t)sheet.width * (size_t)sheet.height; i++)
        sheet.pixels[i] = 1;
    for (int i = 0; i < PANELS_ACROSS * PANELS_DOWN; i++)
        draw_panel(&panels[i], factor, i % PANELS_ACROSS * (width + PANEL_GAP),
                   i / PANELS_ACROSS * (height + PANEL_GAP), &sheet);
    const gbt_status status = image_write(path, &sheet, err);
    image_free(&sheet);
    return status;
}
