/* SPDX-License-Identifier: Apache-2.0 */
/* study/speed.h -- the study "speed", speed against accuracy: what is measured, and its output. */
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

/** One measured setting. */
typedef struct speed_row {
    speed_knob knob;
    const char *value; /* "0.01", "embree" */
    bool is_default;   /* equal to the preset "default", whose figures it shares */
    trace_settings settings;
    trace_kernel kernel;
    cpu_isa isa;
    bool splats; /* drawn by splats of this form instead of rays */
    raster_form form;
    double picture_us;          /* core-microseconds per pixel: tree build and forward pass */
    double forward_us, both_us; /* forward pass; forward and adjoint */
    double photo_psnr;          /* mean over the held-out photos of a run; NaN without any */
    double blended, pairs;      /* blended: per ray; pairs: pairs of rows per packet */
    bench_error error;          /* against the picture without cut-offs */
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

/** Measure the PSNR of every row against the held-out photos of `s`, which is decoded again for each: sets
    row->photo_psnr and photo_count. Photos that are masked completely are left out. Does nothing for a .ply.
    */
gbt_status speed_measure_photos(struct bench_scene *s, speed_model *out, gbt_error *err);

/** The files that the study writes. */
extern const study_output speed_output;

#endif
