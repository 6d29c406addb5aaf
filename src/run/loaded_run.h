/* SPDX-License-Identifier: Apache-2.0 */
/* run/loaded_run.h -- a trained run opened for rendering: its model, its settings, the views of its data
   set. */
#ifndef GBT_RUN_LOADED_RUN_H
#define GBT_RUN_LOADED_RUN_H

#include "cells/draw.h"
#include "data/scene.h"
#include "gbtrace/train.h"
#include "io/model_file.h"
#include "train/config.h"
#include "frame/frame.h"
#include "train/photos.h"
#include "train/run_data.h"

typedef struct loaded_run {
    model model;
    gaussian_cloud cloud; /* of a file of plain Gaussians, local coordinates; then `model` has no anchors and
                             is about the scene alone */
    cell_store cells;     /* of such a file that is larger than memory, in place of `cloud` */
    cell_drawer cell_drawer;
    gbt_train_def def; /* the settings it was trained with; strings point into `strings` */
    config_strings strings;
    int picture_width;     /* of a result folder that says so; then def.downscale is 0. Else 0 */
    int reduced;           /* of a result folder (data/result_folder.h); then both are 0. Else 0 */
    run_data data;         /* where its data set is */
    scene scene;           /* cameras and points in the model's local coordinates */
    bool poses_refined;    /* the cameras are those of RUN/poses.json */
    bool held_out_aligned; /* then: as it says (train/pose_file.h) */
    photos photos;
    trace_settings settings;
    frame frame;
} loaded_run;

/**
 * Open RUN: a folder with model.gbt, a model file, or plain Gaussians, which know no
 * data set. A result folder of 3DGS may: the one that its cfg_args names, else its cameras.json.
 *
 * @param data      [in] data set folder; NULL: the one it was trained on
 * @param downscale [in] 0: as in training
 * @param out       [out] start from {0}; free with loaded_run_close() after success or failure
 */
gbt_status loaded_run_open(const char *run, const char *data, double downscale, loaded_run *out,
                           gbt_error *err);

/** Cut off what an error of it says of `data`, for programs that cannot name it then. Whether it did. */
bool loaded_run_cut_hint(char *text);

/** GBT_ERR_ARGUMENT when it holds plain Gaussians, `run` is their file, and anchors are wanted. */
gbt_status loaded_run_need_anchors(const loaded_run *r, const char *run, gbt_error *err);

/** What frames show. */
frame_subject loaded_run_subject(const loaded_run *r);

/** The same without the data set: no views, no photos. For cameras that come from elsewhere. */
gbt_status loaded_run_open_model(const char *run, loaded_run *out, gbt_error *err);

/** Whether it is a .ply of plain Gaussians, or a result folder with one, that would take more than `memory`
    bytes. */
gbt_status loaded_run_is_larger(const char *run, size_t memory, bool *large, gbt_error *err);

/** What is larger than `memory`: sorted into out->cells, to be drawn by cell_draw() alone. `folder`: where
   the temporary file is made. */
gbt_status loaded_run_open_cells(const char *run, size_t memory, const char *folder, loaded_run *out,
                                 gbt_error *err);

/** The other half of loaded_run_open(), for a run that has no views open: `run` is what messages call it. */
gbt_status loaded_run_open_views(const char *run, const char *data, double downscale, loaded_run *out,
                                 gbt_error *err);

/** Back to no views, whether there were any or not. */
void loaded_run_close_views(loaded_run *r);

/** Draw as plain Gaussians are drawn: on black, as every viewer does. */
void loaded_run_draw_plain(loaded_run *r);

/** Let `r` show these plain Gaussians, given in world coordinates, around gaussian_middle(), where floats are
    fine. `cloud` is taken over, and is {0} then. */
void loaded_run_take_cloud(loaded_run *r, gaussian_cloud *cloud);

void loaded_run_close(loaded_run *r);

/** The run's settings, with the near distance of this photo. */
trace_settings loaded_run_settings(const loaded_run *r, size_t view);

/** Render a view into r->frame.rgb, at the run's resolution. */
gbt_status loaded_run_render(loaded_run *r, size_t view, gbt_error *err);

/** Settings by a preset. GBT_OK, or GBT_ERR_ARGUMENT ("preset: ...") for what is none. */
gbt_status loaded_run_preset(gbt_preset preset, trace_settings *settings, gbt_error *err);

enum { FILE_NAME_SIZE = 256 };

/** "a/b.jpg" becomes "a_b": a file name for what belongs to a view, of 200 bytes of UTF-8 at most. */
void loaded_run_file_name(const char *view_name, char out[FILE_NAME_SIZE]);

/** The same for an open view; where another view's is the same ("a.png" and "a.jpg"), with a hash of the
   whole name behind it. Cost: goes over all views. */
void loaded_run_view_name(const loaded_run *r, size_t view, char out[FILE_NAME_SIZE]);

#endif
