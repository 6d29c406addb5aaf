/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/export.h -- trained scenes as files of plain Gaussians, for every viewer there is. */
#ifndef GBTRACE_EXPORT_H
#define GBTRACE_EXPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

/** Of plain Gaussians sh_degree and json alone count; the others are refused. */
typedef struct gbt_export_def {
    int sh_degree;    /* of the colours' dependence on the direction, 0 to 3. Default 3 */
    int refine_steps; /* steps that fit the plain Gaussians to the model's own pictures, >= 0. Default 500 */
    int gaussians;    /* at most so many in a file made from a model, the backdrop among them: those that the
                               training views blend most; 0: all. Default 0 */
    bool backdrop; /* add the model's background as a sphere of 1000 Gaussians around everything: files have
                      no background, and viewers draw on black. Not where photos are transparent in
                      places. Default true */
    const char *data;  /* data set with the training cameras; NULL: the one it was trained on. Default NULL */
    const char *json;  /* also write the figures here; NULL: nowhere. Default NULL */
    const char *lpips; /* .safetensors file of a network: a result folder gets LPIPS too (docs/metrics.md).
                          Default NULL */
    uint32_t cookie_;  /* set by gbt_export_def_default() */
} gbt_export_def;

gbt_export_def gbt_export_def_default(void);

/** A format of plain Gaussians, written and read. Texts are static. */
typedef struct gbt_export_format {
    const char *ending; /* of its files: ".ply" */
    const char *what;   /* what it keeps, in a few words */
} gbt_export_format;

/** How many formats there are, and the one of a place in their list, 0 to count - 1. */
int gbt_export_format_count(void);
gbt_export_format gbt_export_format_at(int index);

/**
 * Write a scene as plain 3DGS Gaussians in the format (gbt_export_format_at()) of each name's ending. World
 * coordinates and axes are those of the data set; .glb has glTF's (x and y change signs).
 *
 * A trained model is baked: networks become spherical harmonics (docs/exporting.md). What that loses is
 * measured on up to 16 held-out views, evenly chosen (all of them for a result folder; training views where
 * none is held out), for each file as it reads back, and reported. A file of a format that is read, or a
 * result folder of 3DGS, is converted.
 *
 * A name that ends in / is a folder: it gets what the reference implementation of 3DGS leaves, cfg_args,
 * cameras.json, input.ply, point_cloud/iteration_N/point_cloud.ply, and of the held-out views test/ours_N/,
 * results.json and per_view.json. Runs alone can be written so, and not beside a later iteration.
 *
 * @param input  [in] RUN (a folder with model.gbt), a model file, plain Gaussians, or a result folder of 3DGS
 * @param outputs [in] [output_count] file names, at most 16, each written atomically; their endings and
 *                     folders are checked before any work
 * @param report [in] open stream; NULL: none
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct outputs; same bytes for every thread count. Cost: one pass over the training
 * cameras, the steps, and up to 16 held-out views (all of them for a folder).
 */
gbt_status gbt_export(const char *input, const gbt_export_def *def, const char *const *outputs,
                      size_t output_count, FILE *report, gbt_error *err);

GBT_API_END
#endif
