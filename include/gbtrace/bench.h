/* gbtrace/bench.h -- measure the tracer on given Gaussians, and check gradients on the user's own scene. */
#ifndef GBTRACE_BENCH_H
#define GBTRACE_BENCH_H

#include <stdio.h>

#include "gbtrace/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct gbt_bench_def {
    const char *model;  /* plain 3DGS .ply, or a run; required */
    const char *camera; /* camera file (docs/cameras.md; of an aperture the first sample); required for a .ply, else the first held-out view */
    int repeats;        /* timed passes after one warm-up; the median is reported. Default 5 */
    int check;          /* 1: compare with the double reference on every 8th pixel in both directions. Default 0 */
    const char *json;   /* where to write the figures; NULL: nowhere */
    float alpha_min;    /* smallest response that counts, in (0, 1); 0 or NaN: that of the run, 1/255 for a .ply */
    float alpha_max;    /* alpha is cut here, in (0, 1); 0 or NaN: that of the run, 0.99 for a .ply */
    float t_min;        /* stop before transmittance falls below this, in (0, 1); 0 or NaN: that of the run, 1e-4 for a .ply */
} gbt_bench_def;

gbt_bench_def gbt_bench_def_default(void);

/** Time build, forward and adjoint; figures as text to `out` and as JSON. Times of one core per ray are process CPU time / rays. */
gbt_status gbt_bench_trace(const gbt_bench_def *def, FILE *out, gbt_error *err);

/**
 * Compare analytic gradients with the double adjoint and with differences, on a trained run: tracer, decode and the whole chain.
 *
 * Prints one row per parameter class: relative L2 error and limit. GBT_ERR_INTERNAL when a limit is broken.
 */
gbt_status gbt_check_grad(const char *run, FILE *out, gbt_error *err);

#ifdef __cplusplus
}
#endif
#endif
