/* SPDX-License-Identifier: Apache-2.0 */
/* train/rules.h -- where training follows the reference method to the letter and where it does not
   (docs/compat.md). Filled once, from `compat`; everything else reads the rule it needs. */
#ifndef GBT_TRAIN_RULES_H
#define GBT_TRAIN_RULES_H

#include "frame/frame.h"
#include "gb/balls.h"
#include "gbtrace/train.h"
#include "growth/statistics.h"
#include "train/schedule.h"

typedef struct train_rules {
    /* settings that are left open, or decided */
    int offsets;                                    /* Gaussians per anchor */
    double ball_scale_factor, spacing_scale_factor; /* of first scales from balls, from spacing */
    bool uses_footprint;                            /* rays as wide as pixels */

    /* the start */
    bool recentres;              /* local coordinates begin in the middle of the points; else the cells of
                                    voxels and of growth are where the world's coordinates put them */
    float near_depth;            /* scene units: nothing nearer; 0: than the sparse points let it be */
    bool limits_width;           /* of photos_usual_downscale() */
    bool finds_exposure;         /* exposure is learned where photos differ in it */
    bool adds_to_few_points;     /* by photo consistency, where the data set has few points */
    bool limits_first_scale;     /* an isolated point would start as a floater */
    float ball_radius_min;       /* balls_def.min_radius: BALLS_PAPER_MIN_RADIUS, or 0 */
    double widest;               /* a Gaussian is at most so many times as wide as its anchor is far from the
                                    nearest training camera; infinite: no bound */
    bool features_from_colors;   /* first features carry the colour of the nearest point */
    bool background_from_points; /* their mean colour, where the data set has none */
    gbt_voxel_rule voxel;        /* what v is where it is not given */
    bool distance_where_wide;    /* "auto": the networks see the distance where it varies widely */
    bool distance_by_median;     /* in units of the median distance of anchors */

    /* what is seen */
    frame_sight sight;
    bool makes_faint; /* Gaussians of opacity below alpha_min count in the loss and as seen, though nobody
                         draws them */

    /* a step */
    bool counts_from_one;  /* rates and growth go by the progress after a step, and growth leaves
                              out its first and last one; else by the progress before it */
    bool last_step_learns; /* else nothing changes in the last step of a run */
    double step_pixels;    /* a step looks at about as many of a photo's; infinite: at all */
    double splats_until;   /* part of the run in which splats stand for rays */
    bool loose_rays;       /* SCHEDULE_ALPHA_MIN, SCHEDULE_T_MIN and one order for each packet of rays until
                              SCHEDULE_EXACT_FROM */
    bool leaves_out;       /* anchors at random: schedule_left_out() */
    double raises_until;   /* progress until which the opacities of an offset that is below 0 in the
                              mean are raised */
    double opaque_from;    /* progress from which half of the views have a random background, so that
                              surfaces become opaque; HUGE_VAL: never */
    bool own_rates;        /* higher learning rates, that fall to nothing in the end */
    double geometry_from;  /* progress from which offsets and scales learn, and anchors may grow
                              and be pruned */
    bool anchors_learn_when_adjusted; /* else they miss the step in which anchors change */

    /* growing and pruning */
    growth_importance importance;      /* by which anchors are pruned */
    growth_counting gradient_counting; /* in which views the gradient of a Gaussian counts */
    bool own_adam_age;         /* Adam's age of an anchor is from its start; else from the run's start */
    bool rounds_by_progress;   /* each hundredth of the run; else every 100 steps */
    bool thresholds_by_length; /* of growing and pruning: schedule_threshold_factor() and the settings'
                                  factors */
    bool grows_at_points;      /* sparse points are candidates too */
    bool needs_two_views;      /* new anchors stand where two training photos look */
    bool integer_division;     /* of cell sizes and thresholds of levels: 4 / 16 is 0 */
    bool coarse_level_gates;   /* while no level has added an anchor, finer ones are not searched */
    bool at_cell_center;       /* new anchors stand in the middle of their cell; else at the candidate */
    float shape_log_max;       /* scale_log[3..5] are cut to this in a round */
} train_rules;

/** The rules for these settings: ours, or with `compat` all of the reference. */
train_rules train_rules_of(const gbt_train_def *def);

/** Does a step trade exactness for speed: cut-offs, and one order for neighbouring rays? */
bool train_rules_are_loose(const train_rules *rules, double progress);

/** By which the learning rates of a step (0-based) and its growth go. */
double train_rules_progress(const train_rules *rules, const pace *p, uint64_t step);

/** How a model trained with these settings is drawn, but for the sizes of anchors' pixels. */
frame_drawing train_drawing_of(const gbt_train_def *def);

#endif
