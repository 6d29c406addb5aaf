/* SPDX-License-Identifier: Apache-2.0 */
/* data/result_folder.h -- the result folder of the 3DGS reference implementation and its descendants: where
   the Gaussians are, and the settings they were trained with. */
#ifndef GBT_DATA_RESULT_FOLDER_H
#define GBT_DATA_RESULT_FOLDER_H

#include <stdbool.h>

#include "gbtrace/status.h"

enum { RESULT_PATH_SIZE = 4096 };

typedef struct result_folder {
    char ply[RESULT_PATH_SIZE];    /* FOLDER/point_cloud/iteration_N/point_cloud.ply of the largest N */
    unsigned long iteration;       /* N */
    char source[RESULT_PATH_SIZE]; /* source_path in cfg_args, the data set; empty when not given */
    bool white_background;         /* from cfg_args */
    double downscale; /* factor by which the data set's photos were reduced, from resolution and images_N in
                         cfg_args; 0: not given */
    int width;        /* `resolution` as a width to which photos were resized; 0: it is not a width */
    int reduced; /* N of images_N if `resolution` does not fix the size: the photos were reduced by N, and
                    wider ones then to the default width; else 0 */
} result_folder;

/**
 * Inspect `folder`. `*found` is false when it has no point_cloud/iteration_N/point_cloud.ply, or when it is a
 * gbtrace run (has a model.gbt). GBT_ERR_ARGUMENT when a path is too long.
 */
gbt_status result_folder_find(const char *folder, result_folder *out, bool *found, gbt_error *err);

/**
 * Whether this value of cfg_args' `resolution` is a factor that divides width and height. Other values are a
 * width to resize to, and -1 leaves the size open (3DGS, utils/camera_utils.py).
 */
bool result_resolution_divides(double resolution);

#endif
