/* SPDX-License-Identifier: Apache-2.0 */
/* io/model.h -- the scene model: anchors, decoder, and what a render needs to know about the scene. */
#ifndef GBT_IO_MODEL_H
#define GBT_IO_MODEL_H

#include <stdint.h>

#include "anchor/anchors.h"
#include "base/sky.h"

enum { MODEL_FOLDER_SIZE = 1024, MODEL_CONFIG_SIZE = 4096 };

typedef struct model {
    anchors anchors;
    float *anchor_pixel; /* optional (NULL), [anchors.count]: smallest pixel footprint at which a training
                            view saw the anchor, scene units, >= 0; 0: none saw it */
    decoder decoder;     /* decoder.offset_count equals anchors.offset_count */
    double origin[3];    /* world = local + origin */
    float voxel_size;    /* v, scene units, >= 0 */
    float extent;        /* extent of the training cameras, scene units, >= 0 */
    float background[3];
    sky sky;      /* light from far away, which depends on the direction; added to `background` */
    float t_near; /* scene units, >= 0 */
    char data_folder[MODEL_FOLDER_SIZE]; /* the data set it was trained on */
    char config[MODEL_CONFIG_SIZE];      /* key = value lines: how it was trained */
    uint64_t iterations;
} model;

/** Frees what the model owns and zeroes it. */
void model_free(model *m);

#endif
