/* SPDX-License-Identifier: Apache-2.0 */
/* train/poses.h -- poses of the training photos, learned together with the scene.

   Moving scene and cameras together changes no image, so the poses are determined only up to a common motion.
   The mean motion of all cameras is therefore held at 0: whenever one camera moves, all move back by 1 /
   count of it. */
#ifndef GBT_TRAIN_POSES_H
#define GBT_TRAIN_POSES_H

#include <stdint.h>

#include "data/scene.h"

/** Numbers of a small motion, as in gbt_camera_moved(). */
enum { POSE_NUMBERS = 6 };

/** Numbers of a pose (rotation and centre) in checkpoints. */
enum { POSE_PACKED = 12 };

/** Start from {0}; free with poses_free(). */
typedef struct poses {
    size_t count;             /* training photos; 0: poses are not learned */
    double unit;              /* scene units: moving a camera by this length changes an image about as much as
                                 turning it by a radian */
    gbt_camera *given;        /* [scene.view_count] cameras of the data set */
    double *packed;           /* [scene.view_count][POSE_PACKED]: output of poses_pack() */
    float *moment1, *moment2; /* [count][POSE_NUMBERS] */
    uint64_t *visits;         /* [count] Adam steps of each */
    bool held_out_aligned;    /* held-out photos are aligned with the present scene (train/align.h) */
} poses;

/** Start learning the poses of `count` photos of `s`, whose cameras are taken as the given ones. `unit` >
    0. */
gbt_status poses_make(poses *p, const scene *s, size_t count, double unit, gbt_error *err);
void poses_free(poses *p);

/** The camera of a view in the data set, whether poses are learned or not. */
const gbt_camera *poses_given(const poses *p, const scene *s, size_t view);

/**
 * One Adam step of a single camera, without the correction of the others.
 *
 * @param moment1, moment2 [in,out] [POSE_NUMBERS], of the gradient with lengths measured in `unit`
 * @param gradient         [in]     from pose_gradient(); finite
 * @param age              [in]     >= 1, number of this step of the camera
 * @param motion           [out]    how the camera moves
 */
void pose_learn(float *moment1, float *moment2, const double gradient[POSE_NUMBERS], double unit,
                uint64_t age, double rate, double motion[POSE_NUMBERS]);

/** Whether all numbers are finite and below GRADIENT_LIMIT. */
bool pose_is_finite(const double gradient[POSE_NUMBERS]);

/** One Adam step of photo `index` of `train_views`, then restore the mean of all poses. `gradient` must be
    finite. */
void poses_step(poses *p, scene *s, const size_t *train_views, size_t index,
                const double gradient[POSE_NUMBERS], double rate);

/**
 * The learning rate, radians, such that in a run of any length a camera can turn by a few degrees. A photo is
 * used 1 / (count * step) times in a run. 0 at the beginning, when the scene shows nothing yet to align with.
 *
 * @param progress [in] [0, 1]
 * @param step     [in] progress per step
 */
double poses_rate(size_t count, double progress, double step);

/** Copy the poses of all views of `s` to p->packed, and back. Held-out views are not copied back: a finished
    run aligned them with the scene as it was then. */
void poses_pack(const poses *p, const scene *s);
void poses_unpack(const poses *p, scene *s);

/** Median over `views` of the angle (radians) and distance (scene units) between the cameras of `s` and the
    given ones. */
gbt_status poses_moved(const poses *p, const scene *s, const size_t *views, size_t count, double *angle,
                       double *distance, gbt_error *err);

#endif
