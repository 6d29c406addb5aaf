/* SPDX-License-Identifier: Apache-2.0 */
/* base/camera_axes.c -- the point nearest to all optical axes, and whether it is well determined. */
#include "base/camera_axes.h"

#include <string.h>

#include "base/symmetric.h"
#include "base/vec.h"

bool camera_axes_meet(const gbt_camera *cameras, size_t count, const double middle[3], double out[3])
{
    double a[9] = {0}, b[3] = {0}, v[9];
    for (size_t i = 0; i < count; i++) {
        const double *d = cameras[i].rotation + 6;
        for (int row = 0; row < 3; row++)
            for (int k = 0; k < 3; k++) {
                const double m = ((row == k) - d[row] * d[k]) / (double)count;
                a[3 * row + k] += m;
                b[row] += m * (cameras[i].center[k] - middle[k]);
            }
    }
    symmetric_eigen(a, v, 3, 1e-15);
    memcpy(out, middle, 3 * sizeof *out);
    for (int k = 0; k < 3; k++) {
        const double column[3] = {v[k], v[3 + k], v[6 + k]};
        if (!(a[4 * k] > 0.01))
            return false;
        for (int row = 0; row < 3; row++)
            out[row] += column[row] * dvec_dot(column, b) / a[4 * k];
    }
    size_t in_front = 0;
    for (size_t i = 0; i < count; i++) {
        double way[3];
        for (int k = 0; k < 3; k++)
            way[k] = out[k] - cameras[i].center[k];
        in_front += dvec_dot(way, cameras[i].rotation + 6) > 0;
    }
    return 2 * in_front > count;
}
