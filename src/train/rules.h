/* SPDX-License-Identifier: Apache-2.0 */
/* train/rules.h -- all points at which training may differ from the reference method (docs/compat.md). The
   struct is filled once, from `compat`; code then asks for the rule it needs and never for `compat`. */
#ifndef GBT_TRAIN_RULES_H
#define GBT_TRAIN_RULES_H

#include "frame/frame.h"
#include "gbtrace/train.h"
#include "growth/statistics.h"
#include "train/schedule.h"

typedef struct train_rules {
    /* settings that are left open, or decided */
    int offsets;                                    /* Gaussians per anchor */
    double ball_scale_factor, spacing_scale_factor; /* factors of the initial scales, for those from balls and
                                                       those from spacing */
    bool uses_footprint;                            /* rays as wide as pixels */

    /* the start */
    bool recentres;              /* local coordinates have their origin in the middle of the points; false:
                                    world coordinates, so that the cells of voxels and growth are those of the
                                    reference */
    float near_depth;            /* fixed near distance, scene units; 0: derived from the sparse points */
    bool limits_width;           /* of photos_usual_downscale() */
    bool finds_exposure;         /* exposures are learned when the photos differ in exposure */
    bool adds_to_few_points;     /* adds points found by photo consistency when the data set has few */
    bool limits_first_scale;     /* caps the initial scale, because an isolated point would start as a
                                    floater */
    float ball_radius_min;       /* balls_def.min_radius: BALLS_PAPER_MIN_RADIUS, or 0 */
    double widest;               /* upper bound of (width of a Gaussian) / (distance of its anchor to the
                                    nearest training camera); infinite: none */
    bool features_from_colors;   /* initial features contain the colour of the nearest point */
    bool background_from_points; /* the background is the mean colour of the points when the data set has
                                    none */
    gbt_voxel_rule voxel;        /* how v is estimated when it is not given */
    bool distance_where_wide;    /* "auto": the distance is an input of the networks when it varies widely */
    bool distance_by_median;     /* that input is divided by the median distance between cameras and
                                    anchors */

    /* what is seen */
    frame_sight sight;
    bool makes_faint; /* Gaussians with opacity below alpha_min, which are never rendered, still count in the
                         loss and as seen */

    /* a step */
    bool counts_from_one;  /* learning rates and growth use the progress after a step, and growth excludes its
                              first and last step; false: the progress before it */
    bool last_step_learns; /* false: parameters do not change in the last step of a run */
    double step_pixels;    /* approximate number of pixels per photo and step; infinite: all */
    double splats_until;   /* progress until which splats are rendered instead of rays */
    bool loose_rays;       /* SCHEDULE_ALPHA_MIN, SCHEDULE_T_MIN and one order for each packet of rays until
                              SCHEDULE_EXACT_FROM */
    double spread;         /* weight in the loss of how far apart the hits of a ray are, with loose rays:
                              trace_settings.spread times the number of rays */
    bool leaves_out;       /* a random share of the anchors is left out of each step: schedule_left_out() */
    double raises_until;   /* progress until which the opacities of an offset are raised when their mean is
                              below 0 */
    double opaque_from;    /* progress from which half of the views have a random background, so that
                              surfaces become opaque; HUGE_VAL: never */
    bool own_rates;        /* our higher learning rates, which fall to nearly 0 at the end */
    double begins_at;      /* progress at which the model begins, once poses have settled: before it, offsets
                              and scales do not change; at it, networks and features start again; growth is
                              that much later */
    bool anchors_learn_when_adjusted; /* false: anchors skip the optimizer step in which growth adjusts
                                         them */

    /* growing and pruning */
    growth_importance importance;      /* measure of an anchor's importance, used for pruning */
    growth_counting gradient_counting; /* in which views the gradient of a Gaussian counts */
    bool own_adam_age;         /* Adam's bias correction of an anchor counts steps from its creation; false:
                                  from the start of the run */
    bool rounds_by_progress;   /* a growth round per hundredth of the run; false: every 100 steps */
    bool thresholds_by_length; /* growth and pruning thresholds are scaled by schedule_threshold_factor() and
                                  the settings' factors */
    bool grows_at_points;      /* sparse points are candidates too */
    bool needs_two_views;      /* new anchors must be in view of two training photos */
    bool integer_division;     /* cell sizes and thresholds of levels use integer division: 4 / 16 is 0 */
    bool coarse_level_gates;   /* finer levels are searched only after a coarser level has added an anchor */
    bool at_cell_center;       /* new anchors are placed at the centre of their cell; false: at the
                                  candidate */
    float shape_log_max;       /* scale_log[3..5] are clamped to this in each round */
} train_rules;

/** The rules for these settings: ours, or with `compat` all of the reference. */
train_rules train_rules_of(const gbt_train_def *def);

/** Does a step at this progress use loose rays: coarser cut-offs, and one blending order per packet of
    rays? */
bool train_rules_are_loose(const train_rules *rules, double progress);

/** The progress that decides learning rates and growth of a step (0-based). */
double train_rules_progress(const train_rules *rules, const pace *p, uint64_t step);

/** How a model trained with these settings is rendered, without the per-anchor pixel sizes. */
frame_drawing train_drawing_of(const gbt_train_def *def);

#endif
