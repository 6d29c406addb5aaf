/* SPDX-License-Identifier: Apache-2.0 */
/* view/http.h -- what every request is held to, and what every response carries. */
#ifndef GBT_VIEW_HTTP_H
#define GBT_VIEW_HTTP_H

#include <microhttpd.h>
#include <stdbool.h>

#include "view/answer.h"
#include "view/guard.h"

/** Why a request is refused before anybody looks at what it wants; 0: it is not. `why` is static. */
int http_refusal(struct MHD_Connection *connection, const guard *g, const char *path, const char *method,
                 const char **why);

/**
 * Send; the bytes are freed when they have been sent, or `with->bytes` are static and stay when `keeps`.
 *
 * A request that showed the token in its query gets it back as a cookie: the page's own requests need no
 * more.
 */
enum MHD_Result http_send(struct MHD_Connection *connection, const guard *g, const answer *with, bool keeps);

/** The page or one of its files; false when there is none of that name. */
bool http_page(const char *path, answer *out);

#endif
