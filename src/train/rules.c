/* SPDX-License-Identifier: Apache-2.0 */
/* train/rules.c -- the values of train_rules for our method and for the reference. */
#include "train/rules.h"

#include <math.h>

#include "gb/balls.h"
#include "train/def.h"
#include "train/schedule.h"

static train_rules own_rules(const gbt_train_def *def)
{
    const double begins_at = def->refine_poses ? SCHEDULE_POSES_SETTLED : 0;
    return (train_rules){
        .offsets = 2,           /* fewer than in the reference: better models at equal time */
        .ball_scale_factor = 2, /* the ball prior gives scales below the spacing of the balls */
        .spacing_scale_factor = TRAIN_SPACING_SCALE,
        .uses_footprint = true,
        .recentres = true,
        .limits_width = true,
        .finds_exposure = true,
        .adds_to_few_points = true,
        .limits_first_scale = true,
        .widest = 0.3,
        .features_from_colors = true,
        .background_from_points = true,
        .voxel = GBT_VOXEL_RULE_MEDIAN,
        .distance_where_wide = true,
        .distance_by_median = true,
        .step_pixels = def->step_pixels > 0 ? def->step_pixels : HUGE_VAL,
        .splats_until = def->splats_until,
        .loose_rays = true,
        .spread = 0.1,
        .leaves_out = true,
        .raises_until = begins_at + SCHEDULE_ADJUST_FROM, /* anchors grow from there */
        .opaque_from = SCHEDULE_OPAQUE_FROM,
        .last_step_learns = true,
        .own_rates = true,
        .begins_at = begins_at,
        .anchors_learn_when_adjusted = true,
        .importance = GROWTH_BY_SHARE,
        .gradient_counting = GROWTH_COUNT_BLENDED,
        .own_adam_age = true,
        .rounds_by_progress = true,
        .thresholds_by_length = true,
        .grows_at_points = true,
        .needs_two_views = true,
        .integer_division = false,
        .coarse_level_gates = false,
        .at_cell_center = false,
        .shape_log_max = INFINITY,
    };
}

/* Rules that are not named here are false or 0. */
static train_rules reference_rules(void)
{
    return (train_rules){
        .offsets = 10,
        .ball_scale_factor = 1,
        .spacing_scale_factor = 1,
        .near_depth = 0.2f,
        .ball_radius_min = BALLS_PAPER_MIN_RADIUS,
        .widest = INFINITY,
        .voxel = GBT_VOXEL_RULE_SQUARED,
        .sight = FRAME_SIGHT_BY_ANCHOR,
        .makes_faint = true,
        .counts_from_one = true,
        .step_pixels = HUGE_VAL,
        .splats_until = 0,
        .opaque_from = HUGE_VAL,
        .importance = GROWTH_BY_OPACITY,
        .gradient_counting = GROWTH_COUNT_IN_CONE,
        .integer_division = true,
        .coarse_level_gates = true,
        .at_cell_center = true,
        .shape_log_max = 0.05f,
    };
}

train_rules train_rules_of(const gbt_train_def *def)
{
    return def->compat ? reference_rules() : own_rules(def);
}

bool train_rules_are_loose(const train_rules *rules, double progress)
{
    return rules->loose_rays && progress < SCHEDULE_EXACT_FROM;
}

double train_rules_progress(const train_rules *rules, const pace *p, uint64_t step)
{
    return pace_progress(p, rules->counts_from_one ? step + 1 : step);
}

frame_drawing train_drawing_of(const gbt_train_def *def)
{
    return (frame_drawing){
        .renderer = def->renderer, .footprint = (float)def->footprint, .sight = train_rules_of(def).sight};
}
