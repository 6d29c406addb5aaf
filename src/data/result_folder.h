/* SPDX-License-Identifier: Apache-2.0 */
/* data/result_folder.h -- the folder that the reference implementation of 3DGS leaves, and its descendants:
   where the Gaussians are, and what it was made of. */
#ifndef GBT_DATA_RESULT_FOLDER_H
#define GBT_DATA_RESULT_FOLDER_H

#include <stdbool.h>
#include <stddef.h>

#include "gbtrace/status.h"

enum { RESULT_PATH_SIZE = 4096 };

typedef struct result_folder {
    char ply[RESULT_PATH_SIZE];    /* FOLDER/point_cloud/iteration_N/point_cloud.ply of the largest N */
    unsigned long iteration;       /* N */
    char source[RESULT_PATH_SIZE]; /* cfg_args' source_path, the data set; empty when it does not say */
    bool white_background;         /* cfg_args */
    double downscale;              /* cfg_args' resolution and images_N, of the data set's photos; 0: it does
                                      not say */
    int width;                     /* the same as the width that photos are brought to; 0: it is no width */
    int reduced;                   /* N of images_N where `resolution` leaves the size open: photos are
                                      divided by N, and wider ones to the usual width. Else 0 */
} result_folder;

/**
 * Look into `folder`. `*found` is false when it has no point_cloud/iteration_N/point_cloud.ply, or is a run
 * of ours (model.gbt). GBT_ERR_ARGUMENT when a path is too long.
 */
gbt_status result_folder_find(const char *folder, result_folder *out, bool *found, gbt_error *err);

/** Whether cfg_args' `resolution=` of this value divides the photos' width and height; others are the
 * width that they are brought to, and -1 leaves it open (3DGS, utils/camera_utils.py). */
bool result_resolution_divides(double resolution);

#endif
