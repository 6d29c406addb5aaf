/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/import.h -- convert trained models of other programs into runs. */
#ifndef GBTRACE_IMPORT_H
#define GBTRACE_IMPORT_H

#include <stdint.h>
#include <stdio.h>

#include "gbtrace/api.h"
#include "gbtrace/choices.h"
#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_import_def {
    const char *data; /* data set for rendering and scoring; NULL: the one that cfg_args of the result folder
                         names, if any. Default NULL */
    gbt_renderer renderer; /* one that can train; the run is marked as trained with it. Default
                              GBT_RENDERER_RASTER: such models were trained with splats */
    uint32_t cookie_;      /* set by gbt_import_def_default() */
} gbt_import_def;

gbt_import_def gbt_import_def_default(void);

/**
 * Write a trained Scaffold-GS model as a run, which every command reads. RUN/model.gbt decodes to the same
 * Gaussians.
 *
 * @param input [in] Scaffold-GS's result folder (the newest point_cloud/iteration_N is used), or its
 *                   point_cloud.ply; the networks are opacity_mlp.safetensors, cov_mlp.safetensors and
 *                   color_mlp.safetensors beside the .ply (docs/formats.md)
 * @param run   [in] folder, created when missing; one that already holds a run, trained or imported, is
 *                   refused
 * @param report [in] open stream for one line; NULL: none
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct runs.
 */
gbt_status gbt_import(const char *input, const gbt_import_def *def, const char *run, FILE *report,
                      gbt_error *err);

GBT_API_END
#endif
