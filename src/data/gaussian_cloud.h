/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_cloud.h -- plain 3DGS Gaussians as files store them: the colour depends on the view direction
   through spherical harmonics (SH). */
#ifndef GBT_DATA_GAUSSIAN_CLOUD_H
#define GBT_DATA_GAUSSIAN_CLOUD_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

enum { GAUSSIAN_SH_COUNT = 16 };

/** SH basis function of degree 0, a constant: 1 / (2 sqrt(pi)). */
#define GAUSSIAN_SH_0 0.28209479177387814

/** Largest ratio between two scales of one Gaussian: up to it, float arithmetic in the Gaussian's canonical
    space is accurate to 1/255. */
#define GAUSSIAN_SCALE_RATIO 1e4

/** Log-scales are within +-GAUSSIAN_SCALE_LOG_LIMIT, so that scales, their inverses and the squares of both
    fit a float. */
#define GAUSSIAN_SCALE_LOG_LIMIT 30

/**
 * Checked and normalised Gaussians. colour = max(0, 0.5 + sum sh_k Y_k(d)), where d is the unit direction
 * from the camera to the Gaussian (base/sh.h). Start from {0}.
 */
typedef struct gaussian_cloud {
    size_t count;
    double origin[3]; /* add it to every mean; not 0 only for files with a position, or means, in double */
    float *mean;      /* [count][3] */
    float *scale_log; /* [count][3], natural log of the standard deviation; ratio limited */
    float *quat;      /* [count][4], w x y z, unit */
    float *opacity;   /* [count], [0, 1] */
    float *sh;        /* [count][GAUSSIAN_SH_COUNT][3], coefficient-major; those above sh_degree are 0 */
    int sh_degree;    /* 0..3 */
    bool antialiased; /* trained to be drawn with a filter as wide as a pixel (docs/antialiasing.md), without
                         further dilation; false for formats that cannot say so */
    float near; /* scene units: anything nearer to the camera is not to be drawn; 0: not stated, as always in
                   .spz and .splat */
    size_t dropped;            /* rows with an unusable value */
    size_t identity_rotations; /* zero quaternions, read as no rotation */
    size_t scales_clamped;     /* rows with a scale raised to 1e-4 of their largest */
} gaussian_cloud;

/** Allocate `count` Gaussians and set the count; values are undefined. Zeroed on failure. */
gbt_status gaussian_cloud_alloc(gaussian_cloud *cloud, size_t count, gbt_error *err);
void gaussian_cloud_free(gaussian_cloud *cloud);

/** One Gaussian from a file, before it is checked. */
typedef struct gaussian_row {
    double mean[3];
    double scale_log[3]; /* -INFINITY: flat along this axis */
    double quat[4];      /* w x y z, of any length */
    double opacity;
    double sh[GAUSSIAN_SH_COUNT][3];
} gaussian_row;

/**
 * Check and normalise one Gaussian and append it to a cloud that has room for it. A row is counted as dropped
 * instead when a value is not finite (except for the log-scale of a flat axis), a coordinate is beyond
 * RAW_COORDINATE_LIMIT, or a log-scale is above GAUSSIAN_SCALE_LOG_LIMIT. Corrected values are counted, too.
 */
void gaussian_cloud_add(gaussian_cloud *out, const gaussian_row *row);

/**
 * Choose an origin for the coordinates such that float precision suffices for most Gaussians: the centre of
 * the bounds `low` to `high`, clamped along each axis to the interquartile range of the means, so that a few
 * distant Gaussians do not cost the others precision. `mean`: all [count][3], or a sample.
 */
void gaussian_middle(const float *mean, size_t count, const double low[3], const double high[3],
                     double middle[3]);

/** The near distance as a file states it, or 0 when it is unusable. */
float gaussian_cloud_near(double stored);

/** Log one warning when rows were dropped or corrected: how many, and how. `name` is the file's. */
void gaussian_cloud_warn(const gaussian_cloud *cloud, const char *name);

/** Raise the smaller scales of one Gaussian to 1 / GAUSSIAN_SCALE_RATIO of the largest. True if changed. */
bool gaussian_limit_scales(float scale_log[3]);

#endif
