/* SPDX-License-Identifier: Apache-2.0 */
/* base/symmetric.c -- Jacobi eigenvalue iteration and Cholesky factorisation. */
#include "base/symmetric.h"

#include <math.h>

enum { SWEEPS_MAX = 60 /* convergence is quadratic; the bound only states that the loop ends */ };

/* Apply the rotation that makes a[p][q] zero to `a` and to the columns of `v`. */
static void rotate(double *a, double *v, int n, int p, int q)
{
    const double apq = a[p * n + q];
    if (apq == 0)
        return;
    /* theta may overflow to infinity when a[p][q] is tiny: t is then 0 and the rotation is the identity, as
       it should be. */
    const double theta = (a[q * n + q] - a[p * n + p]) / (2 * apq);
    const double t = copysign(1.0, theta) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    a[p * n + p] -= t * apq;
    a[q * n + q] += t * apq;
    a[p * n + q] = a[q * n + p] = 0;
    for (int r = 0; r < n; r++) {
        if (r != p && r != q) {
            const double arp = a[r * n + p], arq = a[r * n + q];
            a[r * n + p] = a[p * n + r] = c * arp - s * arq;
            a[r * n + q] = a[q * n + r] = s * arp + c * arq;
        }
        const double vp = v[r * n + p], vq = v[r * n + q];
        v[r * n + p] = c * vp - s * vq;
        v[r * n + q] = s * vp + c * vq;
    }
}

static double off_diagonal(const double *a, int n)
{
    double sum = 0;
    for (int p = 0; p < n; p++)
        for (int q = p + 1; q < n; q++)
            sum += fabs(a[p * n + q]);
    return sum;
}

void symmetric_eigen(double *a, double *v, int n, double small)
{
    double largest = 0;
    for (int i = 0; i < n * n; i++) {
        largest = fmax(largest, fabs(a[i]));
        v[i] = i % (n + 1) == 0;
    }
    for (int sweep = 0; sweep < SWEEPS_MAX && off_diagonal(a, n) > small * largest; sweep++)
        for (int p = 0; p < n; p++)
            for (int q = p + 1; q < n; q++)
                rotate(a, v, n, p, q);
}

void symmetric_cholesky(const double *m, double *l, int n, double least)
{
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double value = m[i * n + j];
            for (int k = 0; k < j; k++)
                value -= l[i * n + k] * l[j * n + k];
            l[i * n + j] = i == j ? sqrt(fmax(value, least)) : value / l[j * n + j];
        }
        for (int j = i + 1; j < n; j++)
            l[i * n + j] = 0;
    }
}

void symmetric_solve(const double *l, double *x, int n)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= l[i * n + k] * x[k];
        x[i] /= l[i * n + i];
    }
    for (int i = n; i-- > 0;) {
        for (int k = i + 1; k < n; k++)
            x[i] -= l[k * n + i] * x[k];
        x[i] /= l[i * n + i];
    }
}
