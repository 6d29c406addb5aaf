/* SPDX-License-Identifier: Apache-2.0 */
/* stability/practice.h -- small data sets made of known Gaussians, and training runs on them, for the cases
   of the study "stability". */
#ifndef GBT_STABILITY_PRACTICE_H
#define GBT_STABILITY_PRACTICE_H

#include "stability/draw.h"
#include "train/trainer.h"

enum { PRACTICE_VIEWS_MAX = 64, PRACTICE_POINTS_MAX = 4096, PRACTICE_PATH_SIZE = 1024 };

/** A sphere of small Gaussians in front of cameras; everything may be changed before it is written. Free with
    practice_free(). */
typedef struct practice {
    gaussians truth;
    size_t view_count, point_count;
    gbt_camera camera[PRACTICE_VIEWS_MAX];
    float gain[PRACTICE_VIEWS_MAX]; /* a photo is the picture times this; NaN: an even grey of 0.5 */
    double point[PRACTICE_POINTS_MAX][3];
    unsigned char color[PRACTICE_POINTS_MAX][3];
    char folder[PRACTICE_PATH_SIZE];
} practice;

/**
 * `gaussian_count` Gaussians on the unit sphere (they are the points too), and cameras at `radius` from its
 * middle.
 *
 * @param arc_deg [in] cameras stand on an arc of so many degrees in the plane y = 0, 360: on a ring
 */
practice *practice_make(stability *s, size_t gaussian_count, size_t view_count, double radius, double arc_deg,
                        int width, int height);
void practice_free(practice *p);

/** How the photos are rendered: the default, in front of an even sky. */
trace_settings practice_settings(void);

/** A camera of p's first size at `azimuth`, `elevation` and `radius` that looks at the middle. */
gbt_camera practice_camera(const practice *p, double azimuth_deg, double elevation_deg, double radius);

/** Photos and a COLMAP model into a folder of the study; practice_remove() takes it away. */
void practice_write(stability *s, practice *p, const char *name);
void practice_remove(practice *p);

/** Open a trainer on the folder. Its failure is not the case's: it is returned, and says why in `why`. */
gbt_status practice_open(stability *s, const practice *p, const gbt_train_def *def, trainer *t,
                         gbt_error *why);

/** What a run came to. */
typedef struct practice_result {
    double psnr;     /* mean over the training photos, 8 bit */
    double constant; /* the same of one colour, the mean of all training photos */
    size_t bad;      /* values of parameters and pictures that are not finite */
    uint64_t skipped;
} practice_result;

/** Open, take all steps of def->iterations, look at the result. Returns what the run says; the case goes
    on. */
gbt_status practice_run(stability *s, const practice *p, const gbt_train_def *def, practice_result *out,
                        gbt_error *why);

/** Take the steps of an opened trainer up to def.iterations. */
gbt_status practice_steps(trainer *t, gbt_error *why);

#endif
