/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/progress.h -- what a long call says while it runs. */
#ifndef GBTRACE_PROGRESS_H
#define GBTRACE_PROGRESS_H

#include <stddef.h>
#include <stdint.h>

#include "gbtrace/api.h"

GBT_API_BEGIN

typedef enum gbt_event_kind {
    GBT_EVENT_PROGRESS, /* how far a stage is: at most twice a second, and when it ends */
    GBT_EVENT_MESSAGE,
    GBT_EVENT_WARNING
} gbt_event_kind;

typedef struct gbt_event {
    gbt_event_kind kind;
    const char *text; /* one line for a person, without newline; borrowed for the call */
    /* Of GBT_EVENT_PROGRESS alone. What is not known is NaN, or 0 where it counts. */
    const char *stage; /* "train", "render", "score", "bake", "refine", "study"; of poses "features", ... */
    uint64_t done, total; /* steps, views or runs of the stage; total 0: not known, or time decides */
    double fraction;      /* of the stage, [0, 1] */
    double seconds, seconds_left;
    double psnr; /* dB: of training photos in the mean of late, of the view just scored */
    double loss;
    size_t anchors, gaussians; /* of the model; of the last view */
} gbt_event;

typedef void (*gbt_listener)(const gbt_event *event, void *context);

/**
 * Who is told of events, for the whole process. Without a listener (NULL) they are lines on stderr: one line
 * that is written over, on a terminal; elsewhere progress every ten seconds.
 *
 * The listener is called by one thread at a time, and must not call the library.
 * Threads: not while another call runs.
 */
void gbt_listen(gbt_listener to, void *context);

/**
 * Text for a command that is shown to be copied: as it is where a POSIX shell takes it for one word, else in
 * single quotes.
 *
 * @param size [in] of `out`, at least 1; what does not fit is cut off
 * @return `out`
 */
const char *gbt_shell_word(const char *text, char *out, size_t size);

GBT_API_END
#endif
