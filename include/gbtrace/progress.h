/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/progress.h -- progress, messages and warnings of a running call. */
#ifndef GBTRACE_PROGRESS_H
#define GBTRACE_PROGRESS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/api.h"

GBT_API_BEGIN

typedef enum gbt_event_kind {
    GBT_EVENT_PROGRESS, /* state of a stage: at most twice a second, and when it ends */
    GBT_EVENT_MESSAGE,
    GBT_EVENT_WARNING
} gbt_event_kind;

typedef struct gbt_event {
    gbt_event_kind kind;
    const char *text; /* one line of text without newline; borrowed for the call */
    /* The rest is set for GBT_EVENT_PROGRESS only. Unknown values are NaN, unknown counts 0. */
    const char *stage;    /* "train", "render", "score", "bake", "refine", "study"; when poses are estimated
                             "features", ...; borrowed for the call */
    uint64_t done, total; /* steps, views or runs of the stage; total 0: unknown, or a time limit decides */
    double fraction;      /* of the stage, [0, 1] */
    double seconds;       /* wall time of the stage; in training also that before `resume` */
    double seconds_left;
    double psnr; /* dB: in training a running mean over recent photos, in scoring that of the last view */
    double loss;
    size_t anchors, gaussians; /* anchors of the model, Gaussians of the last view */
} gbt_event;

typedef void (*gbt_listener)(const gbt_event *event, void *context);

/**
 * Set the function that receives events, for the whole process. Without a listener (NULL) events are lines on
 * stderr: on a terminal progress is one line that is overwritten, elsewhere one line every ten seconds.
 *
 * The listener is called by one thread at a time, and must not call the library. To stop a call that handles
 * signals (gbt_train(), gbt_evaluate(), gbt_compress(), gbt_pose(), gbt_view()) while it runs, here or in
 * another thread, use raise(SIGINT), once: after a second a further signal goes to the program's own handler,
 * which usually ends it.
 *
 * Threads: not while another call runs.
 */
void gbt_listen(gbt_listener to, void *context);

/**
 * Quote a text for a shell command that is shown to be copied: unchanged when a POSIX shell reads it as one
 * word, else in single quotes. Threads: any.
 *
 * @param size [in] of `out`, bytes, at least 1; what does not fit is cut off
 * @return `out`
 */
const char *gbt_shell_word(const char *text, char *out, size_t size);

GBT_API_END
#endif
