/* SPDX-License-Identifier: Apache-2.0 */
/* gb/joint.h -- position and colour of points as joint vectors of six numbers: moments, principal axis,
   coding length (Ma 2007). */
#ifndef GBT_GB_JOINT_H
#define GBT_GB_JOINT_H

#include "gb/moments.h"

enum { JOINT_DIM = 6 };

/** The joint space y = (x / position_unit, colour / color_unit). */
typedef struct joint_space {
    const float *color; /* [..][3], indexed by the points' index, or NULL: the last three of y are 0 */
    double position_unit, color_unit;
} joint_space;

typedef struct joint_moments {
    double mean[JOINT_DIM];
    double covariance[JOINT_DIM][JOINT_DIM]; /* population */
} joint_moments;

/** Compute y of a point. */
void joint_of(const joint_space *space, const cloud_point *point, double y[JOINT_DIM]);

/**
 * Mean and covariance in two passes, about the first point and then about the mean, as in moments_compute().
 *
 * @param count [in] >= 1
 * Threads: any; runs on the calling thread, sums in the order of the points.
 */
void joint_compute(const joint_space *space, const cloud_point *points, size_t count, joint_moments *out);

/**
 * Unit eigenvector of the largest eigenvalue; for equal eigenvalues, the one that stems from the first axis
 * in the Jacobi iteration. The sign makes its largest component positive; components within 1e-9 count as
 * tied, and the first of them decides. The first unit vector for a zero covariance.
 */
void joint_axis(const joint_moments *m, double axis[JOINT_DIM]);

/**
 * n / 2 ln det(I + C): nats needed to code n normally distributed points of covariance C relative to their
 * ball, to a precision of one unit per coordinate. 0 for equal points; a cut never increases the sum (the
 * determinant is log-concave).
 */
double joint_nats(const joint_moments *m, size_t count);

#endif
