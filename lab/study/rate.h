/* SPDX-License-Identifier: Apache-2.0 */
/* study/rate.h -- the study "rate": how much quality a small model file costs. What is measured, and its
   output. */
#ifndef GBT_STUDY_RATE_H
#define GBT_STUDY_RATE_H

#include "io/model_file.h"
#include "study/output.h"

enum { RATE_MODELS_MAX = 6, RATE_ROWS_MAX = 12 };

/** One compressed file of a model. */
typedef struct rate_row {
    double quality; /* dB; 0: lossless */
    model_sizes sizes;
    double psnr, ssim; /* of the decompressed model, mean over the held-out views; NaN without any */
    double encode_seconds, decode_seconds;
} rate_row;

typedef struct rate_model {
    char name[256];
    size_t anchors, plain_bytes, views;
    double psnr, ssim; /* of the uncompressed model */
    double probe_seconds;
    rate_row rows[RATE_ROWS_MAX];
    size_t row_count;
} rate_model;

typedef struct rate_study {
    rate_model models[RATE_MODELS_MAX];
    size_t model_count;
} rate_study;

/** A row's name in tables: "60 dB", "lossless". */
const char *rate_row_name(const rate_row *row, char *out, size_t size);

/** The files that the study writes. */
extern const study_output rate_output;

#endif
