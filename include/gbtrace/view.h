/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/view.h -- view a scene in a web browser, on this machine or, with a token, from another. */
#ifndef GBTRACE_VIEW_H
#define GBTRACE_VIEW_H

#include <stdint.h>

#include "gbtrace/status.h"

GBT_API_BEGIN

typedef struct gbt_view_def {
    const char *data; /* data set whose photos are shown for comparison; NULL: the one it was trained on;
                         without it, no photos. Default NULL */
    int port;         /* [0, 65535]; 0: any free one. Default 8470 */
    const char *host; /* IPv4 address of this machine to listen at; "0.0.0.0": all of them. NULL, "localhost":
                         127.0.0.1. Default NULL */
    void (*ready)(const char *url, void *context); /* called once, when the URL (borrowed for the call) can be
                                                      opened; NULL: nothing is called. Default NULL */
    void *context;                                 /* passed to ready() */
    uint32_t cookie_;                              /* set by gbt_view_def_default() */
} gbt_view_def;

gbt_view_def gbt_view_def_default(void);

/**
 * Serve the page described in docs/viewing.md at http://HOST:PORT until SIGINT or SIGTERM; then return
 * GBT_OK.
 *
 * At an address outside 127.0.0.0/8 a random token is made and included in the URL of ready(); requests
 * without it are refused.
 *
 * A run that is still training is followed: a new model.gbt is shown within a second or so. When the run has
 * not saved a model yet, this call waits for it.
 *
 * @param input [in] RUN (a folder that training writes), a model file, or plain Gaussians in any format of
 *                   gbt_export_format_at()
 * @return GBT_OK, GBT_ERR_ARGUMENT (port, host), GBT_ERR_IO (also: the port is in use, the host is not this
 *         machine's), GBT_ERR_FORMAT, GBT_ERR_NO_MEMORY
 *
 * Threads: one call at a time (it catches signals). It renders on the threads that gbt_set_threads() allows,
 * the calling thread among them, and answers HTTP on one more.
 */
gbt_status gbt_view(const char *input, const gbt_view_def *def, gbt_error *err);

GBT_API_END
#endif
