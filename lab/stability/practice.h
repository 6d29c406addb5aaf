/* SPDX-License-Identifier: Apache-2.0 */
/* stability/practice.h -- small data sets made of known Gaussians, and training runs on them, for the cases
   of the study "stability". */
#ifndef GBT_STABILITY_PRACTICE_H
#define GBT_STABILITY_PRACTICE_H

#include "stability/stability.h"
#include "train/trainer.h"

enum { PRACTICE_VIEWS_MAX = 64, PRACTICE_POINTS_MAX = 4096, PRACTICE_PATH_SIZE = 1024 };

/** A sphere of small Gaussians, and cameras around it. Cases may change everything before it is written. Free
    with practice_free(). */
typedef struct practice {
    gaussians truth;
    size_t view_count, point_count;
    gbt_camera camera[PRACTICE_VIEWS_MAX];
    float gain[PRACTICE_VIEWS_MAX]; /* a photo is the picture times this; NaN: a uniform grey of 0.5 */
    double point[PRACTICE_POINTS_MAX][3];
    unsigned char color[PRACTICE_POINTS_MAX][3];
    char folder[PRACTICE_PATH_SIZE];
} practice;

/**
 * Make `gaussian_count` Gaussians on the unit sphere, whose centres are the sparse points too, and cameras at
 * distance `radius` from its centre.
 *
 * @param arc_deg [in] the cameras stand on an arc of this many degrees in the plane y = 0; 360: a full ring
 */
practice *practice_make(stability *s, size_t gaussian_count, size_t view_count, double radius, double arc_deg,
                        int width, int height);
void practice_free(practice *p);

/** The settings with which photos are rendered: the defaults, and a uniform sky as background. */
trace_settings practice_settings(void);

/** A camera at `azimuth`, `elevation` and `radius` that looks at the centre, with the size of p's first
    camera. */
gbt_camera practice_camera(const practice *p, double azimuth_deg, double elevation_deg, double radius);

/** Write photos and a COLMAP model into a folder inside the study's; practice_remove() deletes it. */
void practice_write(stability *s, practice *p, const char *name);
void practice_remove(practice *p);

/** Open a trainer on the folder. A failure is returned, with its text in `why`, but does not fail the case.
 */
gbt_status practice_open(stability *s, const practice *p, const gbt_train_def *def, trainer *t,
                         gbt_error *why);

/** The outcome of a run. */
typedef struct practice_result {
    double psnr;     /* mean over the training photos, at 8 bits */
    double constant; /* the PSNR of a uniform picture in the mean colour of all training photos */
    size_t bad;      /* number of parameters and pixel values that are not finite */
    uint64_t skipped;
} practice_result;

/** Open a trainer, take all def->iterations steps and examine the result. Returns the status of the run,
    which does not fail the case. */
gbt_status practice_run(stability *s, const practice *p, const gbt_train_def *def, practice_result *out,
                        gbt_error *why);

/** Continue an open trainer up to def.iterations. */
gbt_status practice_steps(trainer *t, gbt_error *why);

#endif
