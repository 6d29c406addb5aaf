/* SPDX-License-Identifier: Apache-2.0 */
/* train/seen_points.c -- do the training photos see the sparse points? */
#include "train/seen_points.h"

#include "train/camera_sees.h"

enum { ASKED_MOST = 1 << 14 };

/* Try every n-th point first, because consecutive points often lie close together. */
static bool sees_a_point(const gbt_camera *camera, const scene_points *points)
{
    const size_t stride = points->count / 512 + 1;
    size_t asked = 0;
    for (size_t first = 0; first < stride; first++)
        for (size_t i = first; i < points->count && asked < ASKED_MOST; i += stride, asked++)
            if (camera_sees(camera, points->position + 3 * i, NULL))
                return true;
    return false;
}

bool seen_points_match_cameras(const scene *s)
{
    size_t count = 0, seeing = 0, blind = 0;
    for (size_t v = 0; v < s->view_count; v++)
        count += !s->views[v].is_test;
    for (size_t v = 0; v < s->view_count && 2 * seeing < count && 2 * blind <= count; v++) {
        if (s->views[v].is_test)
            continue;
        if (sees_a_point(&s->views[v].camera, &s->points))
            seeing++;
        else
            blind++;
    }
    return 2 * seeing >= count;
}
