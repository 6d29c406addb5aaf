/* SPDX-License-Identifier: Apache-2.0 */
/* render/render_outputs.h -- what a picture shows beside colour, to float EXR files: see docs/formats.md. */
#ifndef GBT_RENDER_RENDER_OUTPUTS_H
#define GBT_RENDER_RENDER_OUTPUTS_H

#include "render/output_names.h"
#include "run/loaded_run.h"

/** Pictures of one pass. Start from {0}; render_output_images_free() after success or failure. */
typedef struct render_output_images {
    ray_image rays;
    image rgb, of[OUTPUT_COUNT]; /* those that were wanted */
    uint32_t *strongest;
} render_output_images;

/**
 * Trace the Gaussians of the last render of `r` once more, along the rays of `shot` through the middle of its
 * aperture. They may be others than the render's, but see nothing more: what was left out then is not seen.
 *
 * @param wanted [in] bits of render_outputs_parse()
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 */
gbt_status render_outputs_trace(loaded_run *r, const ray_shot *shot, unsigned wanted,
                                render_output_images *out, gbt_error *err);
void render_output_images_free(render_output_images *out); /* zeroes the struct */

/**
 * Trace the Gaussians of the last render of `r` once more and write FOLDER/NAME.OUTPUT.exr for each wanted
 * output.
 *
 * The rays are those of `shot` through the middle of its aperture: a depth that is the mean over an aperture
 * means nothing.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_NO_MEMORY. Nothing to do when nothing is wanted.
 */
gbt_status render_outputs_write(loaded_run *r, const ray_shot *shot, unsigned wanted, const char *folder,
                                const char *name, gbt_error *err);

#endif
