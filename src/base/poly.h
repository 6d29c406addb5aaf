/* SPDX-License-Identifier: Apache-2.0 */
/* base/poly.h -- sign changes of a real polynomial of low degree on the positive axis. */
#ifndef GBT_BASE_POLY_H
#define GBT_BASE_POLY_H

#include <math.h>
#include <stdbool.h>

enum { POLY_LIMIT = 12 }; /* coefficients */

/** c[0] + c[1] x + ... + c[degree] x^degree. */
static inline double poly_at(const double *c, int degree, double x)
{
    double sum = c[degree];
    for (int i = degree - 1; i >= 0; i--)
        sum = sum * x + c[i];
    return sum;
}

/** poly_roots() for degree 1 and 2, in closed form. */
static inline int poly_quadratic_roots(const double c[3], double upper, double roots[2])
{
    double found[2];
    int found_count = 0, kept = 0;
    const double discriminant = c[1] * c[1] - 4 * c[0] * c[2];
    if (discriminant <= 0) /* a double root is not a sign change */
        return 0;
    const double q = -0.5 * (c[1] + copysign(sqrt(discriminant), c[1])); /* avoids cancellation */
    found[found_count++] = c[0] / q;
    if (c[2] != 0)
        found[found_count++] = q / c[2];
    if (found_count == 2 && found[0] > found[1]) {
        const double swap = found[0];
        found[0] = found[1];
        found[1] = swap;
    }
    for (int i = 0; i < found_count; i++)
        if (found[i] > 0 && found[i] < upper)
            roots[kept++] = found[i];
    return kept;
}

/** Sign changes of a polynomial of degree < POLY_LIMIT in (0, upper), ascending. Between two extrema there is
    at most one. */
static inline int poly_roots(const double *c, int degree, double upper, double roots[POLY_LIMIT])
{
    while (degree > 0 && c[degree] == 0)
        degree--;
    if (degree == 0)
        return 0;
    if (degree <= 2)
        return poly_quadratic_roots((const double[3]){c[0], c[1], degree == 2 ? c[2] : 0}, upper, roots);
    double slope[POLY_LIMIT], turns[POLY_LIMIT];
    for (int i = 1; i <= degree; i++)
        slope[i - 1] = i * c[i];
    const int turn_count = poly_roots(slope, degree - 1, upper, turns);
    int count = 0;
    double begin = 0;
    for (int i = 0; i <= turn_count; i++) {
        const double end = i < turn_count ? turns[i] : upper;
        double lo = begin, hi = end;
        const bool positive = poly_at(c, degree, lo) > 0;
        if (positive != (poly_at(c, degree, hi) > 0)) {
            for (int step = 0; step < 200; step++) {
                const double middle = 0.5 * (lo + hi);
                if (middle <= lo || middle >= hi)
                    break;
                if ((poly_at(c, degree, middle) > 0) == positive)
                    lo = middle;
                else
                    hi = middle;
            }
            roots[count++] = lo;
        }
        begin = end;
    }
    return count;
}

/** The first of them, or `upper` when there is none. */
static inline double poly_first_root(const double *c, int degree, double upper)
{
    bool negative = false;
    for (int i = 0; i <= degree; i++)
        negative = negative || c[i] < 0;
    double roots[POLY_LIMIT];
    return negative && poly_roots(c, degree, upper, roots) > 0 ? roots[0] : upper;
}

#endif
