/* SPDX-License-Identifier: Apache-2.0 */
/* run/loaded_run.h -- a trained run opened for rendering: its model, its training settings, and the views of
   its data set. */
#ifndef GBT_RUN_LOADED_RUN_H
#define GBT_RUN_LOADED_RUN_H

#include "cells/draw.h"
#include "data/scene.h"
#include "gbtrace/train.h"
#include "io/model.h"
#include "train/config.h"
#include "frame/frame.h"
#include "train/photos.h"
#include "train/run_data.h"

typedef struct loaded_run {
    model model;
    gaussian_cloud cloud; /* with a file of plain Gaussians: these, in local coordinates; `model` then has no
                             anchors, only data about the scene */
    cell_store cells;     /* instead of `cloud`, for such a file larger than memory */
    cell_drawer cell_drawer;
    gbt_train_def def; /* the settings it was trained with; strings point into `strings` */
    config_strings strings;
    int picture_width;     /* width of photos that a result folder states, then def.downscale is 0; otherwise
                              0 */
    int reduced;           /* reduction that a result folder states (data/result_folder.h), then both others
                              are 0; otherwise 0 */
    run_data data;         /* where its data set is */
    bool data_is_known;    /* set it before loaded_run_open_views() after the data set was trained on: its
                              warnings are not repeated */
    scene scene;           /* cameras and points in the model's local coordinates */
    bool poses_refined;    /* the cameras are those of RUN/poses.json */
    bool held_out_aligned; /* with poses_refined: as RUN/poses.json says (train/pose_file.h) */
    photos photos;
    trace_settings settings;
    frame frame;
} loaded_run;

/**
 * Open RUN: a folder with model.gbt, a model file, or plain Gaussians, which have no data set, except in a
 * result folder of 3DGS: the one that its cfg_args names, or else its cameras.json.
 *
 * @param data      [in] data set folder; NULL: the one it was trained on
 * @param downscale [in] 0: as in training
 * @param out       [out] start from {0}; free with loaded_run_close() after success or failure
 */
gbt_status loaded_run_open(const char *run, const char *data, double downscale, loaded_run *out,
                           gbt_error *err);

/** The second half of loaded_run_open() with the run's own data set, for callers that have no `data`, of
   which errors then do not speak. */
gbt_status loaded_run_open_own_views(const char *run, loaded_run *out, gbt_error *err);

/** Remove the hint about `data` from an error text of loaded_run_open(), for programs that offer no such
    option. Returns whether there was one. */
bool loaded_run_cut_hint(char *text);

/** For callers that need anchors: GBT_ERR_ARGUMENT when the run is plain Gaussians. `run` is their file, for
    the message. */
gbt_status loaded_run_need_anchors(const loaded_run *r, const char *run, gbt_error *err);

/** The subject for frame_render(). */
frame_subject loaded_run_subject(const loaded_run *r);

/** loaded_run_open() without the data set (no views, no photos), for rendering other cameras. */
gbt_status loaded_run_open_model(const char *run, loaded_run *out, gbt_error *err);

/** Whether `run` is a .ply of plain Gaussians, or a result folder with one, that would need more than
    `memory` bytes. */
gbt_status loaded_run_is_larger(const char *run, size_t memory, bool *large, gbt_error *err);

/** Open a run that is larger than `memory`: its Gaussians are sorted into out->cells and can only be drawn by
    cell_draw(). `folder` is for the temporary file. */
gbt_status loaded_run_open_cells(const char *run, size_t memory, const char *folder, loaded_run *out,
                                 gbt_error *err);

/** The second half of loaded_run_open(), for a run without open views; `run` is its name in messages. */
gbt_status loaded_run_open_views(const char *run, const char *data, double downscale, loaded_run *out,
                                 gbt_error *err);

/** Close the views; does nothing when none are open. */
void loaded_run_close_views(loaded_run *r);

/** Use the render settings of plain Gaussians, on black, like other viewers. */
void loaded_run_draw_plain(loaded_run *r);

/** Make `r` render these plain Gaussians, given in world coordinates; local coordinates get their origin at
    gaussian_middle(), where floats are precise. Takes ownership of `cloud`, which becomes {0}. */
void loaded_run_take_cloud(loaded_run *r, gaussian_cloud *cloud);

void loaded_run_close(loaded_run *r);

/** The run's settings, with the near distance of this photo. */
trace_settings loaded_run_settings(const loaded_run *r, size_t view);

/** Render a view into r->frame.rgb, at the run's resolution. */
gbt_status loaded_run_render(loaded_run *r, size_t view, gbt_error *err);

/** Apply a preset to settings. GBT_OK, or GBT_ERR_ARGUMENT ("preset: ...") for an unknown preset. */
gbt_status loaded_run_preset(gbt_preset preset, trace_settings *settings, gbt_error *err);

enum { FILE_NAME_SIZE = 256 };

/** "a/b.jpg" becomes "a_b": a file name for a view, at most 200 bytes of UTF-8. */
void loaded_run_file_name(const char *view_name, char out[FILE_NAME_SIZE]);

/** The same for an open view. If another view has the same name ("a.png" and "a.jpg"), or files of such names
    beside it ("a.photo.png" and "a.png"), a hash of the whole name is appended. Cost: compares it with all
    others. */
void loaded_run_view_name(const loaded_run *r, size_t view, char out[FILE_NAME_SIZE]);

#endif
