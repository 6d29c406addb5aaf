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
    double quality; /* dB: what the pictures of the model may differ from before, as a PSNR; [20, 90]. Default
                       60 */
    bool lossless;  /* every bit of the model is kept; `quality` is not used. Default false */
    bool unless_lossless; /* a run that was trained with `lossless` (gbt_train_def) stays as it is. Default
                             false */
    const char *data; /* data set whose training cameras tell what counts; NULL: the one it was trained on.
                         Default NULL */
    const char *json; /* also write the figures here; NULL: nowhere. Default NULL */
    uint32_t cookie_; /* set by gbt_compress_def_default() */
} gbt_compress_def;

gbt_compress_def gbt_compress_def_default(void);

/**
 * Write a trained model in a small form that every command reads as it reads the large one
 * (docs/compression.md).
 *
 * Steps of quantisation come from adjoint passes through the training views (photos are not needed); when the
 * data set is not there, from the model alone, with a line on stderr: the file is then some 5 to 40 % larger
 * at the same loss. Where one anchor is so far from the others that their positions would be rounded too
 * much for that quality, the model is stored without loss, with a warning. What the file gives back is
 * checked before it is written.
 *
 * A file that is already small is copied as it is, in a moment: always with `lossless`, else when it is
 * quantised and `quality` is not below the default (a file does not say at which quality it was made). A copy
 * onto itself is nothing to do.
 *
 * @param run [in] RUN (a folder with model.gbt) or a model file
 * @param out [in] written atomically; may be the model itself
 * @param report [in] open stream for the table of bytes; NULL: none
 * SIGINT and SIGTERM stop it with GBT_ERR_INTERRUPTED; the model is whole then, large or small.
 *
 * @return GBT_OK, GBT_ERR_ARGUMENT, GBT_ERR_IO, GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY, GBT_ERR_INTERRUPTED
 *
 * Threads: any, with distinct `out`; a signal stops all calls that catch it (gbt_train()). Same bytes for
 * every thread count. Cost: 64 views with their adjoint, and about 40 us per anchor.
 */
gbt_status gbt_compress(const char *run, const gbt_compress_def *def, const char *out, FILE *report,
                        gbt_error *err);

GBT_API_END
#endif
