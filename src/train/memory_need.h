/* SPDX-License-Identifier: Apache-2.0 */
/* train/memory_need.h -- what memory a training run takes, by parts, from the sizes of its data. */
#ifndef GBT_TRAIN_MEMORY_NEED_H
#define GBT_TRAIN_MEMORY_NEED_H

#include "data/scene.h"
#include "train/rules.h"

/** Bytes. Reading, trees and steps follow each other. */
typedef struct memory_need {
    double program;  /* its libraries, and buffers of threads */
    double reading;  /* the data set's files and what is kept of them, while they are read */
    double points;   /* sparse points, for the whole run */
    double trees;    /* over them, at the start */
    double decoding; /* photos as they are stored, while they are read; and small, while points are found */
    double photos, anchors, view; /* while steps are made: those that are kept; all that learns, and its copy
                                     while it is saved; one of the photos */
    double whole;                 /* the largest sum */
    double least;                 /* that a limit must leave: what can never be let go of */
} memory_need;

/** Of a run with the default settings, the pixels of a step by `rules`, and photos divided by `downscale` >
   0. Within a factor of 1.5 on scenes like those that it was measured on; a run that grows more anchors takes
   more. */
memory_need memory_need_of(const scene *s, double downscale, const train_rules *rules);

#endif
