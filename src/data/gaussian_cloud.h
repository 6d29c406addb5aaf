/* SPDX-License-Identifier: Apache-2.0 */
/* data/gaussian_cloud.h -- plain 3DGS Gaussians, as files hold them: colour is a function of the direction,
   in spherical harmonics. */
#ifndef GBT_DATA_GAUSSIAN_CLOUD_H
#define GBT_DATA_GAUSSIAN_CLOUD_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

enum { GAUSSIAN_SH_COUNT = 16 };

/** Y_0, the same in all directions. */
#define GAUSSIAN_SH_0 0.28209479177387814

/** Largest ratio of two scales of one Gaussian: canonical-space float arithmetic keeps 1/255 up to it. */
#define GAUSSIAN_SCALE_RATIO 1e4

/** Log-scales stay within +-GAUSSIAN_SCALE_LOG_LIMIT, so that scales, their inverses and the squares of both
    are floats. */
#define GAUSSIAN_SCALE_LOG_LIMIT 30

/**
 * Checked and normalised. colour = max(0, 0.5 + sum sh_k Y_k(d)), d: unit, from the camera to the Gaussian
 * (base/sh.h). Start from {0}.
 */
typedef struct gaussian_cloud {
    size_t count;
    double origin[3]; /* to be added to every mean: 0, but of formats that keep a place in double */
    float *mean;      /* [count][3] */
    float *scale_log; /* [count][3], natural log of the std-dev; ratio limited */
    float *quat;      /* [count][4], w x y z, unit */
    float *opacity;   /* [count], [0, 1] */
    float *sh;        /* [count][GAUSSIAN_SH_COUNT][3], coefficient-major; those above sh_degree are 0 */
    int sh_degree;    /* 0..3 */
    bool antialiased; /* made to be drawn as wide as pixels (docs/antialiasing.md), without a blur on top: of
                         the formats that can say so */
    float near;     /* nothing nearer to a camera is to be drawn, scene units; 0: nobody says: .spz and .splat
                       cannot */
    size_t dropped; /* rows with a value that is not usable */
    size_t identity_rotations; /* zero quaternions, read as no rotation */
    size_t scales_clamped;     /* rows with a scale raised to 1e-4 of their largest */
} gaussian_cloud;

/** Room for `count` Gaussians, in use; values undefined. On failure zeroed. */
gbt_status gaussian_cloud_alloc(gaussian_cloud *cloud, size_t count, gbt_error *err);
void gaussian_cloud_free(gaussian_cloud *cloud);

/** One Gaussian as a file has it, before it is checked. */
typedef struct gaussian_row {
    double mean[3];
    double scale_log[3]; /* -INFINITY: flat */
    double quat[4];      /* w x y z, of any length */
    double opacity;
    double sh[GAUSSIAN_SH_COUNT][3];
} gaussian_row;

/**
 * Append one Gaussian, checked and normalised, to a cloud that has room for it; or count it as dropped, when
 * a value is not finite (but a flat scale), a coordinate is beyond RAW_COORDINATE_LIMIT, or a log-scale above
 * GAUSSIAN_SCALE_LOG_LIMIT. What was mended is counted too.
 */
void gaussian_cloud_add(gaussian_cloud *out, const gaussian_row *row);

/**
 * Where coordinates start from, so that floats are fine for the Gaussians: the middle of the bounds low and
 * high, but between the quartiles of the means along each axis, so that a few far ones do not take the
 * others' digits. `mean`: all [count][3], or a sample.
 */
void gaussian_middle(const float *mean, size_t count, const double low[3], const double high[3],
                     double middle[3]);

/** The near distance that a file says; 0 where it is not usable. */
float gaussian_cloud_near(double said);

/** A warning in one line when rows were left out or mended: how many, and how. `name` of the file. */
void gaussian_cloud_warn(const gaussian_cloud *cloud, const char *name);

/** Raise the scales of one Gaussian to GAUSSIAN_SCALE_RATIO below their largest; true when that changed
    one. */
bool gaussian_limit_scales(float scale_log[3]);

#endif
