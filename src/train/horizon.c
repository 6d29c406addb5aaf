/* SPDX-License-Identifier: Apache-2.0 */
/* train/horizon.c -- find which way is up from how the photos were held. */
#include "train/horizon.h"

#include "base/vec.h"

static const double least_agreement = 0.5;

bool horizon_find(const scene *s, const size_t *views, size_t count, float up[3])
{
    double sum[3] = {0, 0, 0};
    for (size_t v = 0; v < count; v++)
        for (size_t k = 0; k < 3; k++) /* the second row of a rotation is what is down in the photo */
            sum[k] -= s->views[views[v]].camera.rotation[3 + k];
    const double length = dvec_length(sum);
    const bool agree = length >= least_agreement * (double)count;
    for (int k = 0; k < 3; k++)
        up[k] = agree ? (float)(sum[k] / length) : 0;
    return agree;
}
