/* SPDX-License-Identifier: Apache-2.0 */
/* render/render_outputs.c -- outputs beside colour (depth, normal, ...) as float EXR files. */
#include "render/render_outputs.h"

#include <stdio.h>
#include <string.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"

/* For each ray the anchor (or plain Gaussian) that its strongest Gaussian comes from; -1 where there is none.
 */
static void name_anchors(const loaded_run *r, const uint32_t *strongest, image *out)
{
    const frame *f = &r->frame;
    for (size_t i = 0; i < (size_t)out->width * (size_t)out->height; i++)
        out->pixels[i] = strongest[i] < f->gaussians.count
                             ? (float)frame_part(f, loaded_run_subject(r), strongest[i])
                             : -1;
}

static gbt_status write_one(const image *pixels, render_output which, const char *folder, const char *name,
                            gbt_error *err)
{
    char file[1200], path[4096];
    snprintf(file, sizeof file, "%s.%s.exr", name, render_output_kinds[which].name);
    GBT_TRY(file_join(path, sizeof path, folder, file, err));
    return image_write(path, pixels, err);
}

void render_output_images_free(render_output_images *o)
{
    for (int i = 0; i < OUTPUT_COUNT; i++)
        image_free(&o->of[i]);
    image_free(&o->rgb);
    ray_image_free(&o->rays);
    mem_free(o->strongest);
    memset(o, 0, sizeof *o);
}

gbt_status render_outputs_trace(loaded_run *r, const ray_shot *shot, unsigned wanted, render_output_images *o,
                                gbt_error *err)
{
    ray_shot middle = *shot;
    middle.aperture_radius = 0;
    GBT_TRY(ray_image_from_shot(&middle, 0, &o->rays, err));
    GBT_TRY(image_alloc(&o->rgb, o->rays.width, o->rays.height, 3, err));
    for (int i = 0; i < OUTPUT_COUNT; i++)
        if (wanted >> i & 1)
            GBT_TRY(
                image_alloc(&o->of[i], o->rays.width, o->rays.height, render_output_kinds[i].channels, err));
    if (wanted >> OUTPUT_ANCHOR & 1) {
        o->strongest = mem_alloc(ray_image_count(&o->rays), sizeof *o->strongest, "strongest Gaussians", err);
        if (o->strongest == NULL)
            return GBT_ERR_NO_MEMORY;
    }
    const trace_outputs out = {.rgb = &o->rgb,
                               .transmittance = o->of[OUTPUT_TRANSMITTANCE].pixels,
                               .depth = o->of[OUTPUT_DEPTH].pixels,
                               .median_depth = o->of[OUTPUT_MEDIAN_DEPTH].pixels,
                               .normal = o->of[OUTPUT_NORMAL].pixels,
                               .hit_count = o->of[OUTPUT_HITS].pixels,
                               .strongest = o->strongest};
    GBT_TRY(trace_forward(&r->frame.scene, &o->rays, false, &out, NULL, err));
    if (o->strongest != NULL)
        name_anchors(r, o->strongest, &o->of[OUTPUT_ANCHOR]);
    return GBT_OK;
}

gbt_status render_outputs_write(loaded_run *r, const ray_shot *shot, unsigned wanted, const char *folder,
                                const char *name, gbt_error *err)
{
    if (wanted == 0)
        return GBT_OK;
    render_output_images o = {0};
    gbt_status status = render_outputs_trace(r, shot, wanted, &o, err);
    for (int i = 0; i < OUTPUT_COUNT; i++)
        if (status == GBT_OK && wanted >> i & 1)
            status = write_one(&o.of[i], (render_output)i, folder, name, err);
    render_output_images_free(&o);
    return status;
}
