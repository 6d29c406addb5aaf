/* SPDX-License-Identifier: Apache-2.0 */
/* study/anchors.h -- what the study "anchors" trains, what came out, and how it is written down. */
#ifndef GBT_STUDY_ANCHORS_H
#define GBT_STUDY_ANCHORS_H

#include "lab/lab.h"
#include "study/grid.h"
#include "study/runs_stat.h"

enum {
    ANCHORS_VOXELS = 0, /* the two that others are compared with */
    ANCHORS_BALLS = 1,
    ANCHORS_ADAPTIVE = 2
};

typedef struct anchors_variant {
    const char *name;     /* in tables; of its folder, what is no letter or digit as '-' */
    const char *settings; /* what differs from the default: lines as in a run's `config` */
} anchors_variant;

extern const anchors_variant anchors_variants[];
extern const size_t anchors_variant_count;

/** How it is written down. */
extern const study_output anchors_output;

#endif
