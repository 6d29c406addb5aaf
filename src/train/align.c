/* SPDX-License-Identifier: Apache-2.0 */
/* train/align.c -- align the poses of held-out photos by Adam on the gradient of the loss. */
#include "train/align.h"

#include <math.h>

#include "base/fail.h"
#include "base/stop_signal.h"

enum { LEVELS = 3, STEPS = 75, LEAST_ACROSS = 60, MOST_PIXELS = 1 << 19 };
static const double first_rate = 0.002, last_rate = 0.00003; /* radians */

/* Render a view from `camera`, compare it with the photo (through the photo's exposure), and put dL/drender
   into v->d_image. */
static gbt_status compare_view(trainer *t, step_view *v, size_t view, const gbt_camera *camera,
                               const unsigned char *photo_valid, gbt_error *err)
{
    GBT_TRY(step_view_draw(t, v, view, camera, true, err));
    const unsigned char *valid;
    image_loss_result loss;
    float matrix[AFFINE_NUMBERS];
    double unused[AFFINE_NUMBERS];
    GBT_TRY(frame_valid(&v->frame, photo_valid, &valid, err));
    const bool exposed = t->exposures.count > 0;
    if (exposed)
        affine_fit(&v->frame.rgb, &v->photo, valid, 0, v->frame.rgb.width, matrix);
    return step_view_compare(v, valid, exposed ? matrix : NULL, &loss, unused, err);
}

/* The finest level of at most MOST_PIXELS. */
static int finest_level(const trainer *t, size_t view)
{
    for (int level = 0;; level++) {
        const gbt_camera camera = photos_camera(&t->photos, view, level);
        if ((double)camera.width * camera.height <= MOST_PIXELS)
            return level;
    }
}

/* Number of image levels, coarse to fine, that the alignment goes through. */
static int level_count(const trainer *t, size_t view, int finest)
{
    int count = 1;
    for (; count < LEVELS; count++) {
        const gbt_camera camera = photos_camera(&t->photos, view, finest + count);
        if (camera.width < LEAST_ACROSS || camera.height < LEAST_ACROSS)
            break;
    }
    return count;
}

static gbt_status align_view(trainer *t, step_view *v, size_t view, gbt_error *err)
{
    gbt_camera *pose = &t->scene.views[view].camera;
    float moment1[POSE_NUMBERS] = {0}, moment2[POSE_NUMBERS] = {0};
    const int finest = finest_level(t, view), levels = level_count(t, view, finest);
    const unsigned char *valid = NULL;
    *pose = t->poses.given[view];
    for (int i = 0, before = -1; i < STEPS; i++) {
        if (stop_signal_seen())
            return base_fail(
                err, GBT_ERR_INTERRUPTED,
                "stopped while held-out photos were aligned; the run is saved (resume continues)");
        const int level = finest + levels - 1 - i * levels / STEPS;
        const gbt_camera camera = photos_camera(&t->photos, view, level);
        double gradient[POSE_NUMBERS], motion[POSE_NUMBERS];
        if (level != before)
            GBT_TRY(photos_get(&t->photos, view, level, &v->photo, &valid, err));
        before = level;
        GBT_TRY(compare_view(t, v, view, &camera, valid, err));
        GBT_TRY(frame_backward_gaussians(&v->frame, &v->d_image, err));
        GBT_TRY(frame_backward_pose(&v->frame, frame_neural(&t->anchors, &t->decoder), gradient, err));
        if (!pose_is_finite(gradient))
            return GBT_OK;
        pose_learn(moment1, moment2, gradient, t->poses.unit, (uint64_t)i + 1,
                   first_rate * pow(last_rate / first_rate, (double)i / STEPS), motion);
        *pose = gbt_camera_moved(pose, motion);
    }
    return GBT_OK;
}

gbt_status align_held_out(trainer *t, gbt_error *err)
{
    step_view *v = &t->views[0]; /* its memory is free between steps */
    for (size_t i = 0; i < t->scene.view_count; i++)
        if (t->scene.views[i].is_test)
            GBT_TRY(align_view(t, v, i, err));
    return GBT_OK;
}
