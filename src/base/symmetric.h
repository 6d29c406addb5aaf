/* SPDX-License-Identifier: Apache-2.0 */
/* base/symmetric.h -- eigenvectors, Cholesky factor and linear equations of small symmetric matrices, n x n,
   row-major, in double. */
#ifndef GBT_BASE_SYMMETRIC_H
#define GBT_BASE_SYMMETRIC_H

/**
 * Eigenvalues and eigenvectors by Jacobi's method (Jacobi 1846): plain loops in a fixed order, the same bits
 * on every machine.
 *
 * @param a [in, out] [n][n] symmetric, finite; on return it has the eigenvalues on its diagonal, unsorted
 * @param v      [out] [n][n] unit eigenvectors as columns; a rotation (determinant 1)
 * @param small  [in] tolerance: ends when the off-diagonal elements of one half sum to at most this fraction
 *                    of the largest |a|; about 1e-15 to 1e-18
 * Cost: O(n^3) per sweep, 4 to 10 sweeps.
 */
void symmetric_eigen(double *a, double *v, int n, double small);

/**
 * m = l l^T with l lower triangular and zeros above; pivots below `least` (> 0) are raised to it.
 *
 * @param m [in] [n][n]; only the diagonal and the lower half are read
 * @param l [out] [n][n]; may be m
 */
void symmetric_cholesky(const double *m, double *l, int n, double least);

/** Solve l l^T x = b with the factor of symmetric_cholesky(); `x` [n] contains b on entry. */
void symmetric_solve(const double *l, double *x, int n);

#endif
