/* SPDX-License-Identifier: Apache-2.0 */
/* study/speed.h -- the measurements of the study "speed against accuracy", and how they are written down. */
#ifndef GBT_STUDY_SPEED_H
#define GBT_STUDY_SPEED_H

#include "benchmark/bench_passes.h"
#include "benchmark/bench_reference.h"
#include "study/output.h"

struct bench_scene;

enum { SPEED_WAYS_MAX = 25, SPEED_MODELS_MAX = 16 };

typedef enum speed_knob {
    KNOB_PRESET,
    KNOB_ALPHA,
    KNOB_STOP,
    KNOB_KERNEL,
    KNOB_ISA,
    KNOB_RENDERER,
    KNOB_COUNT
} speed_knob;

/** A setting that was measured. */
typedef struct speed_row {
    speed_knob knob;
    const char *value; /* "0.01", "embree" */
    bool is_default;   /* the same as the preset "default": its figures are those */
    trace_settings settings;
    trace_kernel kernel;
    cpu_isa isa;
    bool splats; /* in place of rays, in this form */
    raster_form form;
    double picture_us;          /* core-microseconds per pixel: tree and forward */
    double forward_us, both_us; /* forward; forward and adjoint */
    double photo_psnr;          /* mean over the held-out photos of a run; NaN without them */
    double blended, pairs;      /* per ray; pairs of rows per packet */
    bench_error error;          /* to the picture without cut-offs */
} speed_row;

typedef struct speed_model {
    char name[256];
    size_t gaussians, rays, check_rays;
    speed_row rows[SPEED_WAYS_MAX];
    size_t row_count;
    size_t photo_count; /* held-out photos; 0 for a .ply */
} speed_model;

typedef struct speed_study {
    speed_model models[SPEED_MODELS_MAX];
    size_t model_count;
    int repeats, threads;
} speed_study;

/** PSNR of every row to the held-out photos of `s`, which is decoded anew; row->photo_psnr and photo_count,
    without photos that are masked whole. Nothing for a .ply. */
gbt_status speed_measure_photos(struct bench_scene *s, speed_model *out, gbt_error *err);

/** How it is written down. */
extern const study_output speed_output;

#endif
