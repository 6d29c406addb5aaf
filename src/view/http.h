/* SPDX-License-Identifier: Apache-2.0 */
/* view/http.h -- the checks of every request, and the headers of every response. */
#ifndef GBT_VIEW_HTTP_H
#define GBT_VIEW_HTTP_H

#include <microhttpd.h>
#include <stdbool.h>

#include "view/answer.h"
#include "view/guard.h"

/** The HTTP status code with which a request is refused before it is interpreted; 0: it is accepted. `why` is
    static. */
int http_refusal(struct MHD_Connection *connection, const guard *g, const char *path, const char *method,
                 const char **why);

/**
 * Send an answer. Its bytes are freed once they are sent, unless `keeps`: then they are static.
 *
 * If the request had the token in its query, the response sets it as a cookie, so that the page's own
 * requests need not carry it.
 */
enum MHD_Result http_send(struct MHD_Connection *connection, const guard *g, const answer *with, bool keeps);

/** The page or one of its files; false if there is no file of that name. */
bool http_page(const char *path, answer *out);

#endif
