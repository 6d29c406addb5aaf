/* SPDX-License-Identifier: Apache-2.0 */
/* train/def.c -- the settings of training: defaults, ranges, and what 0 stands for. */
#include "train/def.h"

#include <string.h>

#include "anchor/init.h"
#include "base/fail.h"
#include "frame/frame.h"
#include "train/rules.h"

static const double default_budget_seconds = 600;

gbt_train_def gbt_train_def_default(void)
{
    return (gbt_train_def){.init = "gb",
                           .init_count = anchor_init_def_default().fraction,
                           .scale_prior = "gb",
                           .max_depth = 18,
                           .distance = "auto",
                           .downscale = 1,
                           .renderer = "trace",
                           .footprint = 0.1,
                           .near = 0.5,
                           .start_level = 2,
                           .eval_split = "auto",
                           .alpha = "auto",
                           .max_anchors = 2000000,
                           .grow = true,
                           .thrift = 1,
                           .last_thrift = 4,
                           .splats_until = 0.7,
                           .grow_until = 0.5,
                           .learning_rate_factor = 1,
                           .save_every_seconds = 120,
                           .command = "",
                           .cookie_ = 0x67627431};
}

gbt_status train_def_check(const gbt_train_def *d, gbt_error *err)
{
    if (d->cookie_ != 0x67627431)
        return base_fail(err, GBT_ERR_ARGUMENT, "train: the def was not made by gbt_train_def_default()");
    anchor_init_kind unused_kind;
    if (!anchor_init_kind_named(d->init, &unused_kind))
        return base_fail(err, GBT_ERR_ARGUMENT, "--init: \"%.40s\" (wanted gb, adaptive, voxel or random)",
                         d->init);
    if (!(d->init_count >= 0 && d->init_count <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "--init-count: %g (wanted 0 to 1)", d->init_count);
    if (strcmp(d->scale_prior, "gb") != 0 && strcmp(d->scale_prior, "nn") != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--scale-prior: \"%.40s\" (wanted gb or nn)", d->scale_prior);
    if (strcmp(d->distance, "auto") != 0 && strcmp(d->distance, "on") != 0 && strcmp(d->distance, "off") != 0)
        return base_fail(err, GBT_ERR_ARGUMENT, "--distance: \"%.40s\" (wanted auto, on or off)",
                         d->distance);
    if (d->max_depth < 0 || d->max_depth > 64)
        return base_fail(err, GBT_ERR_ARGUMENT, "--max-depth: %d (wanted 0 to 64)", d->max_depth);
    if (d->offsets < 0 || d->offsets > ANCHOR_MAX_OFFSETS)
        return base_fail(err, GBT_ERR_ARGUMENT, "--offsets: %d (wanted 0 to %d)", d->offsets,
                         ANCHOR_MAX_OFFSETS);
    if (!(d->downscale >= 1 && d->downscale <= 64))
        return base_fail(err, GBT_ERR_ARGUMENT, "--downscale: %g (wanted 1 to 64)", d->downscale);
    frame_renderer unused;
    if (!frame_renderer_named(d->renderer, &unused))
        return base_fail(err, GBT_ERR_ARGUMENT, "--renderer: \"%.40s\" (wanted trace, raster or per-ray)",
                         d->renderer);
    if (!(d->footprint >= 0 && d->footprint <= 4))
        return base_fail(err, GBT_ERR_ARGUMENT, "--footprint: %g (wanted 0 to 4)", d->footprint);
    if (!(d->near >= 0 && d->near <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "--near: %g (wanted 0 to 1)", d->near);
    if (d->start_level < 0 || d->start_level > 4)
        return base_fail(err, GBT_ERR_ARGUMENT, "--start-level: %d (wanted 0 to 4)", d->start_level);
    if (!(d->voxel_size >= 0 && d->voxel_size < 1e9f))
        return base_fail(err, GBT_ERR_ARGUMENT, "--voxel-size: %g (wanted 0 or more)", (double)d->voxel_size);
    if (!(d->budget_seconds >= 0 && d->budget_seconds < 1e9))
        return base_fail(err, GBT_ERR_ARGUMENT, "--budget: %g s (wanted 0 or more)", d->budget_seconds);
    if (d->resume && d->overwrite)
        return base_fail(err, GBT_ERR_ARGUMENT,
                         "--resume goes on with a run, --overwrite loses it (wanted one of them)");
    if (!(d->learning_rate_factor >= 1e-3 && d->learning_rate_factor <= 1e3))
        return base_fail(err, GBT_ERR_ARGUMENT, "--learning-rate: %g (wanted 0.001 to 1000)",
                         d->learning_rate_factor);
    if (!(d->splats_until >= 0 && d->splats_until <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "--splats-until: %g (wanted 0 to 1)", d->splats_until);
    if (!(d->grow_until >= 0 && d->grow_until <= 1))
        return base_fail(err, GBT_ERR_ARGUMENT, "--grow-until: %g (wanted 0 to 1)", d->grow_until);
    if (!(d->scale_factor == 0 || (d->scale_factor >= 0.01 && d->scale_factor <= 100)))
        return base_fail(err, GBT_ERR_ARGUMENT, "--scale-factor: %g (wanted 0.01 to 100, or 0)",
                         d->scale_factor);
    if (!(d->thrift >= 0.1 && d->thrift <= 10))
        return base_fail(err, GBT_ERR_ARGUMENT, "--thrift: %g (wanted 0.1 to 10)", d->thrift);
    if (!(d->last_thrift >= 1 && d->last_thrift <= 100))
        return base_fail(err, GBT_ERR_ARGUMENT, "--last-thrift: %g (wanted 1 to 100)", d->last_thrift);
    if (d->max_anchors < 1)
        return base_fail(err, GBT_ERR_ARGUMENT, "--max-anchors: 0 (wanted 1 or more)");
    return GBT_OK;
}

void train_def_settle(gbt_train_def *d)
{
    const train_rules rules = train_rules_of(d);
    if (d->budget_seconds == 0)
        d->budget_seconds = default_budget_seconds;
    if (d->offsets == 0)
        d->offsets = rules.offsets;
    if (d->scale_factor == 0) {
        const bool from_balls = strcmp(d->init, "gb") == 0 && strcmp(d->scale_prior, "gb") == 0;
        d->scale_factor = from_balls ? rules.ball_scale_factor : rules.spacing_scale_factor;
    }
    if (!rules.uses_footprint)
        d->footprint = 0;
    if (!rules.uses_near)
        d->near = 0;
}
