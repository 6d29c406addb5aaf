/* SPDX-License-Identifier: Apache-2.0 */
/* study/anchors.h -- the study "anchors": its variants, and its output. */
#ifndef GBT_STUDY_ANCHORS_H
#define GBT_STUDY_ANCHORS_H

#include "study/output.h"

enum {
    ANCHORS_VOXELS = 0, /* the two with which the others are compared */
    ANCHORS_BALLS = 1,
    ANCHORS_ADAPTIVE = 2
};

typedef struct anchors_variant {
    const char *name; /* in tables, and of its folder, where characters other than letters and digits become
                         '-' */
    const char *settings; /* differences from the default settings: lines as in a run's `config` */
} anchors_variant;

extern const anchors_variant anchors_variants[];
extern const size_t anchors_variant_count;

/** The files that the study writes. */
extern const study_output anchors_output;

#endif
