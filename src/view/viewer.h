/* SPDX-License-Identifier: Apache-2.0 */
/* view/viewer.h -- what the viewer shows: the open run, which is replaced when training saves a newer model,
   and its last picture. */
#ifndef GBT_VIEW_VIEWER_H
#define GBT_VIEW_VIEWER_H

#include <stdatomic.h>
#include <sys/stat.h>

#include "run/loaded_run.h"
#include "view/answer.h"
#include "view/request.h"

/** What the frame's tree was built for. Zeroed before it is filled, because it is compared as bytes. */
typedef struct viewer_picture {
    gbt_camera camera; /* scene-local, without a shift within the pixels */
    gbt_renderer renderer;
    gbt_preset preset;
    float background[3], t_near;
    bool known;
} viewer_picture;

typedef struct viewer_state {
    const char *input, *data;              /* borrowed */
    char model_path[4096], log_path[4096]; /* log_path: empty if there is none */
    struct stat loaded;                    /* of the open model file, to notice a newer one */
    gbt_renderer trained;                  /* with background: those that the model was trained with */
    float background[3];
    loaded_run *run;         /* NULL: nothing has been saved yet */
    int64_t started;         /* microseconds: lets a page notice that another viewer process answers now */
    unsigned version;        /* 1, 2, ...: counts the models opened */
    char note[600];          /* shown to the user: why there is no picture, or no photo; empty: all is well */
    const atomic_bool *stop; /* optional (NULL), borrowed: once true, the current picture is abandoned */
    viewer_picture last;
    bool drawn; /* the frame holds the picture of `last`, not only its tree */
} viewer_state;

/**
 * Open INPUT, or prepare to wait for the first model of a run that is being trained.
 *
 * If the model's data set is missing and `data` names no other, the model is shown without photos.
 * @param out [out] start from {0}; free with viewer_close() after success or failure
 */
gbt_status viewer_open(const char *input, const char *data, viewer_state *out, gbt_error *err);
void viewer_close(viewer_state *s);

/** Open the model again if its file has been replaced, and return true. If that fails the old one stays and
    `note` says why. */
bool viewer_follow(viewer_state *s);

/** The status that the page polls: version, counts, log, note. JSON; free with mem_free(). NULL if out of
    memory. */
char *viewer_status(const viewer_state *s);

/** Answer any request of the page; a failure is an answer too. */
void viewer_answer(viewer_state *s, const request *what, answer *out);

/* ---- for the files of this folder ---- */

/** The camera of a request, scene-local. GBT_ERR_ARGUMENT for a view that does not exist, and for a size
    above the limits, which do not apply to photos. */
gbt_status viewer_camera(const viewer_state *s, const request *what, gbt_camera *out, gbt_error *err);

/** Build the frame's tree for `camera` with the settings of `what`, and with `draw` render its picture too.
    Does nothing if both are up to date. */
gbt_status viewer_prepare(viewer_state *s, const gbt_camera *camera, const request *what, bool draw,
                          gbt_error *err);

gbt_status viewer_render(viewer_state *s, const request *what, answer *out, gbt_error *err); /* picture.c */
gbt_status viewer_photo(viewer_state *s, const request *what, answer *out, gbt_error *err);  /* picture.c */
gbt_status viewer_pick(viewer_state *s, const request *what, answer *out, gbt_error *err);   /* pick.c */
gbt_status viewer_scene(const viewer_state *s, answer *out, gbt_error *err);                 /* scene.c */

#endif
