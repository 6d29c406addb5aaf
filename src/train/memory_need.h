/* SPDX-License-Identifier: Apache-2.0 */
/* train/memory_need.h -- estimate of the memory of a training run, by parts, from the sizes of its data. */
#ifndef GBT_TRAIN_MEMORY_NEED_H
#define GBT_TRAIN_MEMORY_NEED_H

#include "data/scene.h"
#include "train/rules.h"

/** Bytes. Reading, trees and steps are phases that follow each other. */
typedef struct memory_need {
    double program;  /* libraries and per-thread buffers */
    double reading;  /* the data set's files and what is kept of them, while they are read */
    double points;   /* sparse points, for the whole run */
    double trees;    /* search trees over the points, at the start */
    double decoding; /* photos as they are stored, while they are read; and small, while points are found */
    double photos, anchors, view; /* during training steps: the photos kept in memory; the trainable
                                     parameters with their copy while saving; the render of one photo */
    double whole;                 /* peak: the largest sum of parts that exist at the same time */
    double least;                 /* smallest possible memory limit: what can never be paged out */
} memory_need;

/** Estimate for a run with default settings, with the pixels per step of `rules` and photos divided by
    `downscale` > 0. It is within a factor of 1.5 on scenes like the measured ones; a run that grows more
    anchors needs more. */
memory_need memory_need_of(const scene *s, double downscale, const train_rules *rules);

#endif
