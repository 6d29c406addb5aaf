/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/import.h -- trained models of other programs as ours. */
#ifndef GBTRACE_IMPORT_H
#define GBTRACE_IMPORT_H

#include <stdint.h>
#include <stdio.h>

#include "gbtrace/api.h"
#include "gbtrace/choices.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_import_def {
    const char *data; /* data set for rendering and scoring; NULL: what the result folder's cfg_args names, if
                         anything. Default NULL */
    gbt_renderer renderer; /* that trains. Default GBT_RENDERER_RASTER: the model was trained with splats */
    uint32_t cookie_;      /* set by gbt_import_def_default() */
} gbt_import_def;

gbt_import_def gbt_import_def_default(void);

/**
 * Write a trained Scaffold-GS model as a run of ours, which every command reads: RUN/model.gbt decodes to the
 * same Gaussians.
 *
 * @param input [in] Scaffold-GS's result folder (the newest point_cloud/iteration_N counts), or its
 *                   point_cloud.ply; the networks are opacity_mlp.safetensors, cov_mlp.safetensors and
 *                   color_mlp.safetensors beside the .ply (docs/formats.md)
 * @param run   [in] folder, made when it is not there; one with a run, trained or imported, is refused
 * @param report [in] open stream for one line; NULL: none
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct runs.
 */
gbt_status gbt_import(const char *input, const gbt_import_def *def, const char *run, FILE *report,
                      gbt_error *err);

GBT_API_END
#endif
