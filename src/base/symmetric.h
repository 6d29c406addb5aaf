/* SPDX-License-Identifier: Apache-2.0 */
/* base/symmetric.h -- eigenvectors, Cholesky factor and linear equations of small symmetric matrices, n x n,
   row-major, in double. */
#ifndef GBT_BASE_SYMMETRIC_H
#define GBT_BASE_SYMMETRIC_H

/**
 * Eigenvalues and eigenvectors by Jacobi's method (Jacobi 1846): plain loops in a fixed order, the same bits
 * on every machine.
 *
 * @param a      [in, out] [n][n] symmetric, finite; leaves the eigenvalues on its diagonal, in no order
 * @param v      [out] [n][n] unit eigenvectors in its columns: a rotation, its determinant is 1
 * @param small  [in] done when the off-diagonal halves sum to at most this share of the largest |a|; about
 *                    1e-15 to 1e-18
 * Cost: O(n^3) per sweep, 4 to 10 sweeps.
 */
void symmetric_eigen(double *a, double *v, int n, double small);

/**
 * m = l l^T, l lower triangular with zeros above; what a pivot is less than `least` (> 0) it is raised to.
 *
 * @param m [in] [n][n], of which the lower half and the diagonal are read
 * @param l [out] [n][n]; may be m
 */
void symmetric_cholesky(const double *m, double *l, int n, double least);

/** Solves l l^T x = b by symmetric_cholesky()'s factor; `x` [n] holds b before. */
void symmetric_solve(const double *l, double *x, int n);

#endif
