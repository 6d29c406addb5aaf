/* SPDX-License-Identifier: Apache-2.0 */
/* view/studio.h -- what is being looked at: the run that is open now, a newer one when training has saved it,
   and its last picture. */
#ifndef GBT_VIEW_STUDIO_H
#define GBT_VIEW_STUDIO_H

#include <stdatomic.h>
#include <sys/stat.h>

#include "run/loaded_run.h"
#include "view/answer.h"
#include "view/request.h"

/** Which picture the frame's tree was built for. Zeroed before it is filled: compared as bytes. */
typedef struct studio_picture {
    gbt_camera camera; /* scene-local, through the middle of the pixels */
    gbt_renderer renderer;
    gbt_preset preset;
    float background[3], t_near;
    bool known;
} studio_picture;

typedef struct studio {
    const char *input, *data;              /* borrowed */
    char model_path[4096], log_path[4096]; /* log_path: empty when there is none */
    struct stat loaded;                    /* of the model file that is open */
    gbt_renderer trained;                  /* what the model was trained to be drawn with, and in front of */
    float background[3];
    loaded_run *run;         /* NULL: nothing has been saved yet */
    int64_t started;         /* microseconds: tells a page that another viewer answers it now */
    unsigned version;        /* 1, 2, ... counts what was opened */
    char note[600];          /* for people: why there is no picture, or no photo; empty: all is well */
    const atomic_bool *stop; /* optional (NULL): once true a picture that is being drawn is given up;
                                borrowed */
    studio_picture last;
    bool drawn; /* the frame's picture is that of `last` too, not the tree alone */
} studio;

/**
 * Open INPUT, or make ready to wait for the first model of a run that is being trained.
 *
 * A model whose data set is not there is shown without photos, unless `data` names one.
 * @param out [out] start from {0}; free with studio_close() after success or failure
 */
gbt_status studio_open(const char *input, const char *data, studio *out, gbt_error *err);
void studio_close(studio *s);

/** Open the model again if its file is another one now; when that fails the old one stays and `note` says
    why. True: there is a new one. */
bool studio_follow(studio *s);

/** What the page polls: version, counts, log, note. JSON; free with mem_free(). NULL without memory. */
char *studio_status(const studio *s);

/** Answer any request of the page; a failure becomes an answer too. */
void studio_answer(studio *s, const request *what, answer *out);

/* ---- inside the room ---- */

/** The camera of a request, scene-local. GBT_ERR_ARGUMENT for a view that is not there, and for one of more
    pixels than a picture may have unless its photo is asked for. */
gbt_status studio_camera(const studio *s, const request *what, gbt_camera *out, gbt_error *err);

/** Make the frame's tree that of `camera`, drawn as `what` says, and with `draw` its picture too, unless they
    are. */
gbt_status studio_prepare(studio *s, const gbt_camera *camera, const request *what, bool draw,
                          gbt_error *err);

gbt_status studio_render(studio *s, const request *what, answer *out, gbt_error *err); /* picture.c */
gbt_status studio_photo(studio *s, const request *what, answer *out, gbt_error *err);  /* picture.c */
gbt_status studio_pick(studio *s, const request *what, answer *out, gbt_error *err);   /* pick.c */
gbt_status studio_scene(const studio *s, answer *out, gbt_error *err);                 /* scene.c */

#endif
