/* SPDX-License-Identifier: Apache-2.0 */
/* train/poses.h -- where the training photos were taken, learned beside the scene.

   Scene and poses can be moved together and nothing changes in the photos, so the mean motion of all is held
   at 0: whenever one camera moves, all move back by its share. */
#ifndef GBT_TRAIN_POSES_H
#define GBT_TRAIN_POSES_H

#include <stdint.h>

#include "data/scene.h"

/** A small motion: as gbt_camera_moved() takes it. */
enum { POSE_NUMBERS = 6 };

/** Rotation and centre of a camera, as checkpoints keep them. */
enum { POSE_PACKED = 12 };

/** Start from {0}; free with poses_free(). */
typedef struct poses {
    size_t count;      /* training photos; 0: poses are not learned */
    double unit;       /* scene units: a move by it changes a picture about as much as a turn by a radian */
    gbt_camera *given; /* [scene.view_count] as the data set has them */
    double *packed;    /* [scene.view_count][POSE_PACKED]: room for poses_pack() */
    float *moment1, *moment2; /* [count][POSE_NUMBERS] */
    uint64_t *visits;         /* [count] Adam steps of each */
    bool held_out_aligned;    /* held-out photos, to the scene as it is (train/align.h) */
} poses;

/** Of `count` photos of `s`, whose cameras are the given ones. `unit` > 0. */
gbt_status poses_make(poses *p, const scene *s, size_t count, double unit, gbt_error *err);
void poses_free(poses *p);

/** The camera of a view as the data set has it, whether poses are learned or not. */
const gbt_camera *poses_given(const poses *p, const scene *s, size_t view);

/**
 * One Adam step of a single camera; the others are not looked at.
 *
 * @param moment1, moment2 [in,out] [POSE_NUMBERS], of a gradient in which lengths are counted in `unit`
 * @param gradient         [in]     as pose_gradient() gives it; finite
 * @param age              [in]     >= 1, counts the steps of this camera
 * @param motion           [out]    how the camera moves
 */
void pose_learn(float *moment1, float *moment2, const double gradient[POSE_NUMBERS], double unit,
                uint64_t age, double rate, double motion[POSE_NUMBERS]);

/** Finite, and below GRADIENT_LIMIT. */
bool pose_is_finite(const double gradient[POSE_NUMBERS]);

/** One step of photo `index` of `train_views`, and the mean back to where it was. `gradient` is finite. */
void poses_step(poses *p, scene *s, const size_t *train_views, size_t index,
                const double gradient[POSE_NUMBERS], double rate);

/**
 * The learning rate, radians: a photo is seen 1 / (count * step) times in a run, and must come a few degrees
 * far. 0 in the beginning, when there is nothing yet to look at.
 *
 * @param progress [in] [0, 1]
 * @param step     [in] progress that one step makes
 */
double poses_rate(size_t count, double progress, double step);

/** The poses of all views of `s` to p->packed; and back, but of held-out ones: a finished run aligned these
   to the scene as it was then. */
void poses_pack(const poses *p, const scene *s);
void poses_unpack(const poses *p, scene *s);

/** How far the cameras of `s` stand from the given ones, in the median over `views`: radians, scene units. */
gbt_status poses_moved(const poses *p, const scene *s, const size_t *views, size_t count, double *angle,
                       double *distance, gbt_error *err);

#endif
