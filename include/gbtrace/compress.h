/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/compress.h -- make the file of a trained model small. */
#ifndef GBTRACE_COMPRESS_H
#define GBTRACE_COMPRESS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_compress_def {
    double quality; /* dB, [20, 90]: PSNR of the compressed model's renders against those of the original.
                       Default 60 */
    bool lossless;  /* keep every bit of the model; `quality` is not used. Default false */
    bool after_training; /* `run` was trained just now: if with `lossless` (gbt_train_def), leave it as it is;
                            do not repeat the warnings about its data set. Default false */
    const char *data;    /* data set whose training cameras measure how much each parameter matters; NULL: the
                            one it was trained on. Default NULL */
    const char *json;    /* also write the figures here; NULL: nowhere. Default NULL */
    uint32_t cookie_;    /* set by gbt_compress_def_default() */
} gbt_compress_def;

gbt_compress_def gbt_compress_def_default(void);

/**
 * Write a trained model in a compressed form, which every command reads like the uncompressed one
 * (docs/compression.md).
 *
 * Quantization steps come from adjoint passes through the training views (the photos are not needed). When
 * the data set is not there, they come from the model alone, with a line on stderr: the file is then some 5
 * to 40 % larger at the same loss. When one anchor is so far from the others that rounding positions would
 * cost more than that quality, the model is stored without loss, with a warning. The file is decoded and
 * checked before it is written.
 *
 * A file that is already compressed is copied unchanged: always with `lossless`, otherwise when it is
 * quantized and `quality` is not below the default (a file does not record the quality it was made with).
 * When `out` is that file, nothing is done.
 *
 * @param run [in] RUN (a folder with model.gbt) or a model file
 * @param out [in] written atomically; may be the model itself
 * @param report [in] open stream for the table of sizes; NULL: none. SIGINT and SIGTERM stop it with
 * GBT_ERR_INTERRUPTED; the model file is then complete, either as before or compressed.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED
 *
 * Threads: any, with distinct `out`; a signal stops all calls that catch it (gbt_train()). Same bytes for
 * every thread count. Cost: 64 views, each rendered and differentiated, and about 40 us per anchor.
 */
gbt_status gbt_compress(const char *run, const gbt_compress_def *def, const char *out, FILE *report,
                        gbt_error *err);

GBT_API_END
#endif
