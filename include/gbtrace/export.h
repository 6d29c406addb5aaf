/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/export.h -- trained scenes as files of plain Gaussians, which common 3DGS viewers read. */
#ifndef GBTRACE_EXPORT_H
#define GBTRACE_EXPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

/** Settings of gbt_export(). When the input is plain Gaussians, only sh_degree and json apply; any other
    setting is refused. */
typedef struct gbt_export_def {
    int sh_degree;    /* degree of the spherical harmonics of the colours, 0 to 3. Default 3 */
    int refine_steps; /* optimisation steps that fit the plain Gaussians to the model's own renders, >= 0.
                         Default 500 */
    int gaussians; /* maximum number in a file made from a model, including the backdrop (with `backdrop` more
                      than 1000): those with the largest blending weight in the training views are kept; 0:
                      all. Default 0 */
    bool backdrop; /* add the model's background as a sphere of 1000 Gaussians around everything: files have
                      no background, and viewers draw on black. Not where photos are transparent in
                      places. Default true */
    const char *data;  /* data set with the training cameras; NULL: the one it was trained on. Default NULL */
    const char *json;  /* also write the figures here; NULL: nowhere. Default NULL */
    const char *lpips; /* .safetensors file of a network: adds LPIPS to the scores of a result folder
                          (docs/metrics.md). Default NULL */
    uint32_t cookie_;  /* set by gbt_export_def_default() */
} gbt_export_def;

gbt_export_def gbt_export_def_default(void);

/** A file format of plain Gaussians, which can be written and read. Strings are static. */
typedef struct gbt_export_format {
    const char *ending; /* of its files: ".ply" */
    const char *what;   /* what it keeps, in a few words */
} gbt_export_format;

/** Number of formats, and the format at `index` in their list, 0 to count - 1. */
int gbt_export_format_count(void);
gbt_export_format gbt_export_format_at(int index);

/**
 * Write a scene as plain 3DGS Gaussians; the ending of each output name selects its format
 * (gbt_export_format_at()). World coordinates and axes are those of the data set; .glb uses glTF's axes (x
 * and y change signs).
 *
 * A trained model is baked: its networks are replaced by spherical harmonics (docs/exporting.md). The loss of
 * quality is measured on up to 16 held-out views, evenly chosen (all of them for a result folder; training
 * views when none is held out), for each file as it reads back, and reported. An input file of plain
 * Gaussians, or a result folder of 3DGS, is converted.
 *
 * A name that ends in / is a folder: it gets the files that the reference implementation of 3DGS writes:
 * cfg_args, cameras.json, input.ply, point_cloud/iteration_N/point_cloud.ply, and for the held-out views
 * test/ours_N/, results.json and per_view.json. Only runs can be written like this, and not into a folder
 * that holds a later iteration.
 *
 * @param input  [in] RUN (a folder with model.gbt), a model file, plain Gaussians, or a result folder of 3DGS
 * @param outputs [in] [output_count] file names, at most 16, each written atomically; their endings and
 *                     folders are checked before any work
 * @param report [in] open stream; NULL: none
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: any, with distinct outputs; same bytes for every thread count. Cost: one pass over the training
 * cameras, `refine_steps` steps, and up to 16 held-out views (all of them for a folder).
 */
gbt_status gbt_export(const char *input, const gbt_export_def *def, const char *const *outputs,
                      size_t output_count, FILE *report, gbt_error *err);

GBT_API_END
#endif
