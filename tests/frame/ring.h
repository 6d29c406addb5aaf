/* SPDX-License-Identifier: Apache-2.0 */
/* tests/frame/ring.h -- small pinhole cameras on a ring around the origin, looking at it. */
#ifndef GBT_TESTS_FRAME_RING_H
#define GBT_TESTS_FRAME_RING_H

#include "base/vec.h"
#include "gbtrace/camera.h"

enum { CAMERAS = 12, W = 48, H = 36 };

static inline gbt_camera ring_camera(int i)
{
    const double turn = 6.283185307179586 * i / CAMERAS, distance = 7;
    gbt_camera camera = {
        .model = GBT_CAMERA_PINHOLE, .width = W, .height = H, .params = {50, 50, 0.5 * W, 0.5 * H}};
    const double forward[3] = {-cos(turn), -0.3 * sin(3 * turn), -sin(turn)};
    double z[3] = {forward[0], forward[1], forward[2]}, x[3], y[3];
    dvec_normalize(z);
    dvec_cross((const double[3]){0, 1, 0}, z, x);
    dvec_normalize(x);
    dvec_cross(z, x, y);
    for (int k = 0; k < 3; k++) {
        camera.rotation[k] = x[k];
        camera.rotation[3 + k] = y[k];
        camera.rotation[6 + k] = z[k];
        camera.center[k] = -distance * z[k];
    }
    return camera;
}

#endif
