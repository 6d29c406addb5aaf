/* eval/render_outputs.h -- what a picture shows beside colour, to float EXR files: see docs/formats.md. */
#ifndef GBT_EVAL_RENDER_OUTPUTS_H
#define GBT_EVAL_RENDER_OUTPUTS_H

#include "eval/loaded_run.h"

/**
 * A list of names with commas between: transmittance, depth, median-depth, normal, hits, anchor.
 *
 * @param list   [in]  NULL: none
 * @param wanted [out] a bit for each
 * @return GBT_OK, or GBT_ERR_ARGUMENT for another name
 */
gbt_status render_outputs_parse(const char *list, unsigned *wanted, gbt_error *err);

/**
 * Trace the Gaussians of the last render of `r` once more and write FOLDER/NAME.OUTPUT.exr for each wanted output.
 *
 * The rays are those of `shot` through the middle of its aperture: a depth that is the mean over an aperture means nothing.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_NO_MEMORY. Nothing to do when nothing is wanted.
 */
gbt_status render_outputs_write(loaded_run *r, const ray_shot *shot, unsigned wanted, const char *folder, const char *name, gbt_error *err);

#endif
