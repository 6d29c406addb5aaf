/* SPDX-License-Identifier: Apache-2.0 */
/* frame/subject.h -- what a frame renders: the neural Gaussians of anchors, or plain Gaussians. */
#ifndef GBT_FRAME_SUBJECT_H
#define GBT_FRAME_SUBJECT_H

#include "anchor/anchors.h"
#include "data/gaussian_cloud.h"

/** Either anchors with their networks, or a cloud. Borrowed. Visibility is decided for its parts, which are
    anchors or plain Gaussians. */
typedef struct frame_subject {
    const anchors *anchors;
    const decoder *decoder;
    const gaussian_cloud *cloud; /* NULL: neural */
} frame_subject;

static inline frame_subject frame_neural(const anchors *a, const decoder *d)
{
    return (frame_subject){.anchors = a, .decoder = d};
}

static inline frame_subject frame_plain(const gaussian_cloud *cloud)
{
    return (frame_subject){.cloud = cloud};
}

static inline size_t frame_subject_count(frame_subject s)
{
    return s.cloud != NULL ? s.cloud->count : s.anchors->count;
}

#endif
