/* SPDX-License-Identifier: Apache-2.0 */
/* render/render_outputs.h -- outputs beside colour (depth, normal, ...) as float EXR files: docs/formats.md.
 */
#ifndef GBT_RENDER_RENDER_OUTPUTS_H
#define GBT_RENDER_RENDER_OUTPUTS_H

#include "render/output_names.h"
#include "run/loaded_run.h"

/** Images of one pass. Start from {0}; free with render_output_images_free() after success or failure. */
typedef struct render_output_images {
    ray_image rays;
    image rgb, of[OUTPUT_COUNT]; /* of[k]: only the requested ones */
    uint32_t *strongest;
} render_output_images;

/**
 * Trace the Gaussians of the last render of `r` once more, along the rays of `shot` through the centre of its
 * aperture. The rays may differ from that render's, but Gaussians that were culled for it stay invisible.
 *
 * @param wanted [in] bits of render_outputs_parse()
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_NO_MEMORY
 */
gbt_status render_outputs_trace(loaded_run *r, const ray_shot *shot, unsigned wanted,
                                render_output_images *out, gbt_error *err);
void render_output_images_free(render_output_images *out); /* zeroes the struct */

/**
 * Trace the Gaussians of the last render of `r` once more and write FOLDER/NAME.OUTPUT.exr for each requested
 * output.
 *
 * The rays are those of `shot` through the centre of its aperture: a mean depth over the aperture would be
 * meaningless.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_NO_MEMORY. Does nothing if no output is requested.
 */
gbt_status render_outputs_write(loaded_run *r, const ray_shot *shot, unsigned wanted, const char *folder,
                                const char *name, gbt_error *err);

#endif
