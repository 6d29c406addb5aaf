/* SPDX-License-Identifier: Apache-2.0 */
/* gb/joint.h -- position and colour of a set of points as one vector of six: moments, principal axis, coding
   length (Ma 2007). */
#ifndef GBT_GB_JOINT_H
#define GBT_GB_JOINT_H

#include "gb/moments.h"

enum { JOINT_DIM = 6 };

/** y = (x / position_unit, colour / color_unit). */
typedef struct joint_space {
    const float *color; /* [..][3], indexed by the points' index, or NULL: the last three of y are 0 */
    double position_unit, color_unit;
} joint_space;

typedef struct joint_moments {
    double mean[JOINT_DIM];
    double covariance[JOINT_DIM][JOINT_DIM]; /* population */
} joint_moments;

/** y of a point. */
void joint_of(const joint_space *space, const cloud_point *point, double y[JOINT_DIM]);

/**
 * Two passes about the first point, then about the mean, as moments_compute().
 *
 * @param count [in] >= 1
 * Threads: any; one thread each, sums in the order of the points.
 */
void joint_compute(const joint_space *space, const cloud_point *points, size_t count, joint_moments *out);

/**
 * Unit eigenvector of the largest eigenvalue; of equal ones the first axis that they turned from. Its largest
 * component is positive, components equal to 1e-9 count as tied, the first decides. The first unit vector for
 * a zero covariance.
 */
void joint_axis(const joint_moments *m, double axis[JOINT_DIM]);

/**
 * n / 2 ln det(I + C): what it takes, in nats, to write down n points of covariance C relative to their ball,
 * to one unit in each coordinate, when they are normally distributed. 0 for equal points; never more after a
 * cut of the set (the determinant is log-concave).
 */
double joint_nats(const joint_moments *m, size_t count);

#endif
