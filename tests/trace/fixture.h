/* SPDX-License-Identifier: Apache-2.0 */
/* tests/trace/fixture.h -- Gaussians that several tests of this room start from. */
#ifndef GBT_TESTS_TRACE_FIXTURE_H
#define GBT_TESTS_TRACE_FIXTURE_H

#include "base/gaussians.h"
#include "test_support.h"

/* count copies of a round Gaussian of size 1 at the origin, white. */
static gaussians some(size_t count, float opacity)
{
    gaussians g = {0};
    assert_ok(gaussians_resize(&g, count, NULL));
    gaussians_zero(&g);
    for (size_t i = 0; i < count; i++) {
        g.scale_x[i] = g.scale_y[i] = g.scale_z[i] = 1;
        g.quat_w[i] = 1;
        g.opacity[i] = opacity;
        g.red[i] = g.green[i] = g.blue[i] = 1;
    }
    gaussians_pad(&g);
    return g;
}

#endif
